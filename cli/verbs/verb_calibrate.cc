// luxfield calibrate sensor SESSION -o X.cal.json
#include <fmt/format.h>

#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/calibrate_report.h"
#include "luxfield/cli/verbs/verb_calibrate.h"
#include "luxfield/reconstruct/calibrate/sensor/sensor_calibration_file.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string session, output, report;
  bool skip_hashes = false;
};

core::Json RunSensor(const Options& options) {
  RequireExtension(options.output, ".cal.json", "--output");
  if (!options.report.empty()) RequireExtension(options.report, ".html", "--report");
  const session::SessionReader session(options.session);
  const auto calibration = reconstruct::CalibrateSensor(session, !options.skip_hashes);
  reconstruct::WriteSensorCalibration(options.output, calibration);
  fmt::print("{}: {} x {} pixels, {} bit\n", options.output, calibration.width, calibration.height,
             calibration.bits);
  PrintSensorCalibration(calibration);
  if (!options.report.empty()) WriteSensorReport(calibration, options.report);
  return reconstruct::ToJson(calibration);
}

}  // namespace

void AddCalibrate(Program& program) {
  CLI::App& group = program.AddGroup(VerbNamed("calibrate"));
  AddCalibrateGeometry(program, group);
  AddCalibrateFlatField(program, group);
  AddCalibrateGlare(program, group);
  AddCalibrateResponse(program, group);
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      group, "sensor",
      "Gain, read noise, dark current, PRNU, saturation and linearity from the flats and darks of "
      "a session (plan of kind \"sensor\"), by photon transfer",
      [options] { return RunSensor(*options); });
  verb.add_option("SESSION", options->session, "The session folder")
      ->required()
      ->check(InputFile({core::FileKind::kSensorSession, core::FileKind::kSession}));
  verb.add_option("-o,--output", options->output, "The .cal.json to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--report", options->report,
                  "An .html page with the photon transfer curve, its residuals and linearity")
      ->check(OutputFile());
  verb.add_flag("--skip-hashes", options->skip_hashes,
                "Do not check every frame against the journal's SHA-256");
}

}  // namespace luxfield::cli
