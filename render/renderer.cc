#include "luxfield/render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::render {
namespace {

// Bands bound the device memory, and the time until Ctrl-C is heard.
constexpr int kBandPixels = 1 << 16;
constexpr int kMaxSamples = 1 << 24;

// Point k of n in the pixel: Hammersley, in the middle of its strata; the centre if n = 1.
lightfield::Vec2 PixelSample(int k, int n) {
  double inverse = 0, digit = 0.5;
  for (int i = k; i; i >>= 1, digit /= 2) inverse += digit * (i & 1);
  return {(k + 0.5) / n, inverse + std::exp2(-std::ceil(std::log2(n)) - 1)};
}

// Part k of `total` split into n nearly equal parts, at least 1.
int Share(int total, int k, int n) { return std::max(1, total / n + (k < total % n)); }

double LuminanceOf(const cl_float4& rgb) { return core::Luminance({rgb.s[0], rgb.s[1], rgb.s[2]}); }

// Mean and squared deviations of a value of every pixel over the passes (Welford 1962).
class PassSpread {
 public:
  explicit PassSpread(std::size_t pixels) : mean_(pixels, 0.0), squares_(pixels, 0.0) {}

  void Add(std::size_t pixel, int pass, double value) {
    const double deviation = value - mean_[pixel];
    mean_[pixel] += deviation / (pass + 1);
    squares_[pixel] += deviation * deviation * pass / (pass + 1);
  }
  double VarianceOfMean(std::size_t pixel, int passes) const {
    return squares_[pixel] / (passes * (passes - 1.0));
  }

 private:
  std::vector<double> mean_, squares_;
};

EstimatorTraits TraitsOf(const std::string& estimator) {
  for (const auto& traits : EstimatorList())
    if (traits.name == estimator) return traits;
  std::string names;
  for (const auto& traits : EstimatorList()) names += (names.empty() ? "" : ", ") + traits.name;
  throw InputError(fmt::format("there is no estimator '{}'; use one of {}", estimator, names));
}

}  // namespace

void RenderOptions::Validate() const {
  TraitsOf(estimator);
  const auto check = [](const char* name, double value, double min, double max) {
    if (!(value >= min && value <= max))
      throw InputError(fmt::format("{} = {} must lie in [{}, {}]; choose a value in that range",
                                   name, value, min, max));
  };
  check("samples per pixel", samples_per_pixel, 1, kMaxSamples);
  check("pixel samples for antialiasing", antialias, 1, 1024);
  check("picture width", width, 0, 16384);
  check("picture height", height, 0, 16384);
  check("passes", passes, 1, 1 << 16);
  check("first pass", first_pass, 0, 1 << 16);
  check("shadow map size", shadow_map_size, ShadowMaps::kMinSize, ShadowMaps::kMaxSize);
  check("approximation error", approximation_error, 1e-5, 1);
  check("samples per image", static_cast<double>(max_samples_per_image), 0, 1e9);
  for (const float density : sample_density.data) check("sample density", density, 1e-3, 1e3);
  for (const int samples : light_samples) check("samples of a light", samples, 0, kMaxSamples);
}

