#include "luxfield/planning/planned_filters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "luxfield/capture/plan/bracket_rungs.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/planning/exposure_choice.h"
#include "luxfield/planning/filter_choice.h"
#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::planning {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Vec3;
using preprocess::Receiver;

constexpr double kDelta_m = 0.25, kSpacing_m = 0.02;

// Irradiance of a point on the axis of a square Lambertian emitter, facing it (any radiometry text;
// four rectangles that share the foot of the perpendicular).
double OfSquare(double radiance, double side_m, double distance_m) {
  const double x = 0.5 * side_m / distance_m, root = std::sqrt(1 + x * x);
  return 4 * radiance * (x / root) * std::atan(x / root);
}

TEST(LampIrradiance, IsTheClosedFormOfASquare) {
  hal::sim::SquareOptions square;
  square.side_m = 0.1;
  square.radiance = 700;
  const auto lamp = hal::sim::MakeSquare(square);
  std::vector<Receiver> receivers;
  for (const double z : {0.1, 0.3, 2.0}) receivers.push_back({{0, 0, z}, {0, 0, -1}});
  const auto found = LampIrradiance(*lamp, kDelta_m, {-0.05, 0.05, -0.05, 0.05}, receivers, 400);
  for (std::size_t k = 0; k < receivers.size(); ++k) {
    const double right = OfSquare(700, 0.1, receivers[k].p.z);
    EXPECT_NEAR(found[k], right, 1e-5 * right);  // midpoints of a smooth integrand: 1 / 400^2
  }
}

// Texels that blend into each other, so that the lattice is not what errors come from.
LightField SmoothField(const PlannedFilters& filters) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = kDelta_m;
  geometry.grid = filters.grid;
  geometry.lattice = filters.lattice;
  LightField field(geometry);
  for (int m = 0; m < geometry.grid.count(); ++m) {
    auto image = field.image(m, 0);
    for (std::size_t t = 0; t < image.size(); ++t) {
      const auto s = geometry.lattice.centre(static_cast<int>(t) / geometry.lattice.width,
                                             static_cast<int>(t) % geometry.lattice.width);
      image[t] = static_cast<float>(1e5 * (1 + 0.5 * ((m * 7) % 5)) *
                                    std::exp(-30 * ((s.x - 0.02) * (s.x - 0.02) + s.y * s.y)));
    }
  }
  return field;
}

PlannedFilters Filters(BasisKind kind, bool dual) {
  return {dual,
          lightfield::BasisGrid::Centred(Basis::Make(kind), 4, 3, kSpacing_m),
          {24, 20, -0.24, 0.2, 0.02, 0.02}};
}

std::vector<Receiver> Receivers() {
  std::vector<Receiver> receivers;
  core::Random random(5, 0);
  for (int k = 0; k < 40; ++k)
    receivers.push_back(
        {{0.4 * random.Uniform() - 0.2, 0.4 * random.Uniform() - 0.2, 0.6 + random.Uniform()},
         lightfield::Normalized(Vec3{0.4 * random.Uniform() - 0.2, 0.3 * random.Uniform(), -1})});
  receivers.push_back({{0, 0, 1}, {0, 0, 1}});  // faces away
  return receivers;
}

struct Case {
  BasisKind kind;
  bool dual;
};
class PlannedFiltersTest : public testing::TestWithParam<Case> {};

