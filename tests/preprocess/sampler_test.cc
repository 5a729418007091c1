// Directions drawn on the host: density against draws and quadrature, means against the closed
// form, round trips, bounds and extremes.
#include "luxfield/preprocess/sampler.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_vector.h"
#include "tests/render/chi_squared.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Normalized;
using lightfield::Vec2;
using lightfield::Vec3;
using render::LuminaireShape;
using render::StructuredLuminaire;

constexpr std::uint64_t kSeed = 20261124;

struct Lamp {
  std::string name;
  LightField field;
};

std::vector<Lamp> Lamps() {
  LuminaireShape shape;
  std::vector<Lamp> lamps{{"rings", StructuredLuminaire("rings", shape, kSeed)}};
  shape.basis = Basis::Make(BasisKind::kBox);
  lamps.push_back({"noise, box", StructuredLuminaire("noise", shape, kSeed)});
  shape.basis = Basis::Make(BasisKind::kBilinear);
  shape.channels = 3;
  lamps.push_back({"facets, bilinear, RGB", StructuredLuminaire("facets", shape, kSeed)});
  shape.basis = Basis::Make(BasisKind::kQuadratic, 0.5);
  lamps.push_back(
      {"signed RGB, quadratic", render::WithSigns(StructuredLuminaire("rings", shape, kSeed))});
  return lamps;
}

struct Place {
  std::string name;
  Receiver receiver;
};

// Delta is 0.3 m; supports reach 41 mm from the axis, images 150 mm.
std::vector<Place> Places() {
  const auto facing = [](Vec3 p, Vec3 at) { return Receiver{p, Normalized(at - p)}; };
  return {{"1 m in front", facing({0.1, -0.05, 1}, {0, 0, 0})},
          {"just before I", facing({0.03, 0.02, 0.3005}, {0, 0, 0})},
          {"on I", facing({-0.02, 0.041, 0.3}, {0, 0, 0})},
          {"between the planes", facing({0.05, 0.01, 0.2}, {0, 0, 0})},
          {"the horizon cuts F", {{0.01, 0, 0.6}, Normalized({1, 0, -0.02})}},
          {"40 m away", facing({4, 3, 40}, {0, 0.02, 0})}};
}

// The density of u on F, per area, that Pdf stands for.
double DensityOfU(const ReceiverSampler& lamp, Vec3 p, Vec2 u) {
  const Vec3 to_light{u.x - p.x, u.y - p.y, -p.z};
  const double r = Length(to_light);
  return lamp.Pdf((1 / r) * to_light) * p.z / (r * r * r);
}

// Bins of F: each cell in 3 x 3 parts, 40 x 40 midpoints in each.
struct Bins {
  int width, height;
  std::vector<double> expected;
  double total = 0;
};

Bins BinsOf(const LightFieldSampler& sampler, const Receiver& receiver, int fine) {
  const auto& grid = sampler.field().geometry.grid;
  const ReceiverSampler lamp = sampler.At(receiver);
  Bins bins{3 * sampler.tables().grid_width, 3 * sampler.tables().grid_height, {}};
  const double side = grid.spacing_m / 3;
  for (int y = 0; y < bins.height; ++y)
    for (int x = 0; x < bins.width; ++x) {
      double sum = 0;
      for (int k = 0; k < fine * fine; ++k)
        sum += DensityOfU(lamp, receiver.p,
                          {grid.u0_m + side * (x + (k % fine + 0.5) / fine),
                           grid.v0_m + side * (y + (k / fine + 0.5) / fine)});
      bins.expected.push_back(sum * side * side / (fine * fine));
      bins.total += bins.expected.back();
    }
  return bins;
}