Renderer::Renderer(LitScene& scene, const RenderOptions& options)
    : scene_(scene),
      options_((options.Validate(), options)),
      camera_(scene.camera()),
      estimator_(scene.EstimatorNamed(options.estimator)),
      lights_(scene.Lights()),
      primary_(scene.device()),
      relit_(options_.seed) {
  if (options.width > 0) camera_.width = options.width;
  if (options.height > 0) camera_.height = options.height;
  if (!options.light_samples.empty() &&
      static_cast<int>(options.light_samples.size()) != LightCount())
    throw InputError(fmt::format("samples are given for {} lights where the scene has {}",
                                 options.light_samples.size(), LightCount()));
  if (options.light_groups) {
    options_.lights_apart = true;
    const std::span<const std::string> names = scene.light_names();
    const std::size_t luminaires = scene.luminaires().size();
    groups_ = MakeLightGroups(names.first(luminaires), names.subspan(luminaires),
                              scene.geometry().emissive, camera_.width, camera_.height);
    for (const auto& name : names)
      group_of_.push_back(static_cast<std::size_t>(
          std::find_if(groups_.begin(), groups_.end(),
                       [&](const LightGroup& group) { return group.name == name; }) -
          groups_.begin()));
  }
  scene.Require(estimator_.traits().needs, options.approximation_error);
  if (options.knobs.strategies.everywhere) scene.Require({.cells = true});
  RequireShadows(estimator_.traits(), options.shadows);
  if (options.shadows == Shadows::kTraced)
    scene.Require(estimator_.traits().needs_for_shadows, options.approximation_error);
  if (scene.environment()) {
    const EnvironmentKnobs& knobs = options.knobs.environment;
    scene.RequireEnvironment({knobs.tiles, knobs.compensation});
    background_.emplace(scene.device());
  }
  if (options.shadows == Shadows::kThesisMaps) scene.Require({.sat = true});  // reference positions
  if (options.shadows == Shadows::kMaps || options.shadows == Shadows::kThesisMaps)
    for (const auto& luminaire : scene.luminaires()) {
      const auto& field = luminaire.light_field->field;
      shadow_maps_.emplace_back(
          scene.device(), field.geometry,
          options.shadows == Shadows::kMaps
              ? CellCentres(field)
              : ReferencePositions(field.geometry, luminaire.light_field->reference),
          luminaire.world_from_luminaire, scene.geometry().bvh, options.shadow_map_size);
    }
}

int Renderer::LightCount() const { return static_cast<int>(lights_.size()); }

int Renderer::SharedSets() const {
  constexpr int kInterleaved = 4;  // sets that a row of pixels sees
  const SampleSets sets = options_.knobs.environment.sets;
  if ((scene_.environment() && sets == SampleSets::kShared) ||
      (options_.estimator == "thesis" && !options_.knobs.decorrelated))
    return 1;
  return scene_.environment() && sets == SampleSets::kInterleaved ? kInterleaved : 0;
}

Visibility Renderer::VisibilityOf(std::size_t light) const {
  if (light < shadow_maps_.size()) return {.maps = &shadow_maps_[light]};  // luminaires come first
  return {.bvh = options_.shadows == Shadows::kNone ? nullptr : &scene_.geometry().bvh};
}