// A lamp in the span of the filters' own basis comes back from their images; noise in the images
// spreads the receivers' irradiances as foretold. Both through reconstruct and the closed form,
// which the prediction does not call.
TEST_P(PlannedFiltersTest, TruncationAndNoiseAreThoseOfTheReconstruction) {
  const auto [kind, dual] = GetParam();
  const PlannedFilters filters = Filters(kind, dual);
  const LightField field = SmoothField(filters);
  const auto lamp = hal::sim::MakeLightFieldLamp(field);
  const auto& grid = filters.grid;
  const double half_u = 0.5 * (grid.width + grid.basis.cells - 1) * kSpacing_m,
               half_v = 0.5 * (grid.height + grid.basis.cells - 1) * kSpacing_m;
  const auto sampled = [&](int cells_per_spacing) {
    return FilterImages(
        SampleLamp(*lamp, kDelta_m, {-half_u, half_u, -half_v, half_v},
                   cells_per_spacing * (grid.width + grid.basis.cells - 1), filters.lattice),
        filters);
  };
  const auto images = sampled(24);
  const auto receivers = Receivers();
  std::vector<double> truth;
  double mean = 0;
  for (const Receiver& r : receivers) {
    truth.push_back(lightfield::ExactIrradiance(field, r.p, r.n)[0]);
    mean += truth.back() / static_cast<double>(receivers.size());
  }
  const FilterJudgement judgement = Judge(images, filters, kDelta_m, receivers, truth);
  // What is left is that the samples are constant in cells: of second order.
  const double coarse = Judge(sampled(12), filters, kDelta_m, receivers, truth).truncation.value;
  EXPECT_LT(judgement.truncation.value, 2.5e-3);
  EXPECT_NEAR(judgement.truncation.value / coarse, 0.25, 0.05);

  lightfield::Measurements measurements;
  measurements.geometry = field.geometry;
  measurements.filter = dual ? lightfield::FilterKind::kDual : lightfield::FilterKind::kBasis;
  const std::size_t texels = field.geometry.plane_size();
  const auto factors = filters.print_factors();
  const auto irradiance = [&](std::size_t k) {
    double e = 0;
    for (std::size_t print = 0; print < images.size(); ++print)
      e += factors[print] * images[print][k];
    return e;
  };
  for (int m = 0; m < grid.count(); ++m) {
    auto& position = measurements.positions.emplace_back();
    for (std::size_t t = 0; t < texels; ++t)
      position.irradiance.push_back(static_cast<float>(irradiance(m * texels + t)));
    position.sigma.assign(texels, 1);
    position.count.assign(texels, 1);
    position.mask.assign(texels, 0);
  }
  const auto error = [&](const lightfield::Measurements& of) {
    const auto c = reconstruct::Reconstruct(of).coefficients;
    double square = 0;
    for (std::size_t r = 0; r < receivers.size(); ++r) {
      const double e = lightfield::ExactIrradiance(c, receivers[r].p, receivers[r].n)[0] - truth[r];
      square += e * e / static_cast<double>(receivers.size());
    }
    return std::sqrt(square) / mean;
  };
  EXPECT_NEAR(error(measurements), judgement.truncation.value,
              1e-5 + 0.01 * judgement.truncation.value);

  // Noise of 2 % of the mean image, far above the truncation.
  double level = 0, weight = 0;
  for (std::size_t k = 0; k < texels * grid.count(); ++k)
    level += irradiance(k) / static_cast<double>(texels * grid.count());
  const double sigma = 0.02 * level;
  for (const float w : judgement.noise_weight) weight += w;
  const double predicted = std::hypot(sigma * std::sqrt(weight), judgement.truncation.value);
  constexpr int kRuns = 40;
  double square = 0, fourth = 0;
  for (int run = 0; run < kRuns; ++run) {
    auto noisy = measurements;
    for (int m = 0; m < grid.count(); ++m) {
      core::Random random(20261122, static_cast<std::uint64_t>(run * grid.count() + m));
      for (float& e : noisy.positions[m].irradiance)
        e += static_cast<float>(sigma * random.Normal());
    }
    const double e = error(noisy);
    square += e * e / kRuns;
    fourth += e * e * e * e / kRuns;
  }
  const double se = std::sqrt((fourth - square * square) / (kRuns - 1));
  std::printf("predicted %.5f, observed %.5f +- %.5f\n", predicted, std::sqrt(square),
              se / (2 * std::sqrt(square)));
  EXPECT_NEAR(square, predicted * predicted, 4 * se);
}

INSTANTIATE_TEST_SUITE_P(
    Families, PlannedFiltersTest,
    testing::Values(Case{BasisKind::kBilinear, false}, Case{BasisKind::kQuadratic, false},
                    Case{BasisKind::kBspline2, false}, Case{BasisKind::kBilinear, true},
                    Case{BasisKind::kQuadratic, true}),
    [](const auto& test) {
      return Basis::Make(test.param.kind).name() + (test.param.dual ? "Dual" : "");
    });

