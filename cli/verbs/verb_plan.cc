// luxfield plan PLAN --lab LAB: what a capture would do, without a device moving.
// luxfield plan [PLAN] --lab LAB --max-error 1% --scene S: the capture that a scene needs.
#include <fmt/format.h>
#include <unistd.h>

#include <memory>

#include "luxfield/capture/take/capture.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/capture_report.h"
#include "luxfield/cli/reports/plan_report.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/warning.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/lightfield/edge_light_json.h"
#include "luxfield/planning/lab_variant.h"
#include "luxfield/planning/planned_edges.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string plan, lab;
  std::string max_error, scene, output, report;
  int texels = planning::CapturePlannerOptions{}.texels,
      receivers = planning::CapturePlannerOptions{}.receivers;
  bool no_capture = false;
};

// Warns, on stderr and in `json`, where the simulated lab's lamp would light the outer filters.
void AddEdgeWarnings(const std::string& lab, const capture::Plan& plan, core::Json* json) {
  (*json)["warnings"] = core::Json::array();
  const auto edges = planning::PlannedEdgeLight(lab, plan.geometry, plan.dual);
  if (!edges) return;
  (*json)["edges"] = ToJson(*edges).at("sides");
  for (const std::string& warning : EdgeWarnings(*edges, plan.geometry.grid)) {
    core::Warn(warning);
    (*json)["warnings"].push_back(warning);
  }
}

core::Json DryRun(const Options& options) {
  if (options.plan.empty())
    throw InputError("PLAN is missing; name a plan.toml, or ask for one with --max-error");
  const core::Config config = core::Config::FromFile(options.plan);
  const auto print = [&](const auto& plan, const hal::StageBounds& stage) {
    const hal::Devices devices = hal::MakeDevices(options.lab, {}, stage);
    return PrintDryRun(capture::ExpandPlan(plan, devices), devices);
  };
  switch (capture::ReadPlanKind(config)) {
    case capture::PlanKind::kSensor:
      return print(capture::ReadSensorPlan(config), {});
    case capture::PlanKind::kGeometry: {
      const capture::GeometryPlan plan = capture::ReadGeometryPlan(config);
      return print(plan, plan.stage);
    }
    case capture::PlanKind::kGlare:
      return print(capture::ReadGlarePlan(config), {});
    case capture::PlanKind::kFilter:
      return print(capture::ReadFilterPlan(config), {});
    case capture::PlanKind::kLightField:
      break;
  }
  const capture::Plan plan = capture::ReadPlan(config);
  core::Json json = print(plan, plan.stage);
  AddEdgeWarnings(options.lab, plan, &json);
  return json;
}

