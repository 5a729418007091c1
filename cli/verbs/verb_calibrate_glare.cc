// luxfield calibrate glare SESSION -o X.cal.json
#include <fmt/format.h>

#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/verbs/verb_calibrate.h"
#include "luxfield/reconstruct/calibrate/glare/calibrate_glare.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string session, output;
  bool skip_hashes = false;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".cal.json", "--output");
  const session::SessionReader session(options.session);
  const auto glare = reconstruct::CalibrateGlare(session, !options.skip_hashes);
  reconstruct::WriteGlareCalibration(options.output, glare);
  fmt::print("{}: veiling glare, the trap in {} places\n", options.output, glare.places.size());
  for (const auto& place : glare.places)
    fmt::print("  ({:6.1f}, {:6.1f})  {:.4f} % of the mean +- {:.4f} %, {} pixels\n", place.column,
               place.row, 100 * place.share, 100 * place.share_sigma, place.pixels);
  fmt::print("  share           {:.4f} % of an image's mean +- {:.4f} %, spread evenly\n",
             100 * glare.share, 100 * glare.share_sigma);
  fmt::print("  bound           {:.4f} % of an image's brightest, from beyond {:.1f} pixels\n",
             100 * glare.bound, glare.radius_px);
  return reconstruct::ToJson(glare);
}

}  // namespace

void AddCalibrateGlare(Program& program, CLI::App& group) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      group, "glare",
      "How much light lens and housing scatter over a picture, from the frames of a light trap on "
      "the evenly lit screen (plan of kind \"glare\")",
      [options] { return Run(*options); });
  verb.add_option("SESSION", options->session, "The session folder")
      ->required()
      ->check(InputFile({core::FileKind::kGlareSession, core::FileKind::kSession}));
  verb.add_option("-o,--output", options->output, "The .cal.json to write")
      ->required()
      ->check(OutputFile());
  verb.add_flag("--skip-hashes", options->skip_hashes,
                "Do not check every frame against the journal's SHA-256");
}

}  // namespace luxfield::cli
