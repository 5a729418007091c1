// Simulated labs with random geometry, captured and calibrated as a lab would do it, against where
// their parts really stand. LUXFIELD_LABS=100 runs the proof: chi^2 over 100 labs of each rig.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <numbers>

#include "luxfield/capture/take/capture_geometry.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/hal/sim/targets.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_calibration_file.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "tests/core/chi_squared.h"
#include "tests/physics/geometry_lab.h"

namespace luxfield {
namespace {

namespace fs = std::filesystem;
using hal::sim::LabDescription;
using hal::sim::Transposed;
using hal::sim::operator*;
using lightfield::Vec2;
using lightfield::Vec3;
using reconstruct::GeometryCalibration;

GeometryCalibration CaptureAndCalibrate(const std::string& lab_toml, double step_m,
                                        int poses = 10) {
  const fs::path folder = fs::path(testing::TempDir()) / "luxfield_geometry_chain";
  fs::remove_all(folder);
  const hal::sim::SimulatedLab lab(core::Config::FromString(lab_toml, "lab.toml"));
  hal::Devices devices = lab.MakeDevices();
  const auto plan = capture::ReadGeometryPlan(core::Config::FromString(
      fmt::format("[plan]\nkind = \"geometry\"\nposes = {}\n[stage]\nstep_m = "
                  "{}\n[exposure]\nmin_s = 0.1\nmax_s = 4\n",
                  poses, step_m),
      "plan"));
  capture::RunGeometryCapture(plan, devices, folder);
  const session::SessionReader session(folder);
  EXPECT_TRUE(capture::VerifySession(folder).problems.empty());
  GeometryCalibration calibration = reconstruct::CalibrateGeometry(session);
  fs::remove_all(folder);
  return calibration;
}

// What calibration has to find, by the names it gives.
std::map<std::string, double> Truth(const LabDescription& lab) {
  const hal::sim::BenchGeometry& g = lab.geometry;
  std::map<std::string, double> truth;
  if (g.camera) {
    const auto& [lens, rotation, translation] = *g.camera;
    truth = {{"focal_x", lens.focal_px.x},   {"focal_y", lens.focal_px.y},
             {"centre_x", lens.centre_px.x}, {"centre_y", lens.centre_px.y},
             {"k1", lens.distortion[0]},     {"k2", lens.distortion[1]},
             {"p1", lens.distortion[2]},     {"p2", lens.distortion[3]}};
    const Vec3 at = -1.0 * (Transposed(rotation) * translation);
    truth["camera_s"] = at.x;
    truth["camera_t"] = at.y;
    truth["camera_z"] = at.z;
    const double side = at.z < 0 ? 1 : -1;  // a camera on the lamp's side looks along the light
    const auto m = rotation * hal::sim::Rotation{-side, 0, 0, 0, -1, 0, 0, 0, side};
    truth["camera_pan"] = std::atan2(-m[6], m[8]);
    truth["camera_tilt"] = std::asin(m[7]);
    truth["camera_roll"] = std::atan2(-m[1], m[4]);
  } else {
    const Vec2 middle =
        g.ImageFromSensor(0.5 * lab.camera.sensor.width, 0.5 * lab.camera.sensor.height);
    truth["sensor_s"] = middle.x;
    truth["sensor_t"] = middle.y;
    truth["sensor_turn"] = std::atan2(g.image_from_sensor(1, 0), g.image_from_sensor(0, 0));
  }
  truth["delta"] = g.delta_m;
  truth["filter_tilt_s"] = g.filter_tilt_rad.x;
  truth["filter_tilt_t"] = g.filter_tilt_rad.y;
  const auto& [u, v] = g.stage_axes;
  truth["stage_scale_u"] = std::hypot(u.x, u.y);
  truth["stage_scale_v"] = std::hypot(v.x, v.y);
  truth["stage_turn"] = std::atan2(u.y, u.x);
  truth["stage_skew"] = std::atan2(-v.x, v.y) - std::atan2(u.y, u.x);
  truth["stage_slope_u"] = u.z;
  truth["stage_slope_v"] = v.z;
  return truth;
}

struct Pool {
  double square = 0, distance = 0;  // sum of z^2, and of d^T C^-1 d, which knows correlations
  int parameters = 0, labs = 0;
  std::map<std::string, double> by_name;
};

void Judge(const GeometryCalibration& calibration, const LabDescription& lab, Pool& pool) {
  const auto truth = Truth(lab);
  const auto& parameters = calibration.geometry.parameters;
  const auto count = static_cast<Eigen::Index>(parameters.size());
  ASSERT_EQ(parameters.size(), truth.size());
  Eigen::VectorXd z(count), sigma(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    sigma[k] = parameters[k].sigma;
    z[k] = (parameters[k].value - truth.at(parameters[k].name)) / sigma[k];
    EXPECT_LT(std::abs(z[k]), 5) << lab.name << ", " << parameters[k].name;
    pool.by_name[parameters[k].name] += z[k] * z[k];
  }
  const Eigen::MatrixXd correlation =
      sigma.cwiseInverse().asDiagonal() *
      Eigen::Map<const Eigen::MatrixXd>(calibration.geometry.covariance.data(), count, count) *
      sigma.cwiseInverse().asDiagonal();
  pool.square += z.squaredNorm();
  pool.distance += z.dot(correlation.ldlt().solve(z));
  pool.parameters += static_cast<int>(count);
  ++pool.labs;
}

int Labs(int of_suite) {
  const char* text = std::getenv("LUXFIELD_LABS");
  return text ? std::max(1, std::atoi(text)) : of_suite;
}

void RecoverBenches(bool reflector, bool mosaic, int of_suite) {
  const int labs = Labs(of_suite);
  Pool pool;
  double board_factor = 0, mask_factor = 0, board_px = 0, mask_px = 0;
  for (int seed = 1; seed <= labs; ++seed) {
    const std::string bench = RandomBench(reflector, seed),
                      toml = mosaic ? WithMosaic(bench) : bench;
    const GeometryCalibration calibration = CaptureAndCalibrate(toml, reflector ? 0.04 : 0.02);
    EXPECT_TRUE(calibration.not_found.empty()) << seed;
    Judge(calibration, DescribeBench(toml), pool);
    board_factor += calibration.geometry.boards.factor / labs;
    mask_factor += calibration.geometry.masks.factor / labs;
    board_px += calibration.geometry.boards.rms_px / labs;
    mask_px += calibration.geometry.masks.rms_px / labs;
  }
  for (const auto& [name, square] : pool.by_name)
    std::cout << fmt::format("  {:<14} z^2 {:.3f}\n", name, square / pool.labs);
  const double per_degree = pool.distance / pool.parameters;
  std::cout << fmt::format(
      "{} rig{}, {} labs (seeds 1 to {}): chi^2 per degree of freedom {:.4f} of {} parameters with "
      "their correlations, {:.4f} one by one; residuals {:.5f} px (board, factor {:.3f}), {:.5f} "
      "px "
      "(mask, factor {:.3f})\n",
      reflector ? "reflector" : "lensless", mosaic ? " with a colour mosaic" : "", labs, labs,
      per_degree, pool.parameters, pool.square / pool.parameters, board_px, board_factor, mask_px,
      mask_factor);
  // 100 labs: bounds of 3 to 4 standard errors. A sample: its own chances.
  const bool proof = labs >= 100;
  EXPECT_GT(per_degree, proof ? 0.9 : ChiSquaredShare(pool.parameters, -kRareZ));
  EXPECT_LT(per_degree, proof ? 1.1 : ChiSquaredShare(pool.parameters, kRareZ));
}

// Detection without noise, against where the corners really are: what is left is bias, of the
// detection and of the drawing. Returns its rms in pixels with edges straightened.
double BiasOfCorners(bool mosaic) {
  double rough = 0, fine = 0;
  lightfield::Vec2 mean;
  int count = 0;
  constexpr int kLabs = 2, kBoards = 4;
  for (int seed = 1; seed <= kLabs; ++seed) {
    const std::string bench = RandomBench(true, seed);
    LabDescription lab = DescribeBench(mosaic ? WithMosaic(bench) : bench);
    lab.camera.sensor.bits = 32;
    lab.camera.sensor.photon_noise = false;
    lab.camera.sensor.read_noise_dn = lab.camera.sensor.prnu = 0;
    const hal::sim::Sensor sensor(lab.camera.sensor, lab.seed);
    for (int board = 0; board < kBoards; ++board) {
      const auto image = reconstruct::MakeSignalImage(
          sensor.Expose(hal::sim::PictureOfTarget(lab, {board + 1, {}, {}}), 1, 0, 1, 1),
          lab.camera.sensor);
      const auto found = reconstruct::FindChessboard(image, *lab.targets->board, false);
      const auto refined = reconstruct::RefineCorners(image, found, lab.geometry.camera->lens);
      EXPECT_EQ(found.size(), 70u);
      EXPECT_EQ(refined.size(), 70u);
      const auto pose = hal::sim::PoseOfBoard(lab, board);
      for (std::size_t k = 0; k < std::min(found.size(), refined.size()); ++k) {
        const double pitch_m = lab.targets->board->pitch_m;
        const Vec3 x =
            pose.rotation * Vec3{found[k].i * pitch_m, found[k].j * pitch_m, 0} + pose.translation;
        const Vec2 there = lab.geometry.camera->lens.PixelOf({x.x / x.z, x.y / x.z});
        const Vec2 off = found[k].at - there, better = refined[k].at - there;
        rough += off.x * off.x + off.y * off.y;
        fine += better.x * better.x + better.y * better.y;
        mean = mean + better;
        ++count;
      }
    }
  }
  rough = std::sqrt(rough / (2 * count));
  fine = std::sqrt(fine / (2 * count));
  std::cout << fmt::format(
      "bias of {} corners: {:.6f} px rms, with edges straightened {:.6f} px rms, mean ({:+.6f}, "
      "{:+.6f}) px\n",
      count, rough, fine, mean.x / count, mean.y / count);
  // Of random sign from corner to corner: it averages out.
  EXPECT_LT(std::hypot(mean.x, mean.y) / count, 4 * fine / std::sqrt(count));
  return fine;
}

// An eighth of the noise of 4.5e-3 px: the pixel's square counts as part of a Gaussian spread.
TEST(GeometryCalibrationChain, CornersHaveNoBias) { EXPECT_LT(BiasOfCorners(false), 6.5e-4); }

// The same of the noise that half the pixels leave, 6.4e-3 px.
TEST(GeometryCalibrationChain, CornersOfAMosaicHaveNoBias) {
  EXPECT_LT(BiasOfCorners(true), 6.5e-4 * std::numbers::sqrt2);
}

// An even lamp: E falls off about the filter's axis, a centimetre from where the bench says it is.
TEST(GeometryCalibrationChain, MergeFindsTheLightOfABenchThatStatesItselfWrongly) {
  std::string toml = RandomBench(true, 3);
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(toml.find(from), std::string::npos) << from;
    toml.replace(toml.find(from), from.size(), to);
  };
  replace("side_m = 0.1\n", "side_m = 0.3\n");
  const GeometryCalibration calibration = CaptureAndCalibrate(toml, 0.04, 5);
  const fs::path file = fs::path(testing::TempDir()) / "luxfield_bench.cal.json",
                 folder = fs::path(testing::TempDir()) / "luxfield_bench_light";
  reconstruct::WriteGeometryCalibration(file, calibration);

