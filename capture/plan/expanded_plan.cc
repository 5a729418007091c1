#include "luxfield/capture/plan/expanded_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "luxfield/capture/plan/capture_time.h"
#include "luxfield/capture/plan/stage_reach.h"
#include "luxfield/core/error.h"
#include "luxfield/core/random.h"

namespace luxfield::capture {
namespace {

void RequireSame(const Plan& plan, const rig::RigDescription& rig) {
  const auto fail = [&](const char* field, const std::string& planned, const std::string& found) {
    throw InputError(fmt::format("plan \"{}\"", plan.name),
                     fmt::format("{} = {}, but the lab has {}", field, planned, found),
                     "correct the plan or use the lab it was made for");
  };
  const auto number = [&](const char* field, double planned, double found) {
    if (std::abs(planned - found) > 1e-9 * std::abs(found))
      fail(field, fmt::format("{}", planned), fmt::format("{}", found));
  };
  if (plan.rig != rig.kind)
    fail("rig.kind", rig::RigKindName(plan.rig), rig::RigKindName(rig.kind));
  number("rig.delta_m", plan.geometry.delta_m, rig.delta_m);
  if (plan.rig == rig::RigKind::kReflector) number("rig.albedo", plan.albedo, rig.albedo);
  if (plan.dual != rig.dual)
    fail("filter.kind", plan.dual ? "dual" : "basis", rig.dual ? "dual" : "basis");
  const auto& basis = plan.geometry.grid.basis;
  if (!(basis == rig.basis))
    fail("filter.basis", fmt::format("{} (a = {})", basis.name(), basis.a),
         fmt::format("{} (a = {})", rig.basis.name(), rig.basis.a));
  number("filter.spacing_m", plan.geometry.grid.spacing_m, rig.spacing_m);
  number("filter.scale", plan.filter_scale, rig.filter_scale);
  const auto channels = static_cast<int>(rig.camera.responsivity_e_per_s_per_w_m2.size());
  if (plan.geometry.channels != channels)
    fail("plan.channels", std::to_string(plan.geometry.channels), std::to_string(channels));
}

std::vector<PlannedPosition> Positions(const Plan& plan) {
  const auto& grid = plan.geometry.grid;
  std::vector<PlannedPosition> positions;
  for (int j = 0; j < grid.height; ++j)
    for (int k = 0; k < grid.width; ++k) {
      const int i = j % 2 == 0 ? k : grid.width - 1 - k;  // serpentine: no long way back
      positions.push_back({i, j, grid.centre(i, j)});
    }
  if (plan.order == Order::kRandom) {
    core::Random random(plan.order_seed, 0);
    for (std::size_t n = positions.size(); n > 1; --n)  // Fisher-Yates
      std::swap(positions[n - 1],
                positions[static_cast<std::size_t>(random.Uniform() * static_cast<double>(n))]);
  }
  return positions;
}

// Of the times that the camera has, the nearest by ratio; beyond them the time itself.
double Available(double exposure_s, const hal::CameraCapabilities& camera) {
  const auto& list = camera.exposures_s;
  constexpr double kBeyond = 1.2;
  if (list.empty() || exposure_s < list.front() / kBeyond || exposure_s > list.back() * kBeyond)
    return exposure_s;
  return *std::min_element(list.begin(), list.end(), [exposure_s](double a, double b) {
    return std::abs(std::log(a / exposure_s)) < std::abs(std::log(b / exposure_s));
  });
}

}  // namespace

double PwmHz(const ExposurePolicy& exposure, const rig::RigDescription& rig) {
  return exposure.measure_pwm || exposure.pwm_hz > 0 ? exposure.pwm_hz : rig.pwm_hz;
}

std::vector<double> MakeLadder(double min_s, double max_s, double ratio, double pwm_hz,
                               const hal::CameraCapabilities& camera, const std::string& name) {
  const std::string plan = fmt::format("plan \"{}\"", name);
  if (pwm_hz > 0 && !camera.exposures_s.empty())
    throw InputError(
        plan,
        fmt::format("pulses at {} Hz need exposures of whole periods, the camera has a "
                    "list of shutter speeds",
                    pwm_hz),
        "drive the lamp with direct current and leave pwm_hz out");
  std::vector<double> ladder;
  // Counted in whole steps, so that rounding cannot lose the last rung.
  const double steps = std::log(max_s / min_s) / std::log(ratio);
  for (int step = 0; step <= steps + 1e-9; ++step) {
    const double t = min_s * std::pow(ratio, step);
    // A whole number of PWM periods has no beat; at least one.
    const double snapped =
        pwm_hz > 0 ? std::max(1.0, std::round(t * pwm_hz)) / pwm_hz : Available(t, camera);
    if (ladder.empty() || snapped > ladder.back() * 1.05) ladder.push_back(snapped);
  }
  if (ladder.front() < camera.min_exposure_s)
    throw InputError(plan,
                     fmt::format("exposure.min_s gives {} s, the camera starts at {} s",
                                 ladder.front(), camera.min_exposure_s),
                     "raise it");
  if (ladder.back() > camera.max_exposure_s)
    throw InputError(plan,
                     fmt::format("exposure.max_s gives {} s, the camera ends at {} s",
                                 ladder.back(), camera.max_exposure_s),
                     "lower it");
  return ladder;
}

ExpandedPlan ExpandPlan(const Plan& plan, const hal::Devices& devices) {
  RequireSame(plan, devices.rig);
  ExpandedPlan expanded;
  expanded.plan = plan;
  const ExposurePolicy& e = plan.exposure;
  const hal::CameraCapabilities camera = devices.camera->capabilities();
  if (e.measure_pwm && !camera.exposures_s.empty())
    throw InputError(
        fmt::format("plan \"{}\"", plan.name),
        "exposure.pwm_hz = \"measure\" needs exposures of any length, the camera has a "
        "list of shutter speeds",
        "drive the lamp with direct current and leave pwm_hz out");
  expanded.ladder_s =
      MakeLadder(e.min_s, e.max_s, e.ratio, PwmHz(e, devices.rig), camera, plan.name);
  expanded.positions = Positions(plan);
  const auto& grid = plan.geometry.grid;
  expanded.reference = grid.centre(grid.width / 2, grid.height / 2);
  expanded.prints = plan.dual ? 2 : 1;
  expanded.channels_in_turn = devices.rig.camera.cfa.empty() ? plan.geometry.channels : 1;
  const StageReach reach(plan.name, plan.stage, *devices.stage);
  for (const PlannedPosition& p : expanded.positions)
    reach.Require(p.centre,
                  fmt::format("grid position ({}, {}) at ({:.6g}, {:.6g}) m", p.i, p.j, p.centre.x,
                              p.centre.y),
                  "choose a smaller grid, or another stage or limits");
  return expanded;
}

session::PlanFile ToPlanFile(const ExpandedPlan& e) {
  const Plan& plan = e.plan;
  const ExposurePolicy& x = plan.exposure;
  session::PlannedExposures exposure;
  exposure.ladder_s = e.ladder_s;
  exposure.saturation_share = x.saturation_share;
  exposure.relevant_share = x.relevant_share;
  exposure.floor_sigmas = x.floor_sigmas;
  exposure.repeats = x.repeats;
  exposure.max_attempts = x.max_attempts;
  exposure.mean_tolerance = x.mean_tolerance;
  exposure.flicker = x.flicker;
  if (x.measure_pwm) exposure.pwm_hz = x.pwm_hz;
  session::PlanFile file;
  file.name = plan.name;
  file.geometry = plan.geometry;
  file.filter = {plan.dual ? lightfield::FilterKind::kDual : lightfield::FilterKind::kBasis,
                 plan.filter_scale};
  file.rig = {plan.rig, plan.albedo};
  file.exposure = std::move(exposure);
  file.reference = {plan.reference, e.reference};
  file.warm_up = plan.warm_up;
  file.dark_repeats = plan.dark_repeats;
  file.positions = e.positions;
  if (plan.stage.min || plan.stage.max || plan.stage.speed_m_per_s)
    file.stage = Planned(plan.stage);
  return file;
}

std::uint64_t FrameBytes(const hal::CameraCapabilities& camera) {
  return std::uint64_t{4096} +
         static_cast<std::uint64_t>(camera.width) * camera.height * (camera.bits == 32 ? 4u : 2u);
}

CaptureEstimate DryRun(const ExpandedPlan& e, const hal::Devices& devices) {
  const hal::CameraCapabilities camera = devices.camera->capabilities();
  const Plan& plan = e.plan;
  const int rungs = static_cast<int>(e.ladder_s.size()), channels = e.channels_in_turn;
  const double ladder_s =
      std::accumulate(e.ladder_s.begin(), e.ladder_s.end(), 0.0) + rungs * camera.readout_s;

  CaptureEstimate estimate;
  estimate.positions = static_cast<int>(e.positions.size());
  const int brackets = estimate.positions * e.prints * channels;
  const int references = ReferenceCount(plan, estimate.positions);
  estimate.frames = brackets * rungs * plan.exposure.repeats + 2 * plan.dark_repeats * rungs +
                    references * channels;
  estimate.duration_s = brackets * (plan.exposure.repeats + 1) * ladder_s +
                        2 * plan.dark_repeats * ladder_s +
                        references * channels * e.ladder_s.front();
  const StageTravel travel = TravelOf(e, devices.stage->limits(), devices.stage->Where().setpoint);
  estimate.duration_s += travel.duration_s;
  estimate.stage_path_m = travel.path_m;
  estimate.bytes = FrameBytes(camera) * static_cast<std::uint64_t>(estimate.frames);

  // A texel is measured where this puts its centre on the sensor.
  const rig::Homography sensor_from_image = devices.rig.image_from_sensor.Adjugate();
  const auto& lattice = plan.geometry.lattice;
  const int step =
      std::max(1, std::max(lattice.width, lattice.height) / 64);  // a sample is enough for a share
  std::uint64_t off = 0, all = 0;
  for (const PlannedPosition& p : e.positions)
    for (int row = step / 2; row < lattice.height; row += step)
      for (int column = step / 2; column < lattice.width; column += step) {
        const hal::Vec2 q = lattice.centre(row, column) - p.centre;
        const hal::Vec2 pixel = sensor_from_image.Map(q);
        ++all;
        off +=
            !(pixel.x >= 0 && pixel.x <= camera.width && pixel.y >= 0 && pixel.y <= camera.height);
      }
  estimate.off_sensor_share = static_cast<double>(off) / static_cast<double>(all);
  return estimate;
}

}  // namespace luxfield::capture