Frame Renderer::Render() {
  Frame frame;
  frame.width = camera_.width;
  frame.height = camera_.height;
  frame.unit = scene_.unit();
  frame.provenance = scene_.provenance();
  frame.provenance.merge(lightfield::Provenance{
      {"estimator", options_.estimator},
      {"samples_per_pixel", options_.light_samples.empty()
                                ? std::to_string(options_.samples_per_pixel)
                                : fmt::format("{}", fmt::join(options_.light_samples, " + "))},
      {"antialias", std::to_string(options_.antialias)},
      {"passes", std::to_string(options_.passes)},
      {"seed", std::to_string(options_.seed)},
      {"shadows", ShadowsName(options_.shadows)},
      {"shadow_map_size", std::to_string(options_.shadow_map_size)},
      {"sample_density", options_.sample_density.data.empty() ? "even" : "uneven"},
      {"max_samples_per_image", fmt::format("{}", options_.max_samples_per_image)},
      {"approximation_error", fmt::format("{}", options_.approximation_error)},
      {"knobs", options_.knobs.Text()},
      {"device", scene_.device().info().name}});
  if (!scene_.area_lights().empty() || options_.knobs.strategies.everywhere)
    frame.provenance["strategies"] = options_.knobs.strategies.Text();
  if (scene_.environment()) {
    frame.provenance["environment"] = options_.knobs.environment.Text();
    frame.provenance["background"] = options_.background ? "environment" : "transparent";
  }
  for (core::Image* image : {&frame.radiance, &frame.irradiance, &frame.normal, &frame.position})
    *image = core::Image(frame.width, frame.height, 3);
  for (core::Image* image :
       {&frame.coverage, &frame.variance, &frame.stated_variance, &frame.samples})
    *image = core::Image(frame.width, frame.height, 1);
  if (options_.lights_apart) frame.lights.resize(LightCount());
  frame.groups = groups_;
  frame.times.light_s.resize(LightCount());

  const bool relight = options_.relight && options_.passes == 1;
  if (relight)
    relit_.Start(static_cast<std::size_t>(frame.width) * frame.height * options_.antialias,
                 SharedSets());
  scene_.device().TakeKernelTimes();  // what ran before is not this frame's
  const int band_rows = std::clamp(kBandPixels / frame.width, 1, frame.height);
  const int bands = (frame.height + band_rows - 1) / band_rows;
  core::Progress progress("render", static_cast<std::uint64_t>(bands) * options_.antialias);
  for (int band = 0; band < bands; ++band) {
    const int first_row = band * band_rows;
    EquallySampled all;
    all.seed = options_.seed;
    all.first_pixel =
        static_cast<std::uint32_t>(first_row) * static_cast<std::uint32_t>(frame.width);
    all.gbuffer =
        GBuffer(scene_.device(), frame.width, std::min(band_rows, frame.height - first_row),
                scene_.geometry().glossy, scene_.geometry().emissive);
    all.lighting = Lighting(scene_.device(), all.gbuffer);
    for (int k = 0; k < options_.antialias; ++k) {
      RenderBand(first_row, all, k, frame);
      progress.Advance();
    }
  }

  // Sums over pixel samples become means.
  const float samples = static_cast<float>(options_.antialias);
  const std::size_t count = frame.coverage.plane_size();
  for (std::size_t i = 0; i < count; ++i) {
    const float hits = frame.coverage.data[i];
    for (int c = 0; c < 3; ++c) {
      frame.radiance.data[c * count + i] /= samples;
      if (hits > 0) frame.irradiance.data[c * count + i] /= hits;
    }
    frame.variance.data[i] /= samples * samples;
    frame.stated_variance.data[i] /= samples * samples;
    for (LightGroup& group : frame.groups) {
      for (int c = 0; c < 3; ++c) {
        group.radiance.data[c * count + i] /= samples;
        if (hits > 0) group.irradiance.data[c * count + i] /= hits;
      }
      group.variance.data[i] /= samples * samples;
    }
    frame.coverage.data[i] /= samples;
  }
  for (LightTotals& light : frame.lights) {
    light.mean_luminance /= samples * static_cast<double>(count);
    light.mean_variance /= double{samples} * samples * static_cast<double>(count);
  }
  if (relight) {
    frame.variance_scale = relit_.Scale();
    frame.scale_log_variance = relit_.LogVariance();
    for (float& v : frame.variance.data) v *= static_cast<float>(frame.variance_scale);
    ScaleGroups(frame);
  }
  frame.alpha = frame.coverage;
  if (scene_.environment() && options_.background)
    std::fill(frame.alpha.data.begin(), frame.alpha.data.end(), 1.0f);
  frame.times.kernels = scene_.device().TakeKernelTimes();
  return frame;
}

std::vector<Renderer::EquallySampled> Renderer::BySamples(const GBuffer& gbuffer,
                                                          const BandSurface& surface,
                                                          int first_row) const {
  const core::Image& density = options_.sample_density;
  std::map<float, std::vector<std::size_t>> pixels;
  for (std::size_t i = 0; i < surface.position.size(); ++i) {
    if (surface.position[i].s[3] == 0) continue;
    const int pixel = static_cast<int>(i), row = first_row + pixel / camera_.width,
              column = pixel % camera_.width;
    pixels[density.at(0, row * density.height / camera_.height,
                      column * density.width / camera_.width)]
        .push_back(i);
  }
  auto first_pixel =
      static_cast<std::uint32_t>(first_row) * static_cast<std::uint32_t>(camera_.width);
  std::vector<EquallySampled> parts;
  for (auto& [value, of_part] : pixels) {
    EquallySampled part = PartOf(gbuffer, surface, std::move(of_part));
    part.density = value;
    part.seed = options_.seed;
    part.first_pixel = first_pixel;
    first_pixel += static_cast<std::uint32_t>(part.gbuffer.width);
    parts.push_back(std::move(part));
  }
  return parts;
}

