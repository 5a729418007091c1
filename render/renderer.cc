#include "luxfield/render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::render {
namespace {

constexpr int kMaxSamples = 1 << 24;
// Of an estimator's error, what luminaires may bring that are left out.
constexpr double kShareLeftOut = 0.1;
// Of a part's points: lit together with the others, which costs less than to gather them.
constexpr double kNearlyAll = 0.8;
// Luminaires that are looked up in their volumes sooner than the tree tells which of them matter.
constexpr std::size_t kFewInVolumes = 16;

// Point k of n in the pixel: Hammersley, in the middle of its strata; the centre if n = 1.
lightfield::Vec2 PixelSample(int k, int n) {
  double inverse = 0, digit = 0.5;
  for (int i = k; i; i >>= 1, digit /= 2) inverse += digit * (i & 1);
  return {(k + 0.5) / n, inverse + std::exp2(-std::ceil(std::log2(n)) - 1)};
}

// Part k of `total` split into n nearly equal parts, at least 1.
int Share(int total, int k, int n) { return std::max(1, total / n + (k < total % n)); }

EstimatorTraits TraitsOf(const std::string& estimator) {
  for (const auto& traits : EstimatorList())
    if (traits.name == estimator) return traits;
  std::string names;
  for (const auto& traits : EstimatorList()) names += (names.empty() ? "" : ", ") + traits.name;
  throw InputError(fmt::format("there is no estimator '{}'; use one of {}", estimator, names));
}

}  // namespace

int RenderOptions::ShadowMapSize() const {
  if (shadow_map_size != 0) return shadow_map_size;
  return shadows == Shadows::kSoftMaps ? 384 : 192;
}

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
  check("shadow map size", ShadowMapSize(), ShadowMaps::kMinSize, ShadowMaps::kMaxSize);
  check("approximation error", approximation_error, 1e-5, 1);
  check("samples per image", static_cast<double>(max_samples_per_image), 0, 1e9);
  for (const float density : sample_density.data)
    if (density != 0) check("sample density", density, 1e-3, 1e3);
  for (const int samples : light_samples) check("samples of a light", samples, 0, kMaxSamples);
}

Renderer::Renderer(LitScene& scene, const RenderOptions& options)
    : scene_(scene),
      options_((options.Validate(), options)),
      camera_(scene.camera()),
      estimator_(scene.EstimatorNamed(options.estimator)),
      lights_(scene.Lights()),
      primary_(scene.device()),
      film_kernels_(scene.device()),
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
    if (options.background) background_.emplace(scene.device());
  }
  if (options.shadows == Shadows::kThesisMaps) scene.Require({.sat = true});  // reference positions
  if (options.shadows == Shadows::kMaps || options.shadows == Shadows::kThesisMaps)
    for (const auto& luminaire : scene.luminaires()) {
      const LoadedLightField& field = *luminaire.light_field;
      shadow_maps_.emplace_back(
          scene.device(), field.geometry(),
          options.shadows == Shadows::kMaps
              ? CellCentres(field.geometry().grid, field.on_device.LitImages())
              : ReferencePositions(field.geometry(), field.reference),
          luminaire.world_from_luminaire, *scene.geometry().rays, options.ShadowMapSize());
    }
  if (options.shadows == Shadows::kSoftMaps) scene.RequireSoftMaps(options.ShadowMapSize());
  SortLights();
  RequireSamples();
}

bool Renderer::MayBeDrawn(std::size_t light) {
  const LightSource& source = lights_[light].source;
  if (std::holds_alternative<std::reference_wrapper<const EnvironmentLight>>(source)) return false;
  return scene_.EstimatorOf(source, options_.estimator, options_.knobs.strategies.everywhere)
      .traits()
      .takes_tasks;
}

BoundedLight Renderer::Bound(std::size_t light, std::vector<BoundedTable>& tables) const {
  const auto& [source, scale] = lights_[light];
  if (const auto* area = std::get_if<std::reference_wrapper<const AreaLightSource>>(&source))
    return BoundAreaLight(*area);
  using ClassicalLight = std::reference_wrapper<const ClassicalLightSource>;
  if (const auto* classical = std::get_if<ClassicalLight>(&source))
    return BoundClassicalLight(*classical, std::ranges::max(scale));
  const PlacedLuminaire& luminaire = scene_.luminaires()[light];
  const preprocess::IntensityTable& table = *luminaire.light_field->intensity;
  const auto known = std::find_if(tables.begin(), tables.end(),
                                  [&](const BoundedTable& one) { return one.table == &table; });
  const auto number = static_cast<std::size_t>(known - tables.begin());
  if (known == tables.end()) tables.emplace_back(table, number);
  return BoundLuminaire(luminaire.light_field->geometry(), tables[number],
                        luminaire.world_from_luminaire, std::ranges::max(scale));
}

