#include "luxfield/cli/reports/capture_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "luxfield/cli/program.h"
#include "luxfield/core/progress.h"

namespace luxfield::cli {
namespace {

// Of a plan whose targets are changed by hand.
core::Json PrintFramesAndDarks(int frames, int darks, std::uint64_t bytes, double duration_s,
                               const char* handled, const std::vector<double>& exposures_s) {
  fmt::print("  frames       {}, {} darks ({})\n", frames, darks, FormatBytes(double(bytes)));
  fmt::print("  time         at most {} and the handling of the {}\n",
             core::FormatDuration(duration_s), handled);
  return {{"frames", frames},
          {"darks", darks},
          {"bytes", bytes},
          {"duration_s", duration_s},
          {"exposures_s", exposures_s}};
}

// What is in force of lab and plan.
core::Json PrintStageLimits(const hal::Stage& stage) {
  const hal::StageLimits limits = stage.limits();
  fmt::print("  stage        stays within ({:.4g}, {:.4g}) to ({:.4g}, {:.4g}) m, {:.3g} m/s\n",
             limits.min.x, limits.min.y, limits.max.x, limits.max.y, limits.speed_m_per_s);
  return {{"min_m", {limits.min.x, limits.min.y}},
          {"max_m", {limits.max.x, limits.max.y}},
          {"speed_m_per_s", limits.speed_m_per_s}};
}

}  // namespace

core::Json PrintDryRun(const capture::ExpandedPlan& expanded, const hal::Devices& devices) {
  const auto estimate = capture::DryRun(expanded, devices);
  const auto& g = expanded.plan.geometry;
  fmt::print("{}: {} x {} {} filters, spacing {:.6g} mm, delta {:.6g} m, images {} x {}\n",
             expanded.plan.name, g.grid.width, g.grid.height, g.grid.basis.name(),
             1e3 * g.grid.spacing_m, g.delta_m, g.lattice.width, g.lattice.height);
  const bool snapped = expanded.plan.exposure.measure_pwm;
  fmt::print("  exposures    {:.4g} s{}\n", fmt::join(expanded.ladder_s, ", "),
             snapped
                 ? ", to become whole periods of the frequency that the lamp is measured to have"
                 : "");
  fmt::print("  positions    {}, stage path {:.3g} m\n", estimate.positions, estimate.stage_path_m);
  core::Json stage = PrintStageLimits(*devices.stage);
  fmt::print("  frames       at most {} ({})\n", estimate.frames,
             FormatBytes(double(estimate.bytes)));
  fmt::print("  time         at most {} after warm-up\n",
             core::FormatDuration(estimate.duration_s));
  if (estimate.off_sensor_share > 0)
    fmt::print("  off sensor   {:.2f} % of all texels are never seen behind some filter\n",
               100 * estimate.off_sensor_share);
  return {{"positions", estimate.positions},
          {"frames", estimate.frames},
          {"bytes", estimate.bytes},
          {"duration_s", estimate.duration_s},
          {"stage_path_m", estimate.stage_path_m},
          {"stage", stage},
          {"off_sensor_share", estimate.off_sensor_share},
          {"exposures_s", expanded.ladder_s},
          {"measure_pwm", snapped}};
}

core::Json PrintDryRun(const capture::ExpandedSensorPlan& expanded, const hal::Devices& devices) {
  const auto estimate = capture::DryRun(expanded, devices);
  fmt::print("{}: flats and darks of {} exposure times, {} pair{} of each\n", expanded.plan.name,
             expanded.ladder_s.size(), expanded.plan.pairs, expanded.plan.pairs == 1 ? "" : "s");
  fmt::print("  exposures    {:.4g} s\n", fmt::join(expanded.ladder_s, ", "));
  fmt::print("  frames       {} flats, {} darks ({})\n", estimate.flats, estimate.darks,
             FormatBytes(double(estimate.bytes)));
  fmt::print("  time         {} after warm-up\n", core::FormatDuration(estimate.duration_s));
  return {{"flats", estimate.flats},
          {"darks", estimate.darks},
          {"bytes", estimate.bytes},
          {"duration_s", estimate.duration_s},
          {"exposures_s", expanded.ladder_s}};
}

core::Json PrintDryRun(const capture::ExpandedGeometryPlan& expanded, const hal::Devices& devices) {
  const auto estimate = capture::DryRun(expanded, devices);
  fmt::print("{}: where the parts of the lab stand\n", expanded.plan.name);
  for (const auto& view : expanded.views)
    fmt::print("  {:<24} stage at ({:.6g}, {:.6g}) m\n", view.target, view.setpoint->x,
               view.setpoint->y);
  core::Json stage = PrintStageLimits(*devices.stage);
  fmt::print("  frames       {} of the board, {} of the mask ({})\n", estimate.boards,
             estimate.masks, FormatBytes(double(estimate.bytes)));
  fmt::print("  time         {} and the handling of the targets\n",
             core::FormatDuration(estimate.duration_s));
  return {{"boards", estimate.boards},
          {"masks", estimate.masks},
          {"stage", stage},
          {"bytes", estimate.bytes},
          {"duration_s", estimate.duration_s},
          {"exposures_s", expanded.ladder_s}};
}

core::Json PrintDryRun(const capture::ExpandedGlarePlan& expanded, const hal::Devices& devices) {
  const auto estimate = capture::DryRun(expanded, devices);
  fmt::print("{}: veiling glare, a light trap in {} places\n", expanded.plan.name,
             expanded.targets.size());
  return PrintFramesAndDarks(estimate.frames, estimate.darks, estimate.bytes, estimate.duration_s,
                             "trap", expanded.ladder_s);
}

core::Json PrintDryRun(const capture::ExpandedFilterPlan& expanded, const hal::Devices& devices) {
  const auto estimate = capture::DryRun(expanded, devices);
  fmt::print("{}: photographs of a filter, the empty holder and {} print{}\n", expanded.plan.name,
             expanded.views.size() - 1, expanded.views.size() == 2 ? "" : "s");
  return PrintFramesAndDarks(estimate.frames, estimate.darks, estimate.bytes, estimate.duration_s,
                             "prints", expanded.ladder_s);
}

}  // namespace luxfield::cli
