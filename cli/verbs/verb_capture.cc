// luxfield capture PLAN SESSION --lab LAB
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "luxfield/capture/plan/session_edges.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/capture/take/capture_filter.h"
#include "luxfield/capture/take/capture_geometry.h"
#include "luxfield/capture/take/capture_glare.h"
#include "luxfield/capture/take/capture_sensor.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/capture_report.h"
#include "luxfield/cli/verbs/session_window.h"
#include "luxfield/core/pause.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/warning.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/lightfield/edge_light_json.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string plan, session, lab;
  bool resume = false, dry_run = false, accept_drift = false, view = false;
};

// A plan that only takes frames: of `what`, by run(plan, devices, session, how).
template <typename FramesPlan, typename Capture>
core::Json RunFrames(const FramesPlan& plan, hal::Devices& devices, const Options& options,
                     const char* what, const Capture& run) {
  if (options.dry_run) return PrintDryRun(capture::ExpandPlan(plan, devices), devices);
  capture::CaptureOptions how;
  how.resume = options.resume;
  const auto summary = run(plan, devices, options.session, how);
  fmt::print("{}: {} frames of {}, {} taken again; {} on the rig\n", options.session,
             summary.frames, what, summary.rejected, core::FormatDuration(summary.rig_s));
  return {{"frames", summary.frames}, {"rejected", summary.rejected}, {"rig_s", summary.rig_s}};
}

core::Json RunPositions(const capture::Plan& plan, hal::Devices& devices, const Options& options) {
  const auto expanded = capture::ExpandPlan(plan, devices);
  if (options.dry_run) return PrintDryRun(expanded, devices);
  capture::CaptureOptions how;
  how.resume = options.resume;
  how.accept_drift = options.accept_drift;
  const auto summary = capture::RunCapture(plan, devices, options.session, how);
  fmt::print(
      "{}: {} of {} positions in {} frames, {} taken again, {} flagged; lamp {:.5f} to {:.5f} of "
      "its first reference; {} on the rig\n",
      options.session, summary.positions, summary.positions_total, summary.frames, summary.rejected,
      summary.flagged, summary.lamp_ratio_min, summary.lamp_ratio_max,
      core::FormatDuration(summary.rig_s));
  core::Json json = capture::ToJson(summary);
  json["warnings"] = core::Json::array();
  if (const auto edges = capture::FindSessionEdges(session::SessionReader(options.session))) {
    json["edges"] = ToJson(edges->light).at("sides");
    for (const std::string& warning : EdgeWarnings(edges->light, edges->grid)) {
      core::Warn(warning);
      json["warnings"].push_back(warning);
    }
  }
  return json;
}

core::Json Run(const Options& options, std::optional<std::uint64_t> seed) {
  if (options.resume && !std::filesystem::exists(options.session))
    throw InputError(options.session, "does not exist, so there is nothing to resume",
                     "correct the path, or leave --resume out to begin a capture there");
  // Before a watchdog is there: it would take a stopped process for a hang. Plans that only take
  // frames do not pause.
  core::InstallPauseHandler();
  core::EndInOrderAtTheSecondInterrupt();  // camera and stage are stopped, the journal says why
  const core::Config config = core::Config::FromFile(options.plan);
  std::optional<SessionWindow> window;
  if (options.view && !options.dry_run) window.emplace(options.session);
  const auto devices = [&](const hal::StageBounds& stage = {}) {
    return hal::MakeDevices(options.lab, seed, stage);
  };
  switch (capture::ReadPlanKind(config)) {
    case capture::PlanKind::kSensor: {
      const capture::SensorPlan plan = capture::ReadSensorPlan(config);
      hal::Devices lab = devices();
      return RunFrames(plan, lab, options, "flats and darks", capture::RunSensorCapture);
    }
    case capture::PlanKind::kGeometry: {
      const capture::GeometryPlan plan = capture::ReadGeometryPlan(config);
      hal::Devices lab = devices(plan.stage);
      return RunFrames(plan, lab, options, "calibration targets", capture::RunGeometryCapture);
    }
    case capture::PlanKind::kGlare: {
      const capture::GlarePlan plan = capture::ReadGlarePlan(config);
      hal::Devices lab = devices();
      return RunFrames(plan, lab, options, "the light trap and darks", capture::RunGlareCapture);
    }
    case capture::PlanKind::kFilter: {
      const capture::FilterPlan plan = capture::ReadFilterPlan(config);
      hal::Devices lab = devices();
      return RunFrames(plan, lab, options, "the filter and darks", capture::RunFilterCapture);
    }
    case capture::PlanKind::kLightField:
      break;
  }
  const capture::Plan plan = capture::ReadPlan(config);
  hal::Devices lab = devices(plan.stage);
  return RunPositions(plan, lab, options);
}

}  // namespace

void AddCapture(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      "capture", [options, &program] { return Run(*options, program.common().seed); });
  verb.add_option("PLAN", options->plan, "The plan.toml")
      ->required()
      ->check(InputFile({core::FileKind::kPlan}));
  verb.add_option("SESSION", options->session, "The session folder to write")->required();
  verb.add_option("--lab", options->lab, "The lab.toml with the devices")
      ->required()
      ->check(InputFile({core::FileKind::kLab}));
  verb.add_flag("--resume", options->resume, "Go on with a paused or interrupted session");
  verb.add_flag("--dry-run", options->dry_run,
                "Print the expanded plan, time and bytes; move and write nothing");
  verb.add_flag("--view", options->view,
                "Also open `luxfield view` on the session, in a window of its own that stays");
  verb.add_flag("--accept-drift", options->accept_drift,
                "Go on although the lamp drifts beyond the plan's bound, without suspending");
}

}  // namespace luxfield::cli
