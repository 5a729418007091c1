// luxfield render SCENE -o X.exr
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "cli/program.h"
#include "core/colour.h"
#include "render/display.h"
#include "render/film.h"
#include "render/renderer.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string scene, output, png, radiance_map, irradiance_map, display, device;
  std::vector<std::string> light_fields, tables;
  std::optional<double> exposure;
  std::optional<int> width, height;
  std::vector<double> scale;
  render::RenderOptions render;
  bool no_shadows = false;
};

// "NAME=FILE" or "FILE" (all luminaires).
std::map<std::string, std::filesystem::path> ParseAssignments(
    const std::vector<std::string>& texts) {
  std::map<std::string, std::filesystem::path> assignments;
  for (const auto& text : texts) {
    const auto equals = text.find('=');
    if (equals == std::string::npos)
      assignments["*"] = text;
    else
      assignments[text.substr(0, equals)] = text.substr(equals + 1);
  }
  return assignments;
}

core::Json Run(Options options, const Common& common) {
  RequireExtension(options.output, ".exr", "--output");
  for (const auto* png : {&options.png, &options.radiance_map, &options.irradiance_map})
    if (!png->empty()) RequireExtension(*png, ".png", "a picture's name");
  scene::SceneOverrides overrides;
  overrides.light_fields = ParseAssignments(options.light_fields);
  overrides.tables = ParseAssignments(options.tables);
  overrides.width = options.width;
  overrides.height = options.height;
  options.render.shadows = !options.no_shadows;
  options.render.seed = common.seed.value_or(1);
  options.render.Validate();
  const scene::Scene scene = scene::ReadScene(options.scene, overrides);
  const render::Device device = render::Device::Open(options.device, common.threads);
  render::LitScene lit(device, scene);
  const render::Frame frame = render::Renderer(lit, options.render).Render();
  render::WriteFrame(options.output, frame);
  render::ToneMapping mapping;
  mapping.exposure = options.exposure;
  if (!options.png.empty()) render::WritePng(options.png, render::ToneMap(frame.radiance, mapping));
  render::FalseColourScale scale;
  if (!options.scale.empty()) scale = {options.scale[0], options.scale[1]};
  if (!options.radiance_map.empty())
    render::WriteFalseColour(options.radiance_map, frame.radiance,
                             frame.unit == lightfield::FluxUnit::kLumen ? "luminance" : "radiance",
                             render::RadianceUnitName(frame.unit), scale);
  if (!options.irradiance_map.empty())
    render::WriteFalseColour(
        options.irradiance_map, frame.irradiance,
        frame.unit == lightfield::FluxUnit::kLumen ? "illuminance" : "irradiance",
        render::IrradianceUnitName(frame.unit), scale);
  if (!options.display.empty())
    render::Display(options.display).Show(options.output, frame.radiance);

  double samples = 0, variance = 0, radiance = 0;
  for (std::size_t k = 0; k < frame.samples.data.size(); ++k) {
    samples += frame.samples.data[k];
    variance += frame.variance.data[k];
    radiance += core::Luminance(
        {frame.radiance.plane(0)[k], frame.radiance.plane(1)[k], frame.radiance.plane(2)[k]});
  }
  const auto pixels = static_cast<double>(frame.samples.data.size());
  const double noise = radiance > 0 ? std::sqrt(variance * pixels) / radiance : 0;
  fmt::print("{}: {} x {}, {} on {}, {}\n", options.output, frame.width, frame.height,
             options.render.estimator, device.info().name,
             options.render.shadows ? "traced shadows" : "no shadows");
  fmt::print(
      "  light samples         {:.4g} in all; estimated noise {:.3g} % of the mean radiance "
      "(RMS)\n",
      samples, 100 * noise);
  fmt::print("  time                  {:.3f} s primary visibility, {:.3f} s lighting\n",
             frame.times.gbuffer_s, frame.times.lighting_s);
  return {{"width", frame.width},
          {"height", frame.height},
          {"estimator", options.render.estimator},
          {"device", device.info().name},
          {"light_samples", samples},
          {"estimated_rel_rmse", noise},
          {"gbuffer_s", frame.times.gbuffer_s},
          {"lighting_s", frame.times.lighting_s}};
}

}  // namespace

void AddRender(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("render", "Light a scene with measured luminaires",
                                   [options, &program] { return Run(*options, program.common()); });
  std::vector<std::string> names;
  std::string guarantees;
  for (const auto& traits : render::EstimatorList()) {
    names.push_back(traits.name);
    guarantees += fmt::format("  {:<10} {}\n", traits.name, traits.guarantee);
  }
  verb.footer("Estimators:\n" + guarantees);
  verb.add_option("SCENE", options->scene, "The scene.toml")->required();
  verb.add_option("-o,--output", options->output, "The EXR to write: radiance and AOVs")
      ->required();
  verb.add_option("--estimator", options->render.estimator, "How light is gathered, see below")
      ->check(CLI::IsMember(names));
  verb.add_option("--spp", options->render.samples_per_pixel,
                  "Light samples per pixel over all luminaires");
  verb.add_option("--antialias", options->render.antialias, "Surface points per pixel");
  verb.add_option("--k-max", options->render.max_samples_per_image,
                  "Most samples per coefficient image and pixel, 0 for no bound");
  verb.add_flag("--no-shadows", options->no_shadows, "Do not trace shadow rays");
  verb.add_option("--light-field", options->light_fields,
                  "[NAME=]FILE.lf.exr instead of the scene's own, for one luminaire or all");
  verb.add_option("--tables", options->tables, "[NAME=]FILE.tab.exr, likewise");
  verb.add_option("--width", options->width, "Picture width instead of the scene's, pixels");
  verb.add_option("--height", options->height, "Picture height instead of the scene's, pixels");
  verb.add_option(
      "--device", options->device,
      "OpenCL device: a number or a part of its name, see `luxfield devices` (default: the first)");
  verb.add_option("--png", options->png, "Also a tone-mapped PNG");
  verb.add_option(
      "--exposure", options->exposure,
      "PNG value = radiance times this, clipped at 1 (default: the exponential operator)");
  verb.add_option("--radiance-map", options->radiance_map,
                  "Also a false-colour PNG of radiance (luminance in cd/m2) with legend");
  verb.add_option("--irradiance-map", options->irradiance_map,
                  "Also a false-colour PNG of irradiance (illuminance in lx) with legend");
  verb.add_option("--scale", options->scale,
                  "Lowest and highest value of the false-colour legend (default: from the picture)")
      ->expected(2);
  verb.add_option("--display", options->display,
                  "Show the picture in a running tev viewer at host:port");
}

}  // namespace luxfield::cli