DrawnLight Renderer::MakeDrawnLight(std::size_t light, std::vector<BoundedTable>& tables) {
  const auto& [source, scale] = lights_[light];
  return {.source = source,
          .scale = scale,
          .number = light,
          .group = group_of_.empty() ? 0 : group_of_[light],
          .estimator =
              &scene_.EstimatorOf(source, options_.estimator, options_.knobs.strategies.everywhere),
          .visibility = VisibilityOf(light),
          .bounds = Bound(light, tables)};
}

void Renderer::SortLights() {
  const bool everywhere = options_.knobs.strategies.everywhere;
  std::vector<std::size_t> drawn;
  for (std::size_t l = 0; l < lights_.size(); ++l)
    if (options_.light_samples.empty() && MayBeDrawn(l)) drawn.push_back(l);
  if (drawn.size() < 2) drawn.clear();
  stratum_of_.assign(lights_.size(), -1);
  for (std::size_t l = 0; l < lights_.size(); ++l) {
    if (std::binary_search(drawn.begin(), drawn.end(), l)) continue;
    alone_.push_back(static_cast<int>(l));
    const EstimatorTraits& traits =
        scene_.EstimatorOf(lights_[l].source, options_.estimator, everywhere).traits();
    if (!traits.noise_free || options_.shadows == Shadows::kTraced) stratum_of_[l] = strata_++;
  }
  std::vector<BoundedTable> tables;
  const bool looks_up = estimator_.traits().needs.volume && options_.shadows == Shadows::kNone;
  if (const std::size_t luminaires = scene_.luminaires().size();
      estimator_.traits().noise_free && luminaires > (looks_up ? kFewInVolumes : 1) &&
      options_.shadows != Shadows::kSoftMaps && !everywhere) {
    scene_.RequireIntensities();
    std::vector<BoundedLight> bounds;
    for (std::size_t l = 0; l < luminaires; ++l) bounds.push_back(Bound(l, tables));
    significant_.emplace(scene_.device(), bounds, tables);
  }
  if (drawn.empty()) return;
  ++strata_;
  scene_.RequireIntensities();
  std::vector<DrawnLight> lights;
  lights.reserve(drawn.size());
  tables.clear();
  for (const std::size_t l : drawn) lights.push_back(MakeDrawnLight(l, tables));
  many_.emplace(film_kernels_, std::move(lights), tables);
}

void Renderer::RequireSamples() const {
  if (!options_.light_samples.empty() || estimator_.traits().noise_free) return;
  const int least = strata_ * options_.antialias * options_.passes;
  if (options_.samples_per_pixel < least)
    throw InputError(fmt::format(
        "samples per pixel = {} must be at least {}: one for {} pixel samples, {} passes and {}; "
        "take more samples or fewer of these",
        options_.samples_per_pixel, least, options_.antialias, options_.passes,
        strata_ == 1 ? "the lights" : "the environment apart from the other lights"));
}

