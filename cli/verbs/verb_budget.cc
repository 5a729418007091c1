// luxfield budget SESSION [--uncertainty BUDGET.toml]
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/budget_report.h"
#include "luxfield/reconstruct/budget/error_budget_json.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string session, settings, report, lamp_level = "first-reference", flat_field, filter;
  std::vector<std::string> calibrations;
  std::vector<std::vector<double>> at;
  bool skip_hashes = false, estimate_exposures = false;
};

core::Json Run(const Options& options) {
  if (!options.report.empty()) RequireExtension(options.report, ".html", "--report");
  reconstruct::BudgetSettings settings;
  if (!options.settings.empty())
    settings = reconstruct::ReadBudgetSettings(core::Config::FromFile(options.settings));
  for (const auto& p : options.at)
    settings.receivers.push_back(
        {fmt::format("irradiance at ({:.4g}, {:.4g}, {:.4g})", p[0], p[1], p[2]),
         {p[0], p[1], p[2]},
         {0, 0, -1}});
  reconstruct::MergeSessionOptions how;
  how.check_hashes = !options.skip_hashes;
  how.flat_field = options.flat_field;
  how.estimate_exposures = options.estimate_exposures;
  how.calibrations.assign(options.calibrations.begin(), options.calibrations.end());
  how.lamp_level = options.lamp_level == "monitor" ? reconstruct::LampLevel::kMonitorUnity
                                                   : reconstruct::LampLevel::kFirstReference;
  std::optional<lightfield::MeasuredFilter> filter;
  if (!options.filter.empty()) filter = lightfield::ReadMeasuredFilter(options.filter);
  const auto budget = reconstruct::ComputeErrorBudget(session::SessionReader(options.session),
                                                      settings, how, filter ? &*filter : nullptr);
  PrintErrorBudget(budget);
  if (!options.report.empty())
    WriteBudgetReport(budget, settings.meter, options.session, options.report);
  core::Json json = reconstruct::ToJson(budget);
  if (settings.meter)
    json["scale"]["meter"] = {{"serial_number", settings.meter->serial_number},
                              {"calibration_date", settings.meter->calibration_date},
                              {"v_lambda", settings.meter->v_lambda}};
  return json;
}

}  // namespace

void AddBudget(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("budget", [options] { return Run(*options); });
  verb.add_option("SESSION", options->session, "The session folder")
      ->required()
      ->check(InputFile({core::FileKind::kLightFieldSession, core::FileKind::kSession}));
  verb.add_option("--uncertainty", options->settings,
                  "A budget.toml: sizes of errors that the session cannot know, quantities, light "
                  "meter (docs/formats/budget.md)");
  verb.add_option("--at", options->at,
                  "X Y Z in metres: also the irradiance there, facing the lamp (repeatable)")
      ->expected(3);
  verb.add_option("--report", options->report, "An .html page with a bar chart per quantity")
      ->check(OutputFile());
  verb.add_option("--lamp-level", options->lamp_level, "As of merge")
      ->check(CLI::IsMember({"first-reference", "monitor"}));
  verb.add_option("--calibration", options->calibrations, "As of merge: a .cal.json")
      ->check(InputCalibration());
  verb.add_option("--flat-field", options->flat_field, "As of merge: a .flat.exr")
      ->check(InputFile({core::FileKind::kFlatField}));
  verb.add_option("--filter", options->filter, "As of reconstruct: a .filter.exr")
      ->check(InputFile({core::FileKind::kMeasuredFilter}));
  verb.add_flag("--estimate-exposures", options->estimate_exposures,
                "As of merge: exposure times from the frames");
  verb.add_flag("--skip-hashes", options->skip_hashes,
                "Do not check every frame against the journal's SHA-256");
}

}  // namespace luxfield::cli