// The spread of merged exposures of one level, by the estimator that merges them.
TEST(PixelNoise, IsTheSpreadOfMergedExposures) {
  PixelNoise noise;
  noise.camera.black_dn = 200;
  noise.camera.saturation_dn = 4000;
  noise.camera.gain_dn_per_e = 0.4;
  noise.camera.read_noise_dn = 3;
  noise.camera.dark_current_e_per_s = 50;
  noise.electrons_per_irradiance = 800;
  noise.darks = 4;
  const std::vector<double> ladder{0.01, 0.04, 0.16, 0.64};
  constexpr int kPixels = 40000, kRepeats = 2;
  rig::SensorModel sensor;
  sensor.width = kPixels;
  sensor.height = 1;
  sensor.bits = 12;
  sensor.gain_dn_per_e = 0.4;
  sensor.read_noise_dn = 3;
  sensor.black_dn = 200;
  sensor.saturation_dn = 4000;
  sensor.dark_current_e_per_s = 50;
  const auto frame = [&](double electrons_per_s, double exposure_s, std::uint64_t stream) {
    session::RawFrame raw;
    raw.width = kPixels;
    raw.height = 1;
    for (int k = 0; k < kPixels; ++k) {
      core::Random random(77, stream, static_cast<std::uint32_t>(k));
      const double e = random.Poisson(exposure_s * (electrons_per_s + 50));
      const double dn = std::min(200 + 0.4 * e + 3 * random.Normal(), 4000.0);
      raw.dn.push_back(static_cast<std::uint16_t>(std::floor(std::max(0.0, dn) + 0.5)));
    }
    return raw;
  };
  for (const double irradiance : {0.05, 2.0, 100.0}) {
    const capture::Rungs bracket{irradiance > 50 ? 0 : 1, 3};
    std::vector<session::RawFrame> frames;
    std::vector<reconstruct::DarkFrame> darks;
    std::vector<double> times;
    std::uint64_t stream = 0;
    for (int rung = bracket.first; rung <= bracket.last; ++rung) {
      std::vector<session::RawFrame> dark;
      for (int k = 0; k < noise.darks; ++k) dark.push_back(frame(0, ladder[rung], ++stream));
      darks.push_back(reconstruct::AverageDarks(dark, ladder[rung]));
      for (int repeat = 0; repeat < kRepeats; ++repeat) {
        frames.push_back(frame(800 * irradiance, ladder[rung], ++stream));
        times.push_back(ladder[rung]);
      }
    }
    std::vector<reconstruct::Exposure> exposures;
    for (std::size_t k = 0; k < frames.size(); ++k)
      exposures.push_back({&frames[k], times[k], 1, 1, &darks[k / kRepeats]});
    const auto merged = reconstruct::MergeExposures(sensor, exposures);
    double mean = 0, square = 0;
    for (const float x : merged.rate_e_per_s) mean += x / 800.0 / kPixels;
    for (const float x : merged.rate_e_per_s)
      square += (x / 800.0 - mean) * (x / 800.0 - mean) / (kPixels - 1);
    const double variance = noise.Variance(irradiance, ladder, bracket, kRepeats);
    // The merge takes the dark level of both repeats as their own: weights a little off the best.
    EXPECT_NEAR(square / variance, 1, 5 * std::sqrt(2.0 / kPixels) + 0.01) << irradiance;
  }
  EXPECT_TRUE(std::isinf(noise.Variance(1e6, ladder, {0, 3}, 1))) << "saturated in all of them";
}

TEST(ExposureChoices, KeepToTheCameraAndThePeriod) {
  hal::CameraCapabilities camera;
  camera.min_exposure_s = 1e-4;
  camera.max_exposure_s = 10;
  camera.exposure_step_s = 1e-5;
  double longest = 0;
  for (const auto& choice : ExposureChoices(0.01234, 4, camera, 1e-3)) {
    EXPECT_GE(choice.min_s, 1e-3);
    EXPECT_LE(choice.min_s, 0.012 * (1 + 1e-12));
    EXPECT_LE(choice.max_s, 10);
    longest = std::max(longest, choice.max_s);
  }
  EXPECT_GT(longest, 2);
  camera.min_exposure_s = 20;
  EXPECT_TRUE(ExposureChoices(0.01, 4, camera, 0).empty());
}

}  // namespace
}  // namespace luxfield::planning