double Renderer::LitShare() const {
  const auto& density = options_.sample_density.data;
  if (density.empty()) return 1;
  return static_cast<double>(density.size() - std::count(density.begin(), density.end(), 0.0f)) /
         static_cast<double>(density.size());
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
  if (options_.shadows == Shadows::kSoftMaps && light < scene_.luminaires().size())
    return {.patches = &scene_.soft_maps(light)};
  return {.rays = options_.shadows == Shadows::kNone ? nullptr : scene_.geometry().rays.get()};
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
      {"shadow_map_size", std::to_string(options_.ShadowMapSize())},
      {"sample_density", options_.sample_density.data.empty() ? "even" : "uneven"},
      {"max_samples_per_image", fmt::format("{}", options_.max_samples_per_image)},
      {"approximation_error", fmt::format("{}", options_.approximation_error)},
      {"knobs", options_.knobs.Text()},
      {"device", scene_.device().info().name}});
  if (options_.matt) frame.provenance["gloss"] = "left out";
  if (scene_.has_strategies() || options_.knobs.strategies.everywhere)
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
    relit_.Start(
        static_cast<std::size_t>(LitShare() * frame.width * frame.height * options_.antialias),
        SharedSets());
  scene_.device().TakeKernelTimes();  // what ran before is not this frame's
  const int band_rows = std::clamp(kBandPixels / frame.width, 1, frame.height);
  const int bands = (frame.height + band_rows - 1) / band_rows;
  core::Progress progress("render", static_cast<std::uint64_t>(bands) * options_.antialias);
  for (int band = 0; band < bands; ++band)
    RenderBand(band * band_rows, std::min(band_rows, frame.height - band * band_rows), progress,
               frame);
  for (LightTotals& light : frame.lights) {
    const double count = static_cast<double>(frame.coverage.plane_size());
    light.mean_luminance /= count;
    light.mean_variance /= count;
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
                                                          std::span<const float> hits,
                                                          int first_row) {
  const core::Image& density = options_.sample_density;
  std::map<float, std::vector<std::size_t>> pixels;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i] == 0) continue;
    const int pixel = static_cast<int>(i), row = first_row + pixel / camera_.width,
              column = pixel % camera_.width;
    const float of_pixel = density.at(0, row * density.height / camera_.height,
                                      column * density.width / camera_.width);
    if (of_pixel > 0) pixels[of_pixel].push_back(i);
  }
  auto first_pixel =
      static_cast<std::uint32_t>(first_row) * static_cast<std::uint32_t>(camera_.width);
  std::vector<EquallySampled> parts;
  for (auto& [value, of_part] : pixels) {
    EquallySampled part = PartOf(gbuffer, std::move(of_part));
    part.list =
        Buffer::From(scene_.device(), std::vector<cl_int>(part.pixels.begin(), part.pixels.end()));
    part.density = value;
    part.seed = options_.seed;
    part.first_pixel = first_pixel;
    first_pixel += static_cast<std::uint32_t>(part.gbuffer.width);
    parts.push_back(std::move(part));
  }
  return parts;
}

Renderer::EquallySampled Renderer::PartOf(const GBuffer& gbuffer, std::vector<std::size_t> pixels) {
  EquallySampled part;
  part.gbuffer = GatherPoints(film_kernels_, gbuffer, pixels);
  part.lighting = Lighting(scene_.device(), part.gbuffer);
  part.pixels = std::move(pixels);
  return part;
}

void Renderer::RenderBand(int first_row, int rows, core::Progress& progress, Frame& frame) {
  const Device& device = scene_.device();
  EquallySampled band;
  band.seed = options_.seed;
  band.first_pixel =
      static_cast<std::uint32_t>(first_row) * static_cast<std::uint32_t>(frame.width);
  band.gbuffer = GBuffer(device, frame.width, rows, scene_.geometry().glossy && !options_.matt,
                         scene_.geometry().emissive);
  band.lighting = Lighting(device, band.gbuffer);
  BandFilm film(film_kernels_, {.pixels = band.gbuffer.pixel_count(),
                                .lights_apart = frame.lights.size(),
                                .groups = frame.groups.size(),
                                .passes = options_.passes});
  for (int k = 0; k < options_.antialias; ++k) {
    LightPixelSample(band, first_row, k, film, frame);
    progress.Advance();
  }
  Develop(film, first_row, frame);
}

void Renderer::LightPixelSample(EquallySampled& band, int first_row, int pixel_sample,
                                BandFilm& film, Frame& frame) {
  GBuffer& gbuffer = band.gbuffer;
  const lightfield::Vec2 sample = PixelSample(pixel_sample, options_.antialias);
  const core::Stopwatch stopwatch;
  primary_.Render(scene_.geometry(), camera_, first_row, sample, gbuffer).Wait();
  frame.times.gbuffer_s += stopwatch.WallSeconds();
  const bool groups = !frame.groups.empty();
  if (const PlacedEnvironment* environment = scene_.environment(); environment && background_)
    film.AddRadiance(background_->Render(environment->light, camera_, first_row, sample, gbuffer),
                     environment->scale,
                     groups ? static_cast<int>(group_of_.back()) : -1);  // the last light's
  if (gbuffer.emission)
    film.AddRadiance(gbuffer.emission, 1, groups ? static_cast<int>(frame.groups.size()) - 1 : -1);
  film.AddHits(gbuffer);
  if (pixel_sample == 0) ShowSurfaces(gbuffer, first_row, frame);

  const bool relight = options_.relight && options_.passes == 1;
  std::vector<float> hits;  // on the host where pixels are chosen by it
  if (relight || !options_.sample_density.data.empty()) hits = film.Hits();
  std::vector<EquallySampled> parts;
  if (!options_.sample_density.data.empty()) parts = BySamples(gbuffer, hits, first_row);
  const std::span<EquallySampled> lit =
      options_.sample_density.data.empty() ? std::span(&band, 1) : std::span(parts);
  PassSums& sums = film.pass_sums();
  for (int pass = 0; pass < options_.passes; ++pass) {
    core::ThrowIfInterrupted();
    sums.Clear();
    for (EquallySampled& part : lit)
      LightPart(part, {.pixel_sample = pixel_sample, .number = pass, .film = &film}, sums,
                frame.times);
    if (relight) Relight(lit, gbuffer, hits, pixel_sample, sums, frame);
    film.AddPass(pass);
  }
  film.AddVariances();
}

