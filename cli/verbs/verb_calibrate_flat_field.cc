// luxfield calibrate flat-field SESSION -o X.flat.exr
#include <fmt/format.h>

#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/verbs/verb_calibrate.h"
#include "luxfield/reconstruct/calibrate/sensor/flat_field.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string session, output, calibration;
  bool skip_hashes = false;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".flat.exr", "--output");
  const session::SessionReader session(options.session);
  const auto field =
      reconstruct::MeasureFlatField(session, options.calibration, !options.skip_hashes);
  reconstruct::WriteFlatField(options.output, field);
  const auto [least, most] =
      std::minmax_element(field.sensitivity.begin(), field.sensitivity.end());
  fmt::print("{}: relative sensitivity of {} x {} pixels from {} flats, {:.4f} to {:.4f}\n",
             options.output, field.width, field.height, field.flats, *least, *most);
  fmt::print("  noise of the measured map   {:.3g} % rms\n", 100 * field.noise);
  fmt::print("  pattern about a polynomial  {:.3g} % rms (degree {})\n", 100 * field.pattern,
             field.degree);
  fmt::print("  taken                       {}\n",
             field.measured ? "the measured map: its noise is the smaller error"
                            : "the polynomial: the pattern it lacks is the smaller error");
  return reconstruct::ToJson(field);
}

}  // namespace

void AddCalibrateFlatField(Program& program, CLI::App& group) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      group, "flat-field",
      "Relative sensitivity of every pixel, vignetting and pattern, from the flats of a session "
      "(plan of kind \"sensor\"): of the camera, or of screen and camera where they show the "
      "screen",
      [options] { return Run(*options); });
  verb.add_option("SESSION", options->session, "The session folder")
      ->required()
      ->check(InputFile({core::FileKind::kSensorSession, core::FileKind::kSession}));
  verb.add_option("-o,--output", options->output, "The .flat.exr to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--calibration", options->calibration,
                  "The sensor's .cal.json, for its noise and defects; without it the session's")
      ->check(InputFile({core::FileKind::kSensorCalibration}));
  verb.add_flag("--skip-hashes", options->skip_hashes,
                "Do not check every frame against the journal's SHA-256");
}

}  // namespace luxfield::cli
