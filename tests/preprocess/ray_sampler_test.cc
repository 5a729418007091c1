// Rays drawn from light fields: their density against flux and first moments in closed form.
#include "luxfield/preprocess/ray_sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "luxfield/core/error.h"
#include "tests/seed.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LightField;
using lightfield::PosedLightField;

constexpr int kRays = 200000;

PosedLightField Field(lightfield::BasisKind kind) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.2;
  g.unit = lightfield::FluxUnit::kLumen;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind), 3, 2, 0.01);
  g.lattice = {5, 4, -0.05, 0.03, 0.02, 0.015};
  LightField field(g);
  core::Random random(5, 1);
  for (float& c : field.data) c = static_cast<float>(random.Uniform());
  return {"", {}, field};
}

// Mean of u, v, s, t over E / flux: sum of C times the products' first moments.
struct Moments {
  double u = 0, v = 0, s = 0, t = 0;
};
Moments Exact(const LightField& field) {
  const auto& g = field.geometry;
  Moments sum;
  double flux = 0;
  for (int m = 0; m < g.grid.count(); ++m) {
    const auto centre = g.grid.centre(m % g.grid.width, m / g.grid.width);
    for (int row = 0; row < g.lattice.height; ++row)
      for (int column = 0; column < g.lattice.width; ++column) {
        const double c = field.image(m, 0)[row * g.lattice.width + column];
        const auto texel = g.lattice.centre(row, column);
        flux += c;
        sum.u += c * centre.x, sum.v += c * centre.y, sum.s += c * texel.x, sum.t += c * texel.y;
      }
  }
  return {sum.u / flux, sum.v / flux, sum.s / flux, sum.t / flux};
}

void ExpectMean(double sum, double sum_of_squares, double exact) {
  const double mean = sum / kRays, variance = sum_of_squares / kRays - mean * mean;
  EXPECT_LT(std::abs(mean - exact), 5 * std::sqrt(variance / kRays)) << mean << " " << exact;
}

TEST(RaySampler, HasTheMomentsOfTheFluxDensity) {
  const auto seed = TestSeed(17);
  for (const auto kind : {lightfield::BasisKind::kBox, lightfield::BasisKind::kBilinear,
                          lightfield::BasisKind::kQuadratic, lightfield::BasisKind::kBspline2}) {
    const PosedLightField field = Field(kind);
    const RaySampler sampler(std::span(&field, 1), "x");
    EXPECT_NEAR(sampler.flux() / lightfield::TotalFlux(field.field)[0], 1, 1e-12);
    core::Random random(seed, 1);
    double sums[4] = {}, squares[4] = {};
    for (int k = 0; k < kRays; ++k) {
      const DrawnRay ray = sampler.Draw(random);
      const double to_i = 0.2 / ray.direction.z;
      const double values[4] = {ray.position_m.x, ray.position_m.y,
                                ray.position_m.x + to_i * ray.direction.x,
                                ray.position_m.y + to_i * ray.direction.y};
      for (int q = 0; q < 4; ++q) sums[q] += values[q], squares[q] += values[q] * values[q];
    }
    const Moments exact = Exact(field.field);
    ExpectMean(sums[0], squares[0], exact.u);
    ExpectMean(sums[1], squares[1], exact.v);
    ExpectMean(sums[2], squares[2], exact.s);
    ExpectMean(sums[3], squares[3], exact.t);
  }
}

// Of bspline2, second moments too: the variance of the sum of three uniforms is 1/4 h^2.
TEST(RaySampler, SpreadsAsTheBasisDoes) {
  PosedLightField one = Field(lightfield::BasisKind::kBspline2);
  std::fill(one.field.data.begin(), one.field.data.end(), 0.0f);
  one.field.image(2, 0)[7] = 1;
  const RaySampler sampler(std::span(&one, 1), "x");
  core::Random random(TestSeed(3), 1);
  const double centre = one.field.geometry.grid.centre(2, 0).x;
  double square = 0;
  for (int k = 0; k < kRays; ++k) {
    const double x = (sampler.Draw(random).position_m.x - centre) / 0.01;
    EXPECT_LT(std::abs(x), 1.5);
    square += x * x;
  }
  // Fourth moment of the sum of three uniforms: 13/80.
  EXPECT_NEAR(square / kRays, 0.25, 5 * std::sqrt((13.0 / 80 - 1.0 / 16) / kRays));
}