Renderer::EquallySampled Renderer::PartOf(const GBuffer& gbuffer, const BandSurface& surface,
                                          std::vector<std::size_t> pixels) const {
  const auto packed = [&](const std::vector<cl_float4>& values) {
    std::vector<cl_float4> own;
    for (const std::size_t i : pixels) own.push_back(values[i]);
    return Buffer::From(scene_.device(), own);
  };
  EquallySampled part;
  part.gbuffer.width = static_cast<int>(pixels.size());
  part.gbuffer.height = 1;
  part.gbuffer.eye = gbuffer.eye;
  part.gbuffer.position = packed(surface.position);
  part.gbuffer.normal = packed(surface.normal);
  part.gbuffer.albedo = packed(surface.albedo);
  if (gbuffer.glossy()) part.gbuffer.gloss = packed(surface.gloss);
  part.lighting = Lighting(scene_.device(), part.gbuffer);
  part.pixels = std::move(pixels);
  return part;
}

void Renderer::Relight(const EquallySampled& part, const GBuffer& gbuffer,
                       const BandSurface& surface, int pixel_sample, const BandLight& light,
                       Frame& frame) {
  std::vector<std::size_t> hits;
  for (std::size_t k = 0; k < gbuffer.pixel_count() && part.pixels.empty(); ++k)
    if (surface.position[k].s[3] != 0) hits.push_back(k);
  const std::vector<std::size_t>& pixels = part.pixels.empty() ? hits : part.pixels;
  const auto of_pixels = [&](const std::vector<float>& values) {
    std::vector<float> own;
    for (const std::size_t i : pixels) own.push_back(values[i]);
    return own;
  };
  std::vector<std::vector<float>> of_lights;
  for (const auto& stated : light.stated) of_lights.push_back(of_pixels(stated));
  const auto draws = relit_.Choose(of_pixels(light.variance), of_lights);
  if (draws.empty()) return;
  // A picture of the draws, in which a pixel may come twice.
  std::vector<std::size_t> drawn;
  std::vector<cl_float4> albedo;
  for (const auto& draw : draws) {
    drawn.push_back(pixels[draw.pixel]);
    albedo.push_back(surface.albedo[drawn.back()]);
  }
  EquallySampled again = PartOf(gbuffer, surface, std::move(drawn));
  again.pixels.clear();
  again.density = part.density;
  again.first_pixel = static_cast<std::uint32_t>(relit_.drawn() - draws.size());
  std::vector<std::vector<double>> luminance(relit_.runs());
  std::vector<std::vector<std::vector<double>>> of_light(
      frame.lights.size(), std::vector<std::vector<double>>(relit_.runs()));
  RenderTimes own;
  for (int run = 0; run < relit_.runs(); ++run) {
    again.seed = relit_.Seed(run);
    BandLight anew(draws.size(), frame.lights.size());
    LightPart(again, albedo, pixel_sample, 0, anew, own);
    for (const auto& radiance : anew.radiance) luminance[run].push_back(LuminanceOf(radiance));
    for (std::size_t l = 0; l < of_light.size(); ++l)
      of_light[l][run].assign(anew.luminance[l].begin(), anew.luminance[l].end());
  }
  frame.times.relighting_s += own.lighting_s;
  relit_.Add(draws, luminance);
  for (std::size_t l = 0; l < of_light.size(); ++l)
    frame.lights[l].mean_variance += RelitPixels::Variance(draws, of_light[l]);
}