TEST(LightFieldSampler, DensityIntegratesToOneAndDrawsFollowIt) {
  for (const Lamp& lamp : Lamps()) {
    const LightFieldSampler sampler(lamp.field);
    const auto& grid = sampler.field().geometry.grid;
    for (const Place& place : Places()) {
      SCOPED_TRACE(lamp.name + ", " + place.name);
      const Bins bins = BinsOf(sampler, place.receiver, 24);
      // Midpoints miss the borders of texels: a window holds up to 40 x 30 of them.
      EXPECT_NEAR(bins.total, 1, 0.02);
      const ReceiverSampler seen = sampler.At(place.receiver);
      core::Random random(kSeed, 5);
      std::vector<double> observed(bins.expected.size());
      for (int k = 0; k < 20000; ++k) {
        const double x = random.Uniform(), y = random.Uniform();
        const auto sample = seen.Sample({x, y});
        ASSERT_TRUE(sample);
        const int column = static_cast<int>(3 * (sample->u.x - grid.u0_m) / grid.spacing_m),
                  row = static_cast<int>(3 * (sample->u.y - grid.v0_m) / grid.spacing_m);
        observed[std::clamp(row, 0, bins.height - 1) * bins.width +
                 std::clamp(column, 0, bins.width - 1)] += 1;
      }
      // 24 figures, and quadrature of a few permille: 5 deviations.
      EXPECT_LT(
          render::ChiSquaredDeviations(bins.expected, observed, lamp.name + ", " + place.name), 5);
    }
  }
}

TEST(LightFieldSampler, MeanWeightIsTheIrradianceInClosedForm) {
  for (const Lamp& lamp : Lamps()) {
    const LightFieldSampler sampler(lamp.field);
    for (const Place& place : Places()) {
      SCOPED_TRACE(lamp.name + ", " + place.name);
      const ReceiverSampler seen = sampler.At(place.receiver);
      const auto exact =
          lightfield::ExactIrradiance(lamp.field, place.receiver.p, place.receiver.n);
      EXPECT_EQ(seen.Irradiance(), exact);
      constexpr int kDraws = 20000;
      std::array<double, 3> sum{}, squares{};
      core::Random random(kSeed, 6);
      for (int k = 0; k < kDraws; ++k) {
        const double x = random.Uniform(), y = random.Uniform();
        const auto sample = seen.Sample({x, y});
        ASSERT_TRUE(sample);
        for (int c = 0; c < 3; ++c) {
          sum[c] += sample->weight[c];
          squares[c] += sample->weight[c] * sample->weight[c];
        }
      }
      for (int c = 0; c < 3; ++c) {
        const double mean = sum[c] / kDraws,
                     sigma = std::sqrt((squares[c] / kDraws - mean * mean) / kDraws);
        const double z = (mean - exact[c]) / sigma;
        if (c == 0)
          std::printf("%s, %s: %.5g, exact %.5g, z %.2f, deviation of one sample %.2f\n",
                      lamp.name.c_str(), place.name.c_str(), mean, exact[c], z,
                      sigma * std::sqrt(double(kDraws)) / std::abs(exact[c]));
        EXPECT_LT(std::abs(z), 4.5);
      }
    }
  }
}

