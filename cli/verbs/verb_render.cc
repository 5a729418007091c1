// luxfield render SCENE -o X.exr
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "luxfield/cli/memory_option.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/verbs/kernels_ahead.h"
#include "luxfield/cli/verbs/png_options.h"
#include "luxfield/cli/verbs/render_sequence.h"
#include "luxfield/cli/verbs/verb_render.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/outputs.h"
#include "luxfield/render/accuracy/accuracy.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/render/accuracy/soft_maps_error.h"
#include "luxfield/render/column_picture.h"
#include "luxfield/render/device/programs_ahead.h"
#include "luxfield/render/film/display.h"
#include "luxfield/render/film/film.h"
#include "luxfield/render/lights/shadow_maps.h"
#include "luxfield/scene/named_view.h"

namespace luxfield::cli {
namespace {

// Chosen estimator and samples for an error or a time asked for.
render::AccurateFrame RenderToTarget(render::LitScene& scene, const RenderVerbOptions& options) {
  if (options.samples_given)
    throw InputError("--spp contradicts --error and --time, which choose the samples; drop one");
  render::AccuracyRequest request;
  request.picture = options.render;
  if (!options.error.empty())
    request.rel_error = ParseQuantity(options.error, "--error", {{"%", 0.01}});
  if (!options.time.empty())
    request.time_s = ParseQuantity(options.time, "--time", {{"s", 1}, {"ms", 1e-3}});
  if (options.estimator_given) request.estimators = {options.render.estimator};
  return render::RenderToAccuracy(scene, request);
}

core::Json Describe(const render::AccurateFrame& result, const RenderVerbOptions& options) {
  core::Json considered = core::Json::array();
  for (const auto& setting : result.considered)
    considered.push_back({{"estimator", setting.estimator},
                          {"spp", setting.samples_per_pixel},
                          {"predicted_s", setting.predicted_s},
                          {"predicted_rel_rmse", setting.predicted_error}});
  core::Json json{{"estimator", result.chosen.estimator},
                  {"spp", result.chosen.samples_per_pixel},
                  {"estimated_rel_rmse", result.estimated_error},
                  {"met", result.met},
                  {"choosing_s", result.choosing_s},
                  {"considered", considered}};
  fmt::print("  asked                 {}; estimated error {:.3g} %{}\n",
             options.error.empty() ? options.time : options.error, 100 * result.estimated_error,
             result.met ? "" : ", which MISSES what was asked");
  fmt::print("  chosen                {}{}; considered", result.chosen.estimator,
             result.chosen.samples_per_pixel
                 ? fmt::format(" with {} samples a pixel", result.chosen.samples_per_pixel)
                 : std::string());
  for (const auto& setting : result.considered)
    fmt::print(" {} ({} samples: {:.3g} s, {:.2g} %)", setting.estimator, setting.samples_per_pixel,
               setting.predicted_s, 100 * setting.predicted_error);
  fmt::print("\n");
  return json;
}

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

core::Json DescribeSoftMaps(const render::SoftMapsError& error) {
  fmt::print(
      "  soft shadow maps      {:.2g} % relative RMSE, {:.2g} mean Lab against traced shadows, "
      "at a small picture\n",
      100 * error.rel_error, error.mean_lab);
  return {{"rel_rmse", error.rel_error}, {"mean_lab", error.mean_lab}};
}

// The estimators of luminaires that read a knob (KnobHelp); none of the knobs of other lights.
std::vector<std::string> ReadersOf(const std::string& knob) {
  if (knob == "basis-share") return {"windowed"};
  if (knob == "brdf-share") return {"windowed", "cells"};
  for (const char* of_thesis : {"allocation", "inversion", "depth", "correlation", "sequence"})
    if (knob == of_thesis) return {"thesis"};
  return {};
}

// Settings that the picture would not depend on, as it is made otherwise, or that leave a light out.
void RefuseUnread(const RenderVerbOptions& options, const scene::Scene& scene) {
  const bool chosen = (!options.error.empty() || !options.time.empty()) && !options.estimator_given;
  const auto refuse = [&](const std::string& option, const std::vector<std::string>& readers) {
    const auto& estimator = options.render.estimator;
    if (chosen || std::find(readers.begin(), readers.end(), estimator) != readers.end()) return;
    throw InputError(fmt::format("{} is read by --estimator {} and not by {}; drop it or choose {}",
                                 option, fmt::join(readers, " and "), estimator,
                                 readers.size() == 1 ? "that" : "one of them"));
  };
  for (const std::string& knob : options.knobs) {
    const std::string name = knob.substr(0, knob.find('='));
    if (const auto readers = ReadersOf(name); !readers.empty()) refuse("--knob " + name, readers);
    if (name.starts_with("environment-") && !scene.environment)
      throw InputError(options.scene,
                       fmt::format("has no environment, which --knob {} is of", name), "drop it");
  }
  if (options.approximation_given) refuse("--approximation-error", {"volume", "gloss"});
  if (options.shadow_map_given && (options.shadows == "none" || options.shadows == "traced"))
    throw InputError(fmt::format(
        "--shadow-map-size is read with --shadows maps, thesis-maps or soft-maps and not with {}; "
        "drop it or choose one of them",
        options.shadows));
  if (options.render.knobs.strategies.strategies == render::Strategies::kBrdf)
    for (const scene::ClassicalLight& light : scene.classical_lights)
      if (light.model != scene::ClassicalModel::kArea)
        throw InputError(options.scene,
                         fmt::format("the luminaire '{}' is no area, which no sample that follows "
                                     "the BRDF meets",
                                     light.name),
                         "choose --knob strategies= other than brdf");
  if (!options.scale.empty() && options.radiance_map.empty() && options.irradiance_map.empty())
    throw InputError(
        "--scale is of --radiance-map and --irradiance-map; give one of them, or drop it");
}

// Pictures to look at have smooth edges, where there are samples for it of two strata of lights
// (many_lights.h).
int UsualAntialias(const RenderVerbOptions& options) {
  constexpr int kStrata = 2;
  const bool smooth = !options.png.png.empty() &&
                      options.render.samples_per_pixel >= kStrata * render::kSmoothAntialias;
  return smooth ? render::kSmoothAntialias : 1;
}

// The programs of a picture whose estimator is named; the choice of one measures the processors' time,
// which is to be spent on nothing else.
void BuildProgramsAhead(const render::Device& device, const RenderVerbOptions& options,
                        std::optional<render::ProgramsAhead>& ahead) {
  if (!options.error.empty() || !options.time.empty()) return;
  ahead.emplace(device,
                fmt::format("render {} {} {}", std::filesystem::absolute(options.scene).string(),
                            options.render.estimator, options.shadows));
}

struct Rendered {
  render::Frame frame;  // whose files are written
  core::Json json;
};

Rendered Write(render::Frame frame, const RenderVerbOptions& options,
               const render::Device& device) {
  WritePictures(frame, options);
  core::Json json = Describe(frame, options, device.info().name);
  return {std::move(frame), std::move(json)};
}

// Light fields group by group.
Rendered RenderWithinMemory(const render::Device& device, RenderSetUp set_up) {
  const RenderVerbOptions& options = set_up.options;
  if (!options.error.empty() || !options.time.empty())
    throw InputError(
        fmt::format("--memory contradicts {}, which chooses among estimators that take light "
                    "fields as a whole; drop one",
                    options.error.empty() ? "--time" : "--error"));
  MemoryLeft(options.memory);  // a wrong number comes before the work
  render::ColumnPicture picture(device, std::move(set_up.scene), options.render);
  return Write(picture.Render(*MemoryLeft(options.memory)), options, device);
}

// With everything on the device.
Rendered RenderAtOnce(const render::Device& device, RenderSetUp set_up) {
  RenderVerbOptions& options = set_up.options;
  render::LitScene lit(device, std::move(set_up.scene));
  std::optional<render::AccurateFrame> accurate;
  if (!options.error.empty() || !options.time.empty()) {
    const KernelsAhead ahead(lit, options);
    accurate = RenderToTarget(lit, options);
    options.render.estimator = accurate->chosen.estimator;
  }
  Rendered rendered = Write(
      accurate ? accurate->frame : render::Renderer(lit, options.render).Render(), options, device);
  if (accurate) rendered.json["accuracy"] = Describe(*accurate, options);
  if (options.render.shadows == render::Shadows::kSoftMaps)
    rendered.json["soft_maps"] = DescribeSoftMaps(render::MeasureSoftMaps(lit, options.render));
  return rendered;
}

core::Json Run(const RenderVerbOptions& given, const Common& common) {
  const render::Device device = render::Device::Open(given.device, common.threads);
  std::optional<render::ProgramsAhead> ahead;
  BuildProgramsAhead(device, given, ahead);
  RenderSetUp set_up = SetUpRender(given, common.seed.value_or(1));
  if (FrameCount(set_up) > 0) return RenderSequence(device, std::move(set_up));
  if (given.resume)
    throw InputError(given.scene, "makes one picture, and --resume is for a sequence of frames",
                     "drop it, or give --sequence");
  std::optional<core::Image> reference;
  if (!given.reference.empty()) reference = core::ReadExrImage(given.reference);
  Rendered rendered = given.memory.empty() ? RenderAtOnce(device, std::move(set_up))
                                           : RenderWithinMemory(device, std::move(set_up));
  if (reference) {
    const double error = render::LuminanceError(rendered.frame.radiance, *reference);
    rendered.json["true_rel_rmse"] = error;
    fmt::print("  true error            {:.3g} % against {}\n", 100 * error, given.reference);
  }
  return rendered.json;
}

}  // namespace

void WritePictures(const render::Frame& frame, const RenderVerbOptions& options) {
  WritePng(options.png, frame.radiance);
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
  render::WriteFrame(options.output, frame);  // last: where it is, all are (RenderedSequence)
  if (!options.display.empty())
    render::Display(options.display).Show(options.output, frame.radiance);
}

core::Json Describe(const render::Frame& frame, const RenderVerbOptions& options,
                    const std::string& device) {
  double samples = 0, radiance = 0, lowest = 0;
  std::size_t negative = 0;
  for (std::size_t k = 0; k < frame.samples.data.size(); ++k) {
    samples += frame.samples.data[k];
    const double luminance = core::Luminance(
        {frame.radiance.plane(0)[k], frame.radiance.plane(1)[k], frame.radiance.plane(2)[k]});
    radiance += luminance;
    negative += luminance < 0;
    lowest = std::min(lowest, luminance);
  }
  const auto pixels = static_cast<double>(frame.samples.data.size());
  const render::PictureNoise picture_noise =
      render::NoiseOf(frame, std::max(1, options.render.samples_per_pixel - 1));
  const double noise = picture_noise.RelativeError(), noise_sigma = noise * picture_noise.Sigma();
  fmt::print("{}: {} x {}, {} on {}, {}\n", options.output, frame.width, frame.height,
             options.render.estimator, device, "shadows: " + options.shadows);
  fmt::print(
      "  light samples         {:.4g} in all; estimated noise {:.3g} +- {:.1g} % of the mean "
      "radiance (RMS)\n",
      samples, 100 * noise, 100 * noise_sigma);
  if (negative > 0)
    fmt::print(
        "  negative luminance    {} pixels, down to {:.3g} % of the mean: kept in the EXR, black "
        "in "
        "PNGs\n",
        negative, 100 * lowest * pixels / std::abs(radiance));
  fmt::print("  time                  {:.3f} s primary visibility, {:.3f} s lighting\n",
             frame.times.gbuffer_s, frame.times.lighting_s);
  core::Json json{{"width", frame.width},
                  {"height", frame.height},
                  {"estimator", options.render.estimator},
                  {"device", device},
                  {"light_samples", samples},
                  {"estimated_rel_rmse", noise},
                  {"negative_pixels", negative},
                  {"estimated_rel_rmse_sigma", noise_sigma},
                  {"gbuffer_s", frame.times.gbuffer_s},
                  {"lighting_s", frame.times.lighting_s},
                  {"relighting_s", frame.times.relighting_s},
                  {"kernels", frame.times.kernels}};
  return json;
}

RenderSetUp SetUpRender(RenderVerbOptions options, std::uint64_t seed) {
  RequireExtension(options.output, ".exr", "--output");
  CheckPngOptions(options.png);
  for (const auto* png : {&options.radiance_map, &options.irradiance_map})
    if (!png->empty()) RequireExtension(*png, ".png", "a picture's name");
  scene::SceneOverrides overrides;
  overrides.light_fields = ParseAssignments(options.light_fields);
  overrides.tables = ParseAssignments(options.tables);
  overrides.width = options.width;
  overrides.height = options.height;
  options.render.shadows = render::ShadowsFromName(options.shadows);
  options.render.seed = seed;
  options.render.antialias = options.antialias.value_or(UsualAntialias(options));
  for (const auto& knob : options.knobs) options.render.knobs.Set(knob);
  options.render.Validate();
  scene::Scene scene = scene::ReadScene(options.scene, overrides);
  if (!options.view.empty())
    scene.camera = scene::ReadNamedView(options.scene, options.view, scene.camera);
  RequireLuminaires(scene);
  RefuseUnread(options, scene);
  std::vector<scene::Placement> placements;
  if (!options.sequence.empty())
    placements = scene::PlacementsOf(scene::ReadMotionPath(options.sequence), scene);
  return {std::move(options), std::move(scene), std::move(placements)};
}

void AddRenderOptions(CLI::App& verb, const std::shared_ptr<RenderVerbOptions>& options) {
  std::vector<std::string> names;
  std::string guarantees;
  for (const auto& traits : render::EstimatorList()) {
    names.push_back(traits.name);
    guarantees += fmt::format("  {:<10} {}\n", traits.name, traits.guarantee);
  }
  guarantees += fmt::format("  besides    {}\n", render::EnvironmentEstimator::Traits().guarantee);
  std::string knobs;
  for (const auto& line : render::KnobHelp()) knobs += "  " + line + "\n";
  verb.footer("Estimators:\n" + guarantees + "\nKnobs:\n" + knobs);
  verb.add_option("SCENE", options->scene, "The scene.toml")
      ->required()
      ->check(InputFile({core::FileKind::kScene}));
  verb.add_option("--view", options->view,
                  "Look from this [[view]] of the scene (default: from its [camera])");
  verb.add_option("--sequence", options->sequence,
                  "A path.toml by which camera and lamps move: writes a picture of each of its "
                  "frames, X_0000.exr, X_0001.exr ...")
      ->check(InputFile({core::FileKind::kMotionPath}));
  verb.add_flag("--resume", options->resume,
                "Of a sequence: keep the frames that are there and were made of the same");
  verb.add_option("-o,--output", options->output, "The EXR to write: radiance and AOVs")
      ->required()
      ->check(OutputFile());
  verb.add_option("--estimator", options->render.estimator, "How light is gathered, see below")
      ->check(CLI::IsMember(names))
      ->each([options](const std::string&) { options->estimator_given = true; });
  verb.add_option("--spp", options->render.samples_per_pixel,
                  "Light samples per pixel over all lights")
      ->each([options](const std::string&) { options->samples_given = true; });
  verb.add_option("--error", options->error,
                  "Instead of --spp: the relative RMSE of the luminance to reach, as 0.5%; "
                  "estimator and samples are chosen");
  verb.add_option("--time", options->time,
                  "Instead of --spp: the best picture that lighting in this time gives, as 40ms or "
                  "2s (tables and primary visibility not counted)");
  verb.add_option("--reference", options->reference,
                  "A rendered EXR of the same view: also state the true error against it")
      ->check(InputFile({core::FileKind::kExrPicture}));
  verb.add_flag("--light-groups", options->render.light_groups,
                "Also layers of each light by itself, named as in the scene: LAMP.R/G/B, "
                "LAMP.irradiance.R/G/B, LAMP.variance.Y, which `relight` scales; 28 bytes a pixel "
                "and light");
  verb.add_flag(
      "--transparent", [options](std::int64_t) { options->render.background = false; },
      "Leave the environment out behind the geometry, for compositing: it lights all the same");
  verb.add_option("--antialias", options->antialias,
                  "Surface points per pixel (default: 1, with --png 4 if --spp is 8 or more)");
  verb.add_option("--k-max", options->render.max_samples_per_image,
                  "Most samples per coefficient image and pixel, 0 for no bound");
  verb.add_option("--knob", options->knobs,
                  "A setting of the estimator as name=value, see below; may be repeated");
  verb.add_option(
          "--shadows", options->shadows,
          "none; traced: a ray per light sample; maps: shadow maps from the luminaire's "
          "filter plane; thesis-maps: from its image plane, as published; soft-maps: from 16 "
          "patches of its filter plane, weighed by their light, by --estimator volume at "
          "frame rate. An environment's are traced, or none")
      ->check(CLI::IsMember({"none", "traced", "maps", "thesis-maps", "soft-maps"}));
  verb.add_option("--shadow-map-size", options->render.shadow_map_size,
                  "Texels along each side of a shadow map")
      ->default_str("192, of soft-maps 384")
      ->check(CLI::Range(render::ShadowMaps::kMinSize, render::ShadowMaps::kMaxSize))
      ->each([options](const std::string&) { options->shadow_map_given = true; });
  verb.add_option(
          "--approximation-error", options->render.approximation_error,
          "Relative error asked of what approximates without noise: the table of `volume`; "
          "highlights of `gloss`, relative to what a point shows or to 1 % of its lobe's peak")
      ->each([options](const std::string&) { options->approximation_given = true; });
  verb.add_option("--light-field", options->light_fields,
                  "[NAME=]FILE.lf.exr instead of the scene's own, for one luminaire or all");
  verb.add_option("--tables", options->tables, "[NAME=]FILE.tab.exr, likewise");
  verb.add_option("--width", options->width, "Picture width instead of the scene's, pixels");
  verb.add_option("--height", options->height, "Picture height instead of the scene's, pixels");
  verb.add_option(
      "--device", options->device,
      "OpenCL device: a number or a part of its name, see `luxfield devices` (default: the first)");
  AddMemoryOption(
      verb, options->memory,
      "light fields of more are lit in groups of their columns, by --estimator exact or "
      "volume with --shadows none, or exact with maps");
  AddPngOptions(verb, options->png);
  verb.add_option("--radiance-map", options->radiance_map,
                  "Also a false-colour PNG of radiance (luminance in cd/m2) with legend")
      ->check(OutputFile());
  verb.add_option("--irradiance-map", options->irradiance_map,
                  "Also a false-colour PNG of irradiance (illuminance in lx) with legend")
      ->check(OutputFile());
  verb.add_option("--scale", options->scale,
                  "Lowest and highest value of the false-colour legend (default: from the picture)")
      ->expected(2);
  verb.add_option("--display", options->display,
                  "Show the picture in a running tev viewer at host:port");
}

void AddRender(Program& program) {
  auto options = std::make_shared<RenderVerbOptions>();
  AddRenderOptions(program.AddVerb("render",
                                   [options, &program]() -> core::Json {
                                     return Run(*options, program.common());
                                   }),
                   options);
}

}  // namespace luxfield::cli
