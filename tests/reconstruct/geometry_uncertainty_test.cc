#include "luxfield/reconstruct/budget/geometry_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <iostream>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_calibration_file.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_figures.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

constexpr std::uint64_t kSeed = 711;
constexpr int kWidth = 480, kHeight = 400;

GeometryState State(bool reflector, double side) {
  GeometryState state;
  state.has_lens = reflector;
  state.side = side;
  state.pitch_m = {1e-3, -1e-3};
  state.lens = {600, 610, 240, 200, -0.1, 0.02, 1e-3, -2e-3};
  if (reflector) state.boards[0] = {0.2, -0.15, 0.1, -0.1, 0.05, 0.8};
  state.plane = {0.003, -0.002, 0.1};
  state.filter = {0.3, 1e-3, -2e-3};
  state.stage = {1.001, 0.002, 0.003, -0.001, 0.999, 0.004};
  return state;
}

// Errors of all unknowns, each about 1e-4 of its size or of a unit, correlated at random.
Eigen::MatrixXd Covariance(GeometryState& state) {
  std::vector<double> scale;
  for (const auto& [block, size] : state.Blocks())
    for (int k = 0; k < size; ++k) scale.push_back(1e-4 * std::max(1.0, std::abs(block[k])));
  const auto count = static_cast<Eigen::Index>(scale.size());
  core::Random random(kSeed, 0);
  Eigen::MatrixXd mix(count, count);
  for (Eigen::Index k = 0; k < mix.size(); ++k) mix.data()[k] = random.Normal();
  const Eigen::MatrixXd root =
      Eigen::Map<const Eigen::VectorXd>(scale.data(), count).asDiagonal() * mix / std::sqrt(count);
  return root * root.transpose();
}

// Index of an unknown among all.
Eigen::Index IndexOf(GeometryState& state, const double* unknown) {
  Eigen::Index index = 0;
  for (const auto& [block, size] : state.Blocks())
    for (int k = 0; k < size; ++k, ++index)
      if (block + k == unknown) return index;
  return -1;
}

// The unknowns of the fit, moved by their covariance, are one judge; the file with its figures, in
// other coordinates, is what is judged.
void AgreesWithTheFit(bool reflector, double side) {
  GeometryState state = State(reflector, side);
  const Eigen::MatrixXd covariance = Covariance(state);
  GeometryCalibration calibration;
  Geometry& g = calibration.geometry;
  g.width = kWidth;
  g.height = kHeight;
  FillFigures(state, covariance, g);
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield_uncertainty.cal.json";
  WriteGeometryCalibration(file, calibration);
  const GeometryUncertainty uncertainty(file);

  const auto place_of = [&](Vec2 pixel) {
    const Vec2 p = g.lens ? g.lens->Straight(pixel) : pixel;
    return g.image_from_sensor.Map(p);
  };
  const double x = kWidth, y = kHeight;
  const Vec2 pixels[5] = {{0, 0}, {x, 0}, {x, y}, {0, y}, {0.5 * x, 0.5 * y}};
  // Differences on both sides err by the square of a hundredth and a tenth of sigma.
  constexpr double kTolerance = 1e-4;
  for (int n = 0; n < 5; ++n) {
    const Vec2 q = place_of(pixels[n]);
    if (reflector) {
      const Vec2 again = uncertainty.PlaceOf(pixels[n]);
      EXPECT_NEAR(std::hypot(again.x - q.x, again.y - q.y), 0, 1e-9);
    }
    double ss = 0, tt = 0;
    for (const GeometryDirection& direction : uncertainty.directions()) {
      const Vec2 off = uncertainty.PlaceError(direction, q);
      ss += off.x * off.x;
      tt += off.y * off.y;
    }
    EXPECT_NEAR(std::sqrt(ss) / g.place_sigma_m[n].x, 1, kTolerance) << "place " << n;
    EXPECT_NEAR(std::sqrt(tt) / g.place_sigma_m[n].y, 1, kTolerance) << "place " << n;
  }
  const auto expect_variance = [&](const double* unknown, auto&& of) {
    double variance = 0;
    for (const GeometryDirection& direction : uncertainty.directions())
      variance += of(direction) * of(direction);
    const Eigen::Index k = IndexOf(state, unknown);
    EXPECT_NEAR(variance / covariance(k, k), 1, kTolerance);
  };
  expect_variance(&state.filter[0], [](const auto& d) { return d.delta_m; });
  expect_variance(&state.stage[0], [](const auto& d) { return d.stage_axes[0].x; });
  expect_variance(&state.stage[1], [](const auto& d) { return d.stage_axes[0].y; });
  expect_variance(&state.stage[3], [](const auto& d) { return d.stage_axes[1].x; });
  expect_variance(&state.stage[4], [](const auto& d) { return d.stage_axes[1].y; });
}

TEST(GeometryUncertainty, AgreesWithTheFitOfReflectorRigs) {
  std::cout << "seed " << kSeed << '\n';
  AgreesWithTheFit(true, 1);
  AgreesWithTheFit(true, -1);
}

TEST(GeometryUncertainty, AgreesWithTheFitOfLenslessRigs) { AgreesWithTheFit(false, 1); }

TEST(GeometryUncertainty, NamesWhatTheFileLacks) {
  GeometryState state = State(false, 1);
  GeometryCalibration calibration;
  calibration.geometry.width = kWidth;
  calibration.geometry.height = kHeight;
  FillFigures(state, Covariance(state), calibration.geometry);
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield_uncertainty.cal.json";
  const auto refuses = [&](const char* what, auto&& change) {
    core::Json json = ToJson(calibration);
    change(json);
    core::WriteJson(file, json);
    try {
      GeometryUncertainty{file};
      ADD_FAILURE() << what;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  refuses("lack 'delta'", [](core::Json& j) { j["parameters"][3]["name"] = "gamma"; });
  refuses("covariance has 1 entries", [](core::Json& j) { j["covariance"] = {1.0}; });
}

}  // namespace
}  // namespace luxfield::reconstruct