TEST(LightFieldSampler, SamplesAgreeWithPdfAndRadiance) {
  for (const Lamp& lamp : Lamps()) {
    const LightFieldSampler sampler(lamp.field);
    const auto& g = lamp.field.geometry;
    for (const Place& place : Places()) {
      SCOPED_TRACE(lamp.name + ", " + place.name);
      const ReceiverSampler seen = sampler.At(place.receiver);
      core::Random random(kSeed, 7);
      for (int k = 0; k < 500; ++k) {
        const double x = random.Uniform(), y = random.Uniform();
        const auto sample = seen.Sample({x, y});
        ASSERT_TRUE(sample);
        EXPECT_NEAR(Length(sample->direction), 1, 1e-12);
        // The point lies on the line from p through u, at I.
        const double t = (place.receiver.p.z - g.delta_m) / place.receiver.p.z;
        const Vec3 on_image = place.receiver.p + t * sample->distance_m * sample->direction;
        EXPECT_NEAR(on_image.x, sample->s.x, 1e-12);
        EXPECT_NEAR(on_image.y, sample->s.y, 1e-12);
        EXPECT_NEAR(on_image.z, g.delta_m, 1e-12);
        // Next to a texel's border rounding decides to which side a direction belongs.
        const double column = g.lattice.column_of_s(sample->s.x),
                     row = g.lattice.row_of_t(sample->s.y);
        if (std::abs(column - std::round(column)) < 1e-6 || std::abs(row - std::round(row)) < 1e-6)
          continue;
        EXPECT_NEAR(seen.Pdf(sample->direction), sample->pdf, 1e-6 * sample->pdf);
        const auto radiance = seen.Radiance(sample->direction);
        const double largest =
            std::max({std::abs(radiance[0]), std::abs(radiance[1]), std::abs(radiance[2]), 1e-12});
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(sample->radiance[c], radiance[c], 1e-6 * largest);
          const double cosine = std::max(0.0, Dot(place.receiver.n, sample->direction));
          EXPECT_NEAR(sample->weight[c], sample->radiance[c] * cosine / sample->pdf,
                      1e-12 * std::abs(sample->weight[c]));
        }
      }
    }
  }
}

// Of one channel |weight| <= 4 q S, S = delta^2/z^3 sum_c w_c M_c; S by quadrature of the tables.
TEST(LightFieldSampler, WeightsAreBounded) {
  const std::pair<BasisKind, double> bounds[] = {
      {BasisKind::kBox, 1}, {BasisKind::kBilinear, 4}, {BasisKind::kBspline2, 9}};
  for (const auto& [kind, q] : bounds) {
    LuminaireShape shape;
    shape.basis = Basis::Make(kind);
    const LightField field = StructuredLuminaire("noise", shape, kSeed);
    const LightFieldSampler sampler(field);
    const auto& grid = field.geometry.grid;
    const double h = grid.spacing_m;
    for (const Place& place : Places()) {
      const Vec3 p = place.receiver.p;
      const double tau = field.geometry.delta_m / p.z;
      double s = 0;
      constexpr int kFine = 60;
      for (int b = 0; b < sampler.tables().grid_height; ++b)
        for (int a = 0; a < sampler.tables().grid_width; ++a) {
          const Vec3 centre{grid.u0_m + (a + 0.5) * h, grid.v0_m + (b + 0.5) * h, 0};
          double largest = 0, mass = 0;
          for (int k = 0; k < 4; ++k)
            largest = std::max(largest,
                               Dot(place.receiver.n,
                                   centre + Vec3{h * (k % 2 - 0.5), h * (k / 2 - 0.5), 0.0} - p));
          if (largest <= 0) continue;
          const int cell = b * sampler.tables().grid_width + a;
          const std::uint64_t* sat = sampler.tables().cell(cell);
          const int stride = sampler.tables().width + 1;
          for (int k = 0; k < kFine * kFine; ++k) {
            const Vec2 u{grid.u0_m + h * (a + (k % kFine + 0.5) / kFine),
                         grid.v0_m + h * (b + (k / kFine + 0.5) / kFine)};
            const double x = field.geometry.lattice.column_of_s(tau * p.x + (1 - tau) * u.x),
                         y = field.geometry.lattice.row_of_t(tau * p.y + (1 - tau) * u.y);
            if (!(x >= 0 && y >= 0 && x < shape.width && y < shape.height)) continue;
            const std::uint64_t* at = sat + int(y) * stride + int(x);
            mass += std::ldexp(double(at[stride + 1] - at[stride] - at[1] + at[0]),
                               -sampler.tables().exponent[cell]);
          }
          const double middle = Dot(place.receiver.n, centre - p);
          s += std::max(middle, largest / 4) * mass * h * h / (kFine * kFine);
        }
      s *= field.geometry.delta_m * field.geometry.delta_m / std::pow(p.z, 3);
      const ReceiverSampler seen = sampler.At(place.receiver);
      core::Random random(kSeed, 8);
      double most = 0;
      for (int k = 0; k < 20000; ++k) {
        const double x = random.Uniform(), y = random.Uniform();
        most = std::max(most, seen.Sample({x, y})->weight[0]);
      }
      std::printf("%s, %s: largest weight %.2f times the mean bound, at most %.0f\n",
                  shape.basis.name().c_str(), place.name.c_str(), most / s, 4 * q);
      EXPECT_LT(most, 4 * q * s * 1.02) << place.name;
    }
  }
}