  const LabDescription description = DescribeBench(toml);
  const hal::sim::SimulatedLab lab(core::Config::FromString(toml, "lab.toml"));
  hal::Devices devices = lab.MakeDevices();
  const auto plan = capture::ReadPlan(core::Config::FromString(
      fmt::format(
          "[plan]\nunit = \"W\"\ndark_repeats = 1\n[rig]\nkind = \"reflector\"\nalbedo = 0.9\n"
          "delta_m = {}\n[filter]\nspacing_m = 0.033\n[grid]\nwidth = 2\n"
          "height = 2\n[lattice]\nwidth = 24\nheight = 24\nds_m = 0.006\n[exposure]\n"
          "min_s = 0.01\nmax_s = 10\n[reference]\nevery = 0\n[warm_up]\nwindow_s = 10\n",
          description.stated.delta_m),
      "plan"));
  fs::remove_all(folder);
  capture::RunCapture(plan, devices, folder);
  const session::SessionReader session(folder);
  auto geometry = plan.geometry;
  geometry.delta_m = description.geometry.delta_m;
  const auto truth = lab.true_irradiance(geometry);
  const auto error = [&](const std::vector<fs::path>& calibrations) {
    reconstruct::MergeSessionOptions options;
    options.calibrations = calibrations;
    options.lamp_level = reconstruct::LampLevel::kFirstReference;
    const auto measured = reconstruct::MergeSession(session, options);
    double off = 0, all = 0;
    for (std::size_t m = 0; m < truth.size(); ++m)
      for (std::size_t k = 0; k < truth[m].size(); ++k) {
        if (measured.positions[m].mask[k] & lightfield::kUnknownMask) continue;
        off += std::pow(measured.positions[m].irradiance[k] - truth[m][k], 2);
        all += std::pow(truth[m][k], 2);
      }
    if (!calibrations.empty()) {
      const Vec2 planned = plan.geometry.grid.centre(1, 0),
                 moved = measured.positions[1].displacement_m,
                 there = description.geometry.FilterCentre(planned) - planned;
      EXPECT_NEAR(std::hypot(moved.x - there.x, moved.y - there.y), 0, 1e-5);
      EXPECT_NEAR(measured.geometry.delta_m, geometry.delta_m, 1e-4);
      EXPECT_EQ(measured.provenance.count("geometry_calibration"), 1u);
    }
    return std::sqrt(off / all);
  };
  const double stated = error({}), calibrated = error({file});
  std::cout << fmt::format("relative RMSE of E: {:.4f} as stated, {:.5f} as calibrated\n", stated,
                           calibrated);
  EXPECT_GT(stated, 0.008);
  EXPECT_LT(calibrated, 0.004);
  fs::remove_all(folder);
}

TEST(GeometryCalibrationChain, FindsReflectorBenches) { RecoverBenches(true, false, 1); }
TEST(GeometryCalibrationChain, FindsLenslessBenches) { RecoverBenches(false, false, 3); }
TEST(GeometryCalibrationChain, FindsReflectorBenchesOfAMosaic) { RecoverBenches(true, true, 1); }
TEST(GeometryCalibrationChain, FindsLenslessBenchesOfAMosaic) { RecoverBenches(false, true, 3); }

}  // namespace
}  // namespace luxfield