void Renderer::ShowSurfaces(const GBuffer& gbuffer, int first_row, Frame& frame) const {
  const auto show = [&](const Buffer& buffer, core::Image& image) {
    const auto values = buffer.Download<cl_float4>();
    const std::size_t first = static_cast<std::size_t>(first_row) * image.width;
    for (int c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < values.size(); ++i) image.plane(c)[first + i] = values[i].s[c];
  };
  show(gbuffer.normal, frame.normal);
  show(gbuffer.position, frame.position);
}

void Renderer::Develop(const BandFilm& film, int first_row, Frame& frame) const {
  const BandFilm::Sums sums = film.Download();
  const auto samples = static_cast<float>(options_.antialias);
  const std::size_t count = sums.coverage.size(),
                    first = static_cast<std::size_t>(first_row) * frame.width;
  // Sums over pixel samples become means, of the irradiance over those that hit something.
  const auto develop = [&](const std::vector<cl_float4>& radiance,
                           const std::vector<cl_float4>& irradiance, core::Image& shown,
                           core::Image& received) {
    for (int c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < count; ++i) {
        const float hits = sums.coverage[i];
        shown.plane(c)[first + i] = radiance[i].s[c] / samples;
        received.plane(c)[first + i] = hits > 0 ? irradiance[i].s[c] / hits : irradiance[i].s[c];
      }
  };
  const auto variance = [&](const std::vector<float>& values, core::Image& image) {
    for (std::size_t i = 0; i < count; ++i)
      image.data[first + i] += values[i] / (samples * samples);
  };
  develop(sums.radiance, sums.irradiance, frame.radiance, frame.irradiance);
  variance(sums.variance[0], frame.variance);
  variance(sums.stated, frame.stated_variance);
  for (std::size_t i = 0; i < count; ++i) {
    frame.coverage.data[first + i] = sums.coverage[i] / samples;
    frame.samples.data[first + i] = sums.samples[i];
  }
  for (std::size_t g = 0; g < frame.groups.size(); ++g)
    develop(sums.group_radiance[g], sums.group_irradiance[g], frame.groups[g].radiance,
            frame.groups[g].irradiance);
  const bool relit = options_.relight && options_.passes == 1;
  for (std::size_t l = 0; l < frame.lights.size(); ++l) {
    for (std::size_t i = 0; i < count; ++i) {
      frame.lights[l].mean_luminance +=
          double{sums.luminance[1 + l][i]} / (double{samples} * options_.passes);
      if (!relit)
        frame.lights[l].mean_variance += double{sums.variance[1 + l][i]} / (samples * samples);
    }
    if (!frame.groups.empty()) variance(sums.variance[1 + l], frame.groups[group_of_[l]].variance);
  }
}

int Renderer::SamplesOf(int stratum, double density, int pixel_sample, int pass) const {
  const double samples = density * options_.samples_per_pixel;
  const int all = static_cast<int>(std::lround(std::min(samples, double{kMaxSamples})));
  return Share(Share(Share(all, pixel_sample, options_.antialias), pass, options_.passes), stratum,
               strata_);
}

int Renderer::SamplesOfLight(int light, double density, int pixel_sample, int pass) const {
  if (options_.light_samples.empty())
    return stratum_of_[light] < 0 ? 1 : SamplesOf(stratum_of_[light], density, pixel_sample, pass);
  const double samples = density * options_.light_samples[light];
  const int all = static_cast<int>(std::lround(std::min(samples, double{kMaxSamples})));
  return Share(Share(all, pixel_sample, options_.antialias), pass, options_.passes);
}