// Two functions that overlap, C = (1, -c): rays follow max(B0 - c B1, 0) along u.
TEST(RaySampler, LeavesNegativeLightOut) {
  PosedLightField field = Field(lightfield::BasisKind::kBilinear);
  std::fill(field.field.data.begin(), field.field.data.end(), 0.0f);
  field.field.image(0, 0)[7] = 1;
  field.field.image(1, 0)[7] = -0.5f;
  const RaySampler sampler(std::span(&field, 1), "x");
  EXPECT_NEAR(sampler.positive_flux() / sampler.flux(), 2, 1e-12);
  core::Random random(TestSeed(9), 1);
  const double u0 = field.field.geometry.grid.u0_m;
  int beyond = 0, first = 0, proposals = 0;
  for (int k = 0; k < kRays; ++k) {
    const DrawnRay ray = sampler.Draw(random);
    const double x = (ray.position_m.x - u0) / 0.01;
    proposals += ray.proposals;
    first += x < 1;
    // On the second cell B0 - B1/2 = 1 - 3 f / 2, positive up to f = 2/3.
    beyond += x > 1 + 2.0 / 3;
  }
  EXPECT_EQ(beyond, 0);
  // First cell: 1/2; second: integral of 1 - 3 f / 2 up to 2/3 = 1/3.
  const double share = 0.5 / (0.5 + 1.0 / 3);
  EXPECT_NEAR(double(first) / kRays, share, 5 * std::sqrt(share * (1 - share) / kRays));
  // Kept: 1/2 + 1/3 of a proposal's integral of B0, which is 1.
  const double kept = 5.0 / 6;
  EXPECT_NEAR(double(kRays) / proposals, kept, 5 * std::sqrt(kept * (1 - kept) / proposals));
}

// Beyond the last function of a row there is none: not the first one of the next row, which is dark
// where the last one shines.
TEST(RaySampler, RowsEndWithTheirLastFunction) {
  PosedLightField field = Field(lightfield::BasisKind::kBilinear);
  const auto& grid = field.field.geometry.grid;
  std::fill(field.field.data.begin(), field.field.data.end(), 0.0f);
  field.field.image(grid.index(2, 0), 0)[7] = 1;
  field.field.image(grid.index(0, 1), 0)[7] = -0.5f;
  const RaySampler sampler(std::span(&field, 1), "x");
  core::Random random(TestSeed(11), 1);
  int right = 0;
  for (int k = 0; k < kRays; ++k) {
    const DrawnRay ray = sampler.Draw(random);
    EXPECT_EQ(ray.proposals, 1);
    right += ray.position_m.x > grid.centre(2, 0).x;
  }
  EXPECT_NEAR(double(right) / kRays, 0.5, 5 * std::sqrt(0.25 / kRays));
}

// Two fields, one turned: rays of each with its share of the flux, about its own axis.
TEST(RaySampler, FieldsShareRaysByFlux) {
  PosedLightField ahead = Field(lightfield::BasisKind::kBspline2), aside = ahead;
  ahead.name = "+z", aside.name = "+x";
  for (float& c : aside.field.data) c /= 3;
  aside.luminaire_from_field = {{0, 0, 1, 0, 1, 0, -1, 0, 0}, {0.5, 0, 0}};
  const std::vector<PosedLightField> lamp = {ahead, aside};
  const RaySampler sampler(lamp, "x");
  core::Random random(TestSeed(21), 1);
  int turned = 0;
  for (int k = 0; k < kRays; ++k) {
    const DrawnRay ray = sampler.Draw(random);
    const bool on_second = std::abs(ray.position_m.x - 0.5) < 1e-12;
    turned += on_second;
    EXPECT_GT(on_second ? ray.direction.x : ray.direction.z, 0);
    EXPECT_NEAR(lightfield::Length(ray.direction), 1, 1e-12);
  }
  EXPECT_NEAR(double(turned) / kRays, 0.25, 5 * std::sqrt(0.25 * 0.75 / kRays));
}

// C of three channels, equal in all texels: each ray's colour is the field's, Y = 1.
TEST(RaySampler, RaysHaveTheFieldsColour) {
  PosedLightField field = Field(lightfield::BasisKind::kBilinear);
  auto g = field.field.geometry;
  g.channels = 3;
  field.field = LightField(g);
  for (int m = 0; m < g.grid.count(); ++m)
    for (int channel = 0; channel < 3; ++channel)
      for (float& c : field.field.image(m, channel)) c = static_cast<float>(channel + 1);
  const RaySampler sampler(std::span(&field, 1), "x");
  core::Random random(TestSeed(22), 1);
  const double y = 0.2126 * 1 + 0.7152 * 2 + 0.0722 * 3;
  for (int k = 0; k < 1000; ++k) {
    const DrawnRay ray = sampler.Draw(random);
    for (std::size_t channel = 0; channel < 3; ++channel)
      EXPECT_NEAR(ray.colour[channel], double(channel + 1) / y, 1e-6);
  }
}

TEST(RaySampler, DarkFieldsAreRefused) {
  PosedLightField field = Field(lightfield::BasisKind::kBox);
  std::fill(field.field.data.begin(), field.field.data.end(), 0.0f);
  EXPECT_THROW(RaySampler(std::span(&field, 1), "x"), InputError);
}

}  // namespace
}  // namespace luxfield::preprocess
