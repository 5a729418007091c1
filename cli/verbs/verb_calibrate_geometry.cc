// luxfield calibrate geometry SESSION -o X.cal.json
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/verbs/verb_calibrate.h"

#include <fmt/format.h>

#include <memory>

#include "luxfield/cli/reports/geometry_report.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_calibration_file.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string session, output, report;
  bool skip_hashes = false;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".cal.json", "--output");
  if (!options.report.empty()) RequireExtension(options.report, ".html", "--report");
  const session::SessionReader session(options.session);
  const auto calibration = reconstruct::CalibrateGeometry(session, !options.skip_hashes);
  reconstruct::WriteGeometryCalibration(options.output, calibration);
  fmt::print("{}: {} x {} pixels, {} views\n", options.output, calibration.geometry.width,
             calibration.geometry.height, calibration.views.size());
  PrintGeometryCalibration(calibration);
  if (!options.report.empty()) WriteGeometryReport(calibration, options.report);
  core::Json json = reconstruct::ToJson(calibration);
  json.erase("views");
  return json;
}

}  // namespace

void AddCalibrateGeometry(Program& program, CLI::App& group) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      group, "geometry",
      "Camera and distortion, the mapping onto the image plane, the filter plane, delta and the "
      "stage's axes from the frames of a session (plan of kind \"geometry\")",
      [options] { return Run(*options); });
  verb.add_option("SESSION", options->session, "The session folder")
      ->required()
      ->check(InputFile({core::FileKind::kGeometrySession, core::FileKind::kSession}));
  verb.add_option("-o,--output", options->output, "The .cal.json to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--report", options->report, "An .html page with the residuals' plots")
      ->check(OutputFile());
  verb.add_flag("--skip-hashes", options->skip_hashes,
                "Do not check every frame against the journal's SHA-256");
}

}  // namespace luxfield::cli