void Renderer::RenderBand(int first_row, EquallySampled& band, int pixel_sample, Frame& frame) {
  GBuffer& gbuffer = band.gbuffer;
  const lightfield::Vec2 sample = PixelSample(pixel_sample, options_.antialias);
  const core::Stopwatch stopwatch;
  primary_.Render(scene_.geometry(), camera_, first_row, sample, gbuffer).Wait();
  frame.times.gbuffer_s += stopwatch.WallSeconds();
  ShowBackground(first_row, gbuffer, sample, frame);
  ShowEmission(first_row, gbuffer, frame);

  BandSurface surface{gbuffer.position.Download<cl_float4>(),
                      gbuffer.normal.Download<cl_float4>(),
                      gbuffer.albedo.Download<cl_float4>(),
                      {}};
  if (gbuffer.glossy()) surface.gloss = gbuffer.gloss.Download<cl_float4>();
  const std::size_t plane = frame.coverage.plane_size();
  const std::size_t first = static_cast<std::size_t>(first_row) * frame.width;
  for (std::size_t i = 0; i < gbuffer.pixel_count(); ++i) {
    frame.coverage.data[first + i] += surface.position[i].s[3];
    if (pixel_sample > 0) continue;
    for (int c = 0; c < 3; ++c) {
      frame.normal.data[c * plane + first + i] = surface.normal[i].s[c];
      frame.position.data[c * plane + first + i] = surface.position[i].s[c];
    }
  }

  std::vector<EquallySampled> parts;
  if (!options_.sample_density.data.empty()) parts = BySamples(gbuffer, surface, first_row);
  const int passes = options_.passes;
  const bool relight = options_.relight && passes == 1;
  const std::size_t lights = frame.lights.size();
  PassSpread spread(gbuffer.pixel_count());
  std::vector<PassSpread> of_light(lights, PassSpread(gbuffer.pixel_count()));
  for (int pass = 0; pass < passes; ++pass) {
    core::ThrowIfInterrupted();
    BandLight light(gbuffer.pixel_count(), lights);
    light.radiance_of.assign(group_of_.size(),
                             std::vector<cl_float4>(gbuffer.pixel_count(), cl_float4{}));
    light.irradiance_of = light.radiance_of;
    if (options_.sample_density.data.empty())
      LightPart(band, surface.albedo, pixel_sample, pass, light, frame.times);
    for (EquallySampled& part : parts)
      LightPart(part, surface.albedo, pixel_sample, pass, light, frame.times);
    if (relight) {
      if (parts.empty()) Relight(band, gbuffer, surface, pixel_sample, light, frame);
      for (const EquallySampled& part : parts)
        Relight(part, gbuffer, surface, pixel_sample, light, frame);
    }
    for (std::size_t i = 0; i < gbuffer.pixel_count(); ++i) {
      const std::size_t out = first + i;
      for (int c = 0; c < 3; ++c) {
        frame.irradiance.data[c * plane + out] +=
            light.irradiance[i].s[c] / static_cast<float>(passes);
        frame.radiance.data[c * plane + out] += light.radiance[i].s[c] / static_cast<float>(passes);
      }
      frame.samples.data[out] += light.samples[i];
      frame.stated_variance.data[out] +=
          light.variance[i] / (static_cast<float>(passes) * static_cast<float>(passes));
      if (passes == 1) frame.variance.data[out] += light.variance[i];
      spread.Add(i, pass, LuminanceOf(light.radiance[i]));
    }
    AddToGroups(light, first, frame);
    for (std::size_t l = 0; l < lights; ++l) {
      for (std::size_t i = 0; i < gbuffer.pixel_count(); ++i) {
        frame.lights[l].mean_luminance += double{light.luminance[l][i]} / passes;
        if (passes == 1 && !relight) frame.lights[l].mean_variance += light.stated[l][i];
        of_light[l].Add(i, pass, light.luminance[l][i]);
      }
    }
  }
  if (passes == 1) return;
  for (std::size_t i = 0; i < gbuffer.pixel_count(); ++i) {
    frame.variance.data[first + i] += static_cast<float>(spread.VarianceOfMean(i, passes));
    for (std::size_t l = 0; l < lights; ++l) {
      const double variance = of_light[l].VarianceOfMean(i, passes);
      frame.lights[l].mean_variance += variance;
      if (!frame.groups.empty())
        frame.groups[group_of_[l]].variance.data[first + i] += static_cast<float>(variance);
    }
  }
}

