#include "luxfield/bench/bench_plan.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/planning/capture_planner.h"
#include "luxfield/planning/lab_variant.h"

namespace luxfield::bench {
namespace {

// What PlannedCapture::noise holds, as far as the lab has it.
std::vector<std::string> NoiseSources(const std::filesystem::path& lab) {
  auto names = planning::ErrorSources(lab);
  std::erase_if(names, [](const std::string& name) {
    return name != "photon_noise" && name != "read_noise" && name != "dark_current" &&
           name != "prnu";
  });
  return names;
}

core::Json Row(const planning::CapturePlanner& planner, const BenchPlanOptions& options,
               const planning::PlannedCapture& plan, const std::vector<std::string>& sources) {
  double square = 0, fourth = 0, rig_s = 0, rejected = 0;
  for (int run = 0; run < options.runs; ++run) {
    core::ThrowIfInterrupted();
    const auto capture = planner.Simulate(plan, options.folder,
                                          options.seed + static_cast<std::uint64_t>(run), sources);
    const double e2 = capture.error.value * capture.error.value;
    square += e2 / options.runs;
    fourth += e2 * e2 / options.runs;
    rig_s += capture.rig_s / options.runs;
    rejected += capture.rejected + capture.flagged;
  }
  const double observed = std::sqrt(square), predicted = plan.error();
  const double runs_se =
      options.runs > 1
          ? std::sqrt(std::max(0.0, fourth - square * square) / (options.runs - 1)) / (2 * square)
          : 0;
  const double ratio = observed / predicted;
  const auto& grid = plan.plan.geometry.grid;
  return {{"family", plan.family},
          {"positions", grid.count()},
          {"spacing_mm", 1e3 * grid.spacing_m},
          {"runs", options.runs},
          {"truncation", plan.truncation},
          {"noise", plan.noise},
          {"predicted", predicted},
          {"observed", observed},
          {"ratio", ratio},
          {"ratio_se", ratio * runs_se},
          {"picture_se", plan.truncation * plan.truncation_se / predicted},
          {"retaken", rejected},
          {"capture_s", plan.capture_s},
          {"rig_s", rig_s},
          {"time_ratio", rig_s / plan.capture_s}};
}

}  // namespace

nlohmann::json BenchPlan(const BenchPlanOptions& options) {
  const core::Stopwatch watch;
  planning::CapturePlannerOptions how;
  how.lab = options.lab;
  how.scene = options.scene;
  how.base = capture::ReadPlan(options.plan);
  how.texels = options.texels;
  how.receivers = options.receivers;
  how.seed = options.seed;
  const planning::CapturePlanner planner(how);
  auto plans = planner.Plans();
  const double search_s = watch.WallSeconds();
  const auto noise = NoiseSources(options.lab), all = planning::ErrorSources(options.lab);

  core::Json rows = core::Json::array();
  for (const double target : options.targets) {
    const planning::PlannedCapture* fastest = planning::FastestConfirmed(planner, target, &plans);
    const planning::PlannedCapture plan =
        fastest ? *fastest : planner.Confirmed(planning::MostAccurate(plans));
    for (const bool everything : {false, true}) {
      core::Json row = Row(planner, options, plan, everything ? all : noise);
      row["target"] = target;
      row["sources"] = everything ? "all" : "noise";
      rows.push_back(std::move(row));
    }
  }
  rows.push_back({{"sources", "search"},
                  {"plans", plans.size()},
                  {"truth_error", planner.truth_error()},
                  {"samples_error", planner.samples_error()},
                  {"wall_s", search_s}});
  return rows;
}

}  // namespace luxfield::bench