TEST(LightFieldSampler, SeesNothingWhereThereIsNothing) {
  LuminaireShape shape;
  const LightFieldSampler dark(render::EmptyLuminaire(shape)),
      lamp(StructuredLuminaire("rings", shape, kSeed));
  const Vec3 back{0, 0, -1};
  EXPECT_FALSE(dark.At({{0, 0, 1}, back}).Sample({0.5, 0.5}));
  EXPECT_EQ(dark.At({{0, 0, 1}, back}).Pdf(back), 0);
  EXPECT_FALSE(lamp.At({{0, 0, 0}, back}).Sample({0.5, 0.5}));       // on F
  EXPECT_FALSE(lamp.At({{0, 0, -1}, back}).Sample({0.5, 0.5}));      // behind it
  EXPECT_FALSE(lamp.At({{0, 0, 1}, {0, 0, 1}}).Sample({0.5, 0.5}));  // facing away
  EXPECT_FALSE(lamp.At({{50, 0, 1}, back}).Sample({0.5, 0.5}));      // beside the beam
  const auto beside = lamp.At({{0, 0, 1}, back});
  EXPECT_EQ(beside.Pdf({0, 0, 1}), 0);
  EXPECT_EQ(beside.Pdf(Normalized({1, 0, -0.1})), 0);
  EXPECT_EQ(beside.Radiance({0, 0, 1})[0], 0);
}

// Both ends of xi, and places at which windows are far below or above a texel: finite everywhere.
TEST(LightFieldSampler, HoldsAtExtremes) {
  LuminaireShape shape;
  const LightFieldSampler sampler(StructuredLuminaire("noise", shape, kSeed));
  const double almost_one = 1 - 0x1p-53;
  for (const double z : {1e-6, 0.01, 0.3 - 1e-9, 0.3, 0.3 + 1e-12, 0.3 + 1e-9, 0.30001, 1e3, 1e6})
    for (const double x : {0.0, 0x1p-53, 0.3, almost_one})
      for (const double y : {0.0, 0.7, almost_one}) {
        const auto sample = sampler.At({{0.001, -0.002, z}, {0, 0, -1}}).Sample({x, y});
        if (!sample) continue;
        EXPECT_GT(sample->pdf, 0) << z;
        EXPECT_TRUE(std::isfinite(sample->pdf)) << z;
        EXPECT_TRUE(std::isfinite(sample->weight[0])) << z;
        EXPECT_GE(sample->weight[0], 0) << z;
      }
  // Far away the mean of the weights is I / r^2.
  const Vec3 p{0, 0, 1e6};
  const ReceiverSampler seen = sampler.At({p, {0, 0, -1}});
  double sum = 0;
  core::Random random(kSeed, 9);
  constexpr int kDraws = 4000;
  for (int k = 0; k < kDraws; ++k) {
    const double x = random.Uniform(), y = random.Uniform();
    sum += seen.Sample({x, y})->weight[0];
  }
  const double expected = lightfield::FarFieldIntensity(sampler.field(), {0, 0, 1})[0] / 1e12;
  EXPECT_NEAR(sum / kDraws, expected, 0.1 * expected);
}

}  // namespace
}  // namespace luxfield::preprocess