void Renderer::LightPart(EquallySampled& part, const std::vector<cl_float4>& albedo,
                         int pixel_sample, int pass, BandLight& light, RenderTimes& times) {
  for (int l = 0; l < LightCount(); ++l)
    AddLight(part, albedo, pixel_sample, pass, l, light, times);
}

int Renderer::SamplesOf(int light, double density, int pixel_sample, int pass) const {
  const bool given = !options_.light_samples.empty();
  const double samples =
      density * (given ? options_.light_samples[light] : options_.samples_per_pixel);
  const int all = static_cast<int>(std::lround(std::min(samples, double{kMaxSamples})));
  const int here = Share(Share(all, pixel_sample, options_.antialias), pass, options_.passes);
  return given ? here : Share(here, light, LightCount());
}

void Renderer::AddLight(EquallySampled& part, const std::vector<cl_float4>& albedo,
                        int pixel_sample, int pass, int number, BandLight& sum,
                        RenderTimes& times) {
  if (!options_.light_samples.empty() && options_.light_samples[number] == 0) return;
  EstimatorOptions options;
  // No density takes the second sample away, without which there is no variance to state.
  options.samples_per_pixel = std::max(SamplesOf(number, part.density, pixel_sample, pass),
                                       std::min(2, SamplesOf(number, 1, pixel_sample, pass)));
  options.seed = part.seed;
  options.stream = static_cast<std::uint32_t>(
      ((options_.first_pass + pass) * options_.antialias + pixel_sample) * LightCount() + number);
  options.max_samples_per_image = options_.max_samples_per_image;
  options.max_error = static_cast<float>(options_.approximation_error);
  options.knobs = options_.knobs;
  options.first_pixel = part.first_pixel;
  part.lighting.Clear();
  scene_.device().Finish();

  const auto& [source, scale] = lights_[number];
  Estimator& estimator =
      scene_.EstimatorOf(source, options_.estimator, options_.knobs.strategies.everywhere);
  const core::Stopwatch stopwatch;
  estimator.Light({part.gbuffer, VisibilityOf(number)}, source, options, part.lighting);
  scene_.device().Finish();
  const double wall_s = stopwatch.WallSeconds();
  times.lighting_s += wall_s;
  if (!times.light_s.empty()) times.light_s[number] += wall_s;
  times.lighting_core_s += stopwatch.CoreSeconds();

  const auto factor = static_cast<float>(scale);
  const auto irradiance = part.lighting.irradiance.Download<cl_float4>();
  const auto variance = part.lighting.variance.Download<float>();
  const auto samples = part.lighting.samples.Download<cl_uint>();
  const bool glossy = part.gbuffer.glossy();
  std::vector<cl_float4> reflected;
  if (glossy) reflected = part.lighting.reflected.Download<cl_float4>();
  for (std::size_t k = 0; k < irradiance.size(); ++k) {
    const std::size_t i = part.pixels.empty() ? k : part.pixels[k];
    const auto& rho = albedo[i].s;
    cl_float4 radiance{};
    for (int c = 0; c < 3; ++c) {
      const float e = factor * irradiance[k].s[c];
      radiance.s[c] =
          glossy ? factor * reflected[k].s[c] : rho[c] * std::numbers::inv_pi_v<float> * e;
      sum.irradiance[i].s[c] += e;
      sum.radiance[i].s[c] += radiance.s[c];
    }
    // Of the irradiance, where surfaces are Lambertian: seen through the albedo's luminance.
    const double shown =
        glossy ? 1.0 : core::Luminance({rho[0], rho[1], rho[2]}) * std::numbers::inv_pi;
    const auto stated = static_cast<float>(factor * factor * shown * shown * variance[k]);
    sum.variance[i] += stated;
    sum.samples[i] += static_cast<float>(samples[k]);
    if (sum.luminance.empty()) continue;
    if (!sum.radiance_of.empty()) {
      sum.radiance_of[number][i] = radiance;
      for (int c = 0; c < 3; ++c) sum.irradiance_of[number][i].s[c] = factor * irradiance[k].s[c];
    }
    sum.luminance[number][i] = static_cast<float>(LuminanceOf(radiance));
    sum.stated[number][i] = stated;
  }
}