EstimatorOptions Renderer::OptionsFor(const EquallySampled& part, int pixel_sample, int pass,
                                      int samples) const {
  EstimatorOptions options;
  options.samples_per_pixel = samples;
  options.seed = part.seed;
  options.stream = static_cast<std::uint32_t>(
      ((options_.first_pass + pass) * options_.antialias + pixel_sample) * LightCount());
  options.max_samples_per_image = options_.max_samples_per_image;
  options.max_error = static_cast<float>(options_.approximation_error);
  options.knobs = options_.knobs;
  options.first_pixel = part.first_pixel;
  return options;
}

void Renderer::LightPart(EquallySampled& part, const Pass& pass, PassSums& sums,
                         RenderTimes& times) {
  LightAlone(part, pass, sums, times);
  if (!many_) return;
  const auto samples_of = [&](double density) {
    return SamplesOf(strata_ - 1, density, pass.pixel_sample, pass.number);
  };
  const int samples = std::max(samples_of(part.density), std::min(2, samples_of(1)));
  many_->Light({part.gbuffer, part.lighting, part.list},
               OptionsFor(part, pass.pixel_sample, pass.number, samples), sums,
               pass.film ? pass.film->groups() : std::span<FilmLight>(), options_.passes, times);
}

void Renderer::LightAlone(EquallySampled& part, const Pass& pass, PassSums& sums,
                          RenderTimes& times) {
  std::vector<std::vector<std::size_t>> points_of;  // of luminaires, where they are not all
  if (significant_) {
    const core::Stopwatch stopwatch;
    const EstimatorTraits& traits = estimator_.traits();
    const double error = traits.error_is_asked ? options_.approximation_error : traits.rel_error;
    // Lobes may show what hardly adds to the irradiance.
    points_of =
        significant_->PointsOf(part.gbuffer, part.gbuffer.glossy() ? 0 : kShareLeftOut * error);
    times.lighting_s += stopwatch.WallSeconds();
    times.lighting_core_s += stopwatch.CoreSeconds();
  }
  const auto all = static_cast<double>(part.gbuffer.pixel_count());
  for (const int light : alone_) {
    const auto number = static_cast<std::size_t>(light);
    if (number >= points_of.size() ||
        static_cast<double>(points_of[number].size()) > kNearlyAll * all) {
      AddLight(part, pass, light, sums, times);
      continue;
    }
    if (points_of[number].empty()) continue;
    std::vector<cl_int> pixels;
    for (const std::size_t k : points_of[number])
      pixels.push_back(static_cast<cl_int>(part.list ? part.pixels[k] : k));
    EquallySampled some = PartOf(part.gbuffer, std::move(points_of[number]));
    some.list = Buffer::From(scene_.device(), pixels);
    some.density = part.density;
    some.seed = part.seed;
    some.first_pixel = part.first_pixel;
    AddLight(some, pass, light, sums, times);
  }
}

void Renderer::AddLight(EquallySampled& part, const Pass& pass, int light, PassSums& sums,
                        RenderTimes& times) {
  if (!options_.light_samples.empty() && options_.light_samples[light] == 0) return;
  // No density takes the second sample away, without which there is no variance to state.
  EstimatorOptions options =
      OptionsFor(part, pass.pixel_sample, pass.number,
                 std::max(SamplesOfLight(light, part.density, pass.pixel_sample, pass.number),
                          std::min(2, SamplesOfLight(light, 1, pass.pixel_sample, pass.number))));
  options.stream += static_cast<std::uint32_t>(light);
  part.lighting.Clear();
  scene_.device().Finish();

  const auto& [source, scale] = lights_[light];
  Estimator& estimator =
      scene_.EstimatorOf(source, options_.estimator, options_.knobs.strategies.everywhere);
  const core::Stopwatch stopwatch;
  estimator.Light({part.gbuffer, VisibilityOf(light)}, source, options, part.lighting);
  scene_.device().Finish();
  const double wall_s = stopwatch.WallSeconds();
  times.lighting_s += wall_s;
  if (!times.light_s.empty()) times.light_s[light] += wall_s;
  times.lighting_core_s += stopwatch.CoreSeconds();

  FilmLight* group = pass.film && !group_of_.empty() ? pass.film->group(group_of_[light]) : nullptr;
  sums.Add({part.gbuffer, part.lighting, part.list}, scale, light, group, options_.passes);
}

}  // namespace luxfield::render