// Goes with what is in it, whatever happens.
struct ScratchFolder {
  std::string path = (std::filesystem::temp_directory_path() / "luxfield-plan-XXXXXX").string();
  ScratchFolder() {
    if (!::mkdtemp(path.data()))
      throw DeviceError(path + ": cannot create the folder; free space or set TMPDIR");
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

// X.lab.toml of X.toml: the lab with the plan's filters in its holder. Throws InputError where
// something else has the name.
std::filesystem::path LabBeside(const std::string& plan_toml) {
  auto lab = std::filesystem::path(plan_toml).replace_extension(".lab.toml");
  core::RequireOwn(lab, plan_toml, planning::kLabVariantMark);
  return lab;
}

core::Json ForTarget(const Options& options, std::uint64_t seed) {
  if (options.scene.empty())
    throw InputError("--max-error needs a --scene: the error is that of its picture");
  if (!options.output.empty()) RequireExtension(options.output, ".toml", "--output");
  if (!options.report.empty()) RequireExtension(options.report, ".html", "--report");
  if (!options.output.empty()) LabBeside(options.output);
  if (!options.report.empty()) CurveBeside(options.report);
  planning::PlanForTargetOptions target;
  target.max_rel_error = ParseQuantity(options.max_error, "--max-error", {{"%", 0.01}});
  if (!(target.max_rel_error > 0 && target.max_rel_error < 1))
    throw InputError(fmt::format("--max-error {} is not between 0 and 100 %", options.max_error));
  target.capture = !options.no_capture;
  target.seed = seed;
  const ScratchFolder scratch;
  target.folder = scratch.path;

  planning::CapturePlannerOptions how;
  how.lab = options.lab;
  how.scene = options.scene;
  how.texels = options.texels;
  how.receivers = options.receivers;
  how.seed = seed;
  if (!options.plan.empty()) how.base = capture::ReadPlan(std::filesystem::path(options.plan));
  how.base.name =
      std::filesystem::path(options.scene).stem().string() + " within " + options.max_error;
  const planning::CapturePlanner planner(how);
  const planning::PlanForTarget answer = planning::FindPlan(planner, target);

  const PlanQuestion question{options.lab, options.scene, target.max_rel_error,
                              planner.truth_error(), planner.samples_error()};
  core::Json json = PrintPlanForTarget(question, answer);
  core::Json files = core::Json::array();
  if (!options.report.empty()) {
    WritePlanReport(question, answer, options.report);
    const auto curve = CurveBeside(options.report).string();
    fmt::print("{}: the curve, {}: the curve alone\n", options.report, curve);
    files.insert(files.end(), {options.report, curve});
  }
  if (!answer.recommended) {
    core::PutOutputsInPlace();  // the page says what is within reach
    throw InputError(fmt::format("--max-error {}: {}", options.max_error, answer.limit));
  }
  if (!options.output.empty()) {
    const auto lab = LabBeside(options.output);
    planner.WritePlanAndLab(*answer.recommended, options.output, lab);
    fmt::print("{}: the plan; {}: the lab with its filter\n", options.output, lab.string());
    files.insert(files.end(), {options.output, lab.string()});
  }
  json["files"] = files;
  AddEdgeWarnings(options.lab, answer.recommended->plan, &json);
  return json;
}

}  // namespace

void AddPlan(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("plan", [options, &program] {
    return options->max_error.empty() ? DryRun(*options)
                                      : ForTarget(*options, program.common().seed.value_or(1));
  });
  verb.add_option("PLAN", options->plan,
                  "The plan.toml; with --max-error what the search leaves alone: unit, darks, "
                  "references, warm-up")
      ->check(InputFile({core::FileKind::kPlan}));
  verb.add_option("--lab", options->lab, "The lab.toml it is for")
      ->required()
      ->check(InputFile({core::FileKind::kLab}));
  verb.add_option("--max-error", options->max_error,
                  "Largest relative RMSE of the irradiance of the scene's picture, 1%: finds the "
                  "fastest plan on the simulated lab");
  verb.add_option("--scene", options->scene,
                  "With --max-error: the scene.toml that the lab's lamp is to light")
      ->check(InputFile({core::FileKind::kScene}))
      ->needs("--max-error");
  verb.add_option("-o,--output", options->output,
                  "With --max-error: the plan.toml to write; X.lab.toml, the lab with its filter, "
                  "beside it")
      ->check(OutputFile())
      ->needs("--max-error");
  verb.add_option("--report", options->report,
                  "With --max-error: an .html page with the curve of time against accuracy, which "
                  "is also written as .svg")
      ->check(OutputFile())
      ->needs("--max-error");
  verb.add_option("--texels", options->texels,
                  "With --max-error: texels along the longer side of the images, at most")
      ->check(CLI::Range(4, 1024))
      ->needs("--max-error");
  verb.add_option("--receivers", options->receivers,
                  "With --max-error: places of the picture that errors are taken over, per "
                  "luminaire")
      ->check(CLI::Range(10, 100000))
      ->needs("--max-error");
  verb.add_flag("--no-capture", options->no_capture,
                "With --max-error: by prediction alone, without a simulated capture")
      ->needs("--max-error");
}

}  // namespace luxfield::cli