void Renderer::ShowEmission(int first_row, const GBuffer& gbuffer, Frame& frame) {
  if (!gbuffer.emission) return;
  const auto emission = gbuffer.emission.Download<cl_float4>();
  const std::size_t plane = frame.coverage.plane_size(),
                    first = static_cast<std::size_t>(first_row) * frame.width;
  for (std::size_t i = 0; i < emission.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      frame.radiance.data[c * plane + first + i] += emission[i].s[c];
      if (!frame.groups.empty())  // the last one
        frame.groups.back().radiance.data[c * plane + first + i] += emission[i].s[c];
    }
}

void Renderer::ShowBackground(int first_row, const GBuffer& gbuffer, lightfield::Vec2 sample,
                              Frame& frame) {
  const PlacedEnvironment* environment = scene_.environment();
  if (!environment || !options_.background) return;
  const auto background =
      background_->Render(environment->light, camera_, first_row, sample, gbuffer);
  const std::size_t plane = frame.coverage.plane_size(),
                    first = static_cast<std::size_t>(first_row) * frame.width;
  for (std::size_t i = 0; i < background.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const float shown = static_cast<float>(environment->scale) * background[i].s[c];
      frame.radiance.data[c * plane + first + i] += shown;
      if (!frame.groups.empty())  // the last light's
        frame.groups[group_of_.back()].radiance.data[c * plane + first + i] += shown;
    }
}

void Renderer::AddToGroups(const BandLight& light, std::size_t first, Frame& frame) const {
  const auto passes = static_cast<float>(options_.passes);
  const std::size_t plane = frame.coverage.plane_size();
  for (std::size_t l = 0; l < group_of_.size(); ++l) {
    LightGroup& group = frame.groups[group_of_[l]];
    for (std::size_t i = 0; i < light.radiance.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        group.radiance.data[c * plane + first + i] += light.radiance_of[l][i].s[c] / passes;
        group.irradiance.data[c * plane + first + i] += light.irradiance_of[l][i].s[c] / passes;
      }
      if (options_.passes == 1) group.variance.data[first + i] += light.stated[l][i];
    }
  }
}

void Renderer::ScaleGroups(Frame& frame) const {
  if (frame.groups.empty()) return;
  const auto pixels = static_cast<double>(frame.coverage.plane_size());
  std::vector<double> measured(frame.groups.size(), 0.0);
  for (std::size_t l = 0; l < group_of_.size(); ++l)
    measured[group_of_[l]] += pixels * frame.lights[l].mean_variance;
  std::fill(frame.variance.data.begin(), frame.variance.data.end(), 0.0f);
  for (std::size_t g = 0; g < frame.groups.size(); ++g) {
    core::Image& variance = frame.groups[g].variance;
    const double stated = SumOf(variance);
    for (std::size_t i = 0; i < variance.data.size() && stated > 0; ++i) {
      variance.data[i] = static_cast<float>(variance.data[i] * (measured[g] / stated));
      frame.variance.data[i] += variance.data[i];
    }
  }
  if (const double stated = SumOf(frame.stated_variance); stated > 0)
    frame.variance_scale = SumOf(frame.variance) / stated;
}

}  // namespace luxfield::render
