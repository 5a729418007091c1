#include "luxfield/cli/verbs/png_options.h"

#include <map>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/error.h"
#include "luxfield/render/film/film.h"

namespace luxfield::cli {
namespace {

std::map<std::string, render::ToneCurve> CurvesByName() {
  return {render::ToneCurves().begin(), render::ToneCurves().end()};
}

}  // namespace

void AddPngOptions(CLI::App& verb, PngOptions& options) {
  verb.add_option("--png", options.png, "Also a tone-mapped PNG")->check(OutputFile());
  verb.add_option("--tone", options.tone,
                  "The PNG's tone operator: exponential of each channel; hue, the same with the "
                  "ratios of the channels kept; filmic, likewise by a film's curve (default: "
                  "exponential)")
      ->check(CLI::IsMember(CurvesByName()));
  verb.add_option("--exposure", options.exposure,
                  "Instead of --tone: PNG value = radiance times this, clipped at 1");
}

void CheckPngOptions(const PngOptions& options) {
  if (!options.png.empty()) RequireExtension(options.png, ".png", "--png");
  if (options.exposure && options.png.empty())
    throw InputError("--exposure is of --png; give that too, or drop it");
  if (!options.tone.empty() && options.png.empty())
    throw InputError("--tone is of --png; give that too, or drop it");
  if (!options.tone.empty() && options.exposure)
    throw InputError("--tone contradicts --exposure; drop one of them");
}

void WritePng(const PngOptions& options, const core::Image& radiance) {
  if (options.png.empty()) return;
  render::ToneMapping mapping;
  mapping.exposure = options.exposure;
  if (!options.tone.empty()) mapping.curve = CurvesByName().at(options.tone);
  render::WritePng(options.png, render::ToneMap(radiance, mapping));
}

}  // namespace luxfield::cli
