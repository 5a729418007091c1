// luxfield relight PICTURE.exr --scale LAMP=0.5 -o X.exr
#include <fmt/format.h>

#include <map>
#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/verbs/png_options.h"
#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/render/film/film.h"
#include "luxfield/render/film/light_groups.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string picture, output;
  std::vector<std::string> scales;
  PngOptions png;
};

std::map<std::string, double> ParseScales(const std::vector<std::string>& texts) {
  std::map<std::string, double> scales;
  for (const auto& text : texts) {
    const auto equals = text.rfind('=');
    if (equals == std::string::npos || equals == 0)
      throw InputError(fmt::format("--scale {} is not LIGHT=NUMBER, as 'left lamp=0.5'", text));
    const std::string name = text.substr(0, equals);
    if (!scales.emplace(name, ParseQuantity(text.substr(equals + 1), "--scale", {{"", 1}})).second)
      throw InputError(fmt::format("--scale names '{}' twice; name it once", name));
  }
  return scales;
}

double MeanLuminance(const core::Image& radiance) {
  double sum = 0;
  for (const float y : core::LuminanceImage(radiance).data) sum += y;
  return sum / static_cast<double>(radiance.plane_size());
}

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".exr", "--output");
  CheckPngOptions(options.png);
  const auto scales = ParseScales(options.scales);
  const render::Frame frame =
      render::ScaleLightGroups(render::ReadFrame(options.picture), scales, options.picture);
  render::WriteFrame(options.output, frame);
  WritePng(options.png, frame.radiance);
  const double noise = render::NoiseOf(frame, 1).RelativeError();
  fmt::print("{}: {} x {}, estimated noise {:.3g} % of the mean radiance (RMS)\n", options.output,
             frame.width, frame.height, 100 * noise);
  core::Json groups = core::Json::array();
  for (const auto& group : frame.groups) {
    const auto scale = scales.find(group.name);
    const double factor = scale == scales.end() ? 1 : scale->second,
                 luminance = MeanLuminance(group.radiance);
    fmt::print("  {:<20}  x {:<8g} mean {} {:.4g} {}\n", group.name, factor,
               frame.unit == lightfield::FluxUnit::kLumen ? "luminance" : "radiance", luminance,
               render::RadianceUnitName(frame.unit));
    groups.push_back({{"name", group.name}, {"scale", factor}, {"mean_radiance", luminance}});
  }
  return {{"estimated_rel_rmse", noise}, {"groups", groups}};
}

}  // namespace

void AddRelight(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("relight", [options]() -> core::Json { return Run(*options); });
  verb.add_option("PICTURE", options->picture, "The EXR with light groups")
      ->required()
      ->check(InputFile({core::FileKind::kExrPicture}));
  verb.add_option("--scale", options->scales,
                  "LIGHT=NUMBER: what multiplies a light, named as in the scene; may be repeated")
      ->required();
  verb.add_option("-o,--output", options->output, "The EXR to write, with its groups scaled")
      ->required()
      ->check(OutputFile());
  AddPngOptions(verb, options->png);
}

}  // namespace luxfield::cli
