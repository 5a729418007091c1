#include "luxfield/capture/plan/expanded_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "luxfield/capture/plan/capture_time.h"
#include "luxfield/capture/plan/stage_reach.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"

namespace luxfield::capture {
namespace {

void RequireSame(const Plan& plan, const hal::RigDescription& rig) {
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
    fail("rig.kind", hal::RigKindName(plan.rig), hal::RigKindName(rig.kind));
  number("rig.delta_m", plan.geometry.delta_m, rig.delta_m);
  if (plan.rig == hal::RigKind::kReflector) number("rig.albedo", plan.albedo, rig.albedo);
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

double PwmHz(const ExposurePolicy& exposure, const hal::RigDescription& rig) {
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

core::Json ToJson(const ExpandedPlan& e) {
  const auto& geometry = e.plan.geometry;
  const auto& grid = geometry.grid;
  const auto& lattice = geometry.lattice;
  const auto& x = e.plan.exposure;
  core::Json exposure = {{"ladder_s", e.ladder_s},
                         {"saturation_share", x.saturation_share},
                         {"relevant_share", x.relevant_share},
                         {"floor_sigmas", x.floor_sigmas},
                         {"repeats", x.repeats},
                         {"max_attempts", x.max_attempts},
                         {"mean_tolerance", x.mean_tolerance},
                         {"flicker", x.flicker}};
  if (x.measure_pwm) exposure["pwm_hz"] = x.pwm_hz;
  core::Json positions = core::Json::array();
  for (const PlannedPosition& p : e.positions)
    positions.push_back({{"i", p.i}, {"j", p.j}, {"u_m", p.centre.x}, {"v_m", p.centre.y}});
  core::Json json = {
      {"name", e.plan.name},
      {"geometry",
       {{"delta_m", geometry.delta_m},
        {"basis", grid.basis.name()},
        {"basis_a", grid.basis.a},
        {"grid_width", grid.width},
        {"grid_height", grid.height},
        {"u0_m", grid.u0_m},
        {"v0_m", grid.v0_m},
        {"spacing_m", grid.spacing_m},
        {"lattice",
         {{"width", lattice.width},
          {"height", lattice.height},
          {"s0_m", lattice.s0_m},
          {"t1_m", lattice.t1_m},
          {"ds_m", lattice.ds_m},
          {"dt_m", lattice.dt_m}}},
        {"channels", geometry.channels},
        {"unit", lightfield::FluxUnitName(geometry.unit)}}},
      {"filter", {{"kind", e.plan.dual ? "dual" : "basis"}, {"scale", e.plan.filter_scale}}},
      {"rig", {{"kind", hal::RigKindName(e.plan.rig)}, {"albedo", e.plan.albedo}}},
      {"exposure", exposure},
      {"reference",
       {{"every", e.plan.reference.every},
        {"max_drift", e.plan.reference.max_drift},
        {"resume_share", e.plan.reference.resume_share},
        {"interval_s", e.plan.reference.interval_s},
        {"max_wait_s", e.plan.reference.max_wait_s},
        {"u_m", e.reference.x},
        {"v_m", e.reference.y}}},
      {"warm_up",
       {{"window_s", e.plan.warm_up.window_s},
        {"interval_s", e.plan.warm_up.interval_s},
        {"variation", e.plan.warm_up.variation},
        {"max_wait_s", e.plan.warm_up.max_wait_s}}},
      {"darks", {{"repeats", e.plan.dark_repeats}}},
      {"positions", positions}};
  if (core::Json stage = ToJson(e.plan.stage); !stage.empty()) json["stage"] = std::move(stage);
  return json;
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

  // A texel is measured where the inverse of image_from_sensor puts its centre on the sensor.
  const auto& h = devices.rig.image_from_sensor;
  const auto& lattice = plan.geometry.lattice;
  const int step =
      std::max(1, std::max(lattice.width, lattice.height) / 64);  // a sample is enough for a share
  std::uint64_t off = 0, all = 0;
  for (const PlannedPosition& p : e.positions)
    for (int row = step / 2; row < lattice.height; row += step)
      for (int column = step / 2; column < lattice.width; column += step) {
        const hal::Vec2 q = lattice.centre(row, column) - p.centre;
        // Adjugate of h applied to (q, 1): the inverse up to a factor that the division removes.
        const double x = (h[4] * h[8] - h[5] * h[7]) * q.x + (h[2] * h[7] - h[1] * h[8]) * q.y +
                         (h[1] * h[5] - h[2] * h[4]);
        const double y = (h[5] * h[6] - h[3] * h[8]) * q.x + (h[0] * h[8] - h[2] * h[6]) * q.y +
                         (h[2] * h[3] - h[0] * h[5]);
        const double w = (h[3] * h[7] - h[4] * h[6]) * q.x + (h[1] * h[6] - h[0] * h[7]) * q.y +
                         (h[0] * h[4] - h[1] * h[3]);
        ++all;
        off += !(x / w >= 0 && x / w <= camera.width && y / w >= 0 && y / w <= camera.height);
      }
  estimate.off_sensor_share = static_cast<double>(off) / static_cast<double>(all);
  return estimate;
}

}  // namespace luxfield::capture
