#include "render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>

#include "core/colour.h"
#include "core/error.h"
#include "core/file.h"
#include "core/progress.h"
#include "preprocess/table_io.h"

namespace luxfield::render {
namespace {

// Bands bound the device memory, and the time until Ctrl-C is heard.
constexpr int kBandPixels = 1 << 16;

class Stopwatch {
 public:
  double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Point k of n in the pixel: Hammersley, in the middle of its strata; the centre if n = 1.
lightfield::Vec2 PixelSample(int k, int n) {
  double inverse = 0, digit = 0.5;
  for (int i = k; i; i >>= 1, digit /= 2) inverse += digit * (i & 1);
  return {(k + 0.5) / n, inverse + std::exp2(-std::ceil(std::log2(n)) - 1)};
}

// Part k of `total` split into n nearly equal parts, at least 1.
int Share(int total, int k, int n) { return std::max(1, total / n + (k < total % n)); }

// Empty: none given, and none beside the light field.
std::filesystem::path TablesOf(const scene::Luminaire& luminaire) {
  if (!luminaire.tables.empty()) return luminaire.tables;
  // X.lf.exr -> X.tab.exr
  auto path = luminaire.light_field;
  path.replace_extension();
  if (path.extension() == ".lf") path.replace_extension();
  path += ".tab.exr";
  return std::filesystem::exists(path) ? path : std::filesystem::path();
}

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
  check("samples per pixel", samples_per_pixel, 1, 1 << 24);
  check("pixel samples for antialiasing", antialias, 1, 1024);
  check("samples per image", static_cast<double>(max_samples_per_image), 0, 1e9);
}

std::string IrradianceUnitName(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kLumen:
      return "lx";
    case lightfield::FluxUnit::kWatt:
      return "W/m2";
    case lightfield::FluxUnit::kRelative:
      break;
  }
  return "rel.";
}

std::string RadianceUnitName(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kLumen:
      return "cd/m2";
    case lightfield::FluxUnit::kWatt:
      return "W/(sr m2)";
    case lightfield::FluxUnit::kRelative:
      break;
  }
  return "rel.";
}

Renderer::Renderer(const Device& device, const scene::Scene& scene, const RenderOptions& options)
    : device_(device),
      options_((options.Validate(), options)),
      camera_(scene.camera),
      estimator_(MakeEstimator(options.estimator, device)),
      primary_(device),
      scene_(UploadScene(device, scene.geometry)) {
  provenance_ = {{"estimator", options.estimator},
                 {"samples_per_pixel", std::to_string(options.samples_per_pixel)},
                 {"antialias", std::to_string(options.antialias)},
                 {"seed", std::to_string(options.seed)},
                 {"shadows", options.shadows ? "true" : "false"},
                 {"max_samples_per_image", fmt::format("{}", options.max_samples_per_image)},
                 {"device", device.info().name}};
  if (!scene.file.empty()) provenance_["scene_sha256"] = core::Sha256OfFile(scene.file);
  LoadLuminaires(scene);
}

void Renderer::LoadLuminaires(const scene::Scene& scene) {
  const EstimatorTraits traits = estimator_->traits();
  const bool needs_sat = traits.needs.sat || (options_.shadows && traits.needs_for_shadows.sat);
  std::map<std::pair<std::string, std::string>, std::shared_ptr<const LuminaireOnDevice>> loaded;
  for (const auto& luminaire : scene.luminaires) {
    const std::string tables_file = needs_sat ? TablesOf(luminaire).string() : std::string();
    auto& light_field = loaded[{luminaire.light_field.string(), tables_file}];
    if (!light_field) {
      const auto field = lightfield::ReadLightField(luminaire.light_field);
      const std::string sha256 = core::Sha256OfFile(luminaire.light_field);
      if (!luminaires_.empty() && field.geometry.unit != unit_)
        throw InputError(luminaire.light_field.string(),
                         fmt::format("its unit is {}, that of the luminaires before it {}",
                                     FluxUnitName(field.geometry.unit), FluxUnitName(unit_)),
                         "light a scene with luminaires of one unit");
      unit_ = field.geometry.unit;
      preprocess::Tables tables;
      if (!tables_file.empty()) {
        tables = preprocess::ReadTables(tables_file);
        preprocess::CheckTables(tables, tables_file, field.geometry, sha256);
      } else if (needs_sat) {
        tables = preprocess::BuildTables(field, luminaire.light_field.string(), sha256);
      }
      light_field = std::make_shared<LuminaireOnDevice>(
          device_, field, LuminaireTables{.sat = needs_sat ? &tables : nullptr});
      provenance_[fmt::format("{} sha256", luminaire.name)] = sha256;
    }
    luminaires_.push_back(
        {luminaire.name, light_field, luminaire.world_from_luminaire, luminaire.scale});
  }
}

Frame Renderer::Render() {
  Frame frame;
  frame.width = camera_.width;
  frame.height = camera_.height;
  frame.unit = unit_;
  frame.provenance = provenance_;
  for (core::Image* image : {&frame.radiance, &frame.irradiance, &frame.normal, &frame.position})
    *image = core::Image(frame.width, frame.height, 3);
  for (core::Image* image : {&frame.coverage, &frame.variance, &frame.samples})
    *image = core::Image(frame.width, frame.height, 1);

  const int band_rows = std::clamp(kBandPixels / frame.width, 1, frame.height);
  const int bands = (frame.height + band_rows - 1) / band_rows;
  core::Progress progress("render", static_cast<std::uint64_t>(bands) * options_.antialias);
  for (int band = 0; band < bands; ++band) {
    const int first_row = band * band_rows;
    GBuffer gbuffer(device_, frame.width, std::min(band_rows, frame.height - first_row));
    for (int k = 0; k < options_.antialias; ++k) {
      core::ThrowIfInterrupted();
      RenderBand(first_row, gbuffer, k, frame);
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
    frame.coverage.data[i] /= samples;
  }
  return frame;
}

void Renderer::RenderBand(int first_row, GBuffer& gbuffer, int pixel_sample, Frame& frame) {
  const Stopwatch stopwatch;
  primary_
      .Render(scene_, camera_, first_row, PixelSample(pixel_sample, options_.antialias), gbuffer)
      .Wait();
  frame.times.gbuffer_s += stopwatch.Seconds();

  const auto position = gbuffer.position.Download<cl_float4>();
  const auto normal = gbuffer.normal.Download<cl_float4>();
  const std::size_t plane = frame.coverage.plane_size();
  const std::size_t first = static_cast<std::size_t>(first_row) * frame.width;
  for (std::size_t i = 0; i < gbuffer.pixel_count(); ++i) {
    frame.coverage.data[first + i] += position[i].s[3];
    if (pixel_sample > 0) continue;
    for (int c = 0; c < 3; ++c) {
      frame.normal.data[c * plane + first + i] = normal[i].s[c];
      frame.position.data[c * plane + first + i] = position[i].s[c];
    }
  }

  Lighting lighting(device_, gbuffer);
  const int lights = static_cast<int>(luminaires_.size());
  for (int l = 0; l < lights; ++l) {
    const LitBy& luminaire = luminaires_[l];
    EstimatorOptions options;
    options.samples_per_pixel =
        Share(Share(options_.samples_per_pixel, pixel_sample, options_.antialias), l, lights);
    options.seed = options_.seed;
    options.stream = static_cast<std::uint32_t>(pixel_sample * lights + l);
    options.max_samples_per_image = options_.max_samples_per_image;
    options.first_pixel =
        static_cast<std::uint32_t>(first_row) * static_cast<std::uint32_t>(gbuffer.width);
    lighting.Clear();
    device_.Finish();

    const Stopwatch light_stopwatch;
    estimator_->Light(gbuffer, {.bvh = options_.shadows ? &scene_.bvh : nullptr},
                      *luminaire.light_field, luminaire.world_from_luminaire, options, lighting);
    device_.Finish();
    frame.times.lighting_s += light_stopwatch.Seconds();
    AddPixels(gbuffer, lighting, static_cast<float>(luminaire.scale), first_row, frame);
  }
}

// Adds one luminaire's light on one band to the frame's sums.
void Renderer::AddPixels(const GBuffer& gbuffer, const Lighting& lighting, float scale,
                         int first_row, Frame& frame) const {
  const auto irradiance = lighting.irradiance.Download<cl_float4>();
  const auto variance = lighting.variance.Download<float>();
  const auto samples = lighting.samples.Download<cl_uint>();
  const auto albedo = gbuffer.albedo.Download<cl_float4>();
  std::vector<cl_float4> reflected;
  if (gbuffer.glossy()) reflected = lighting.reflected.Download<cl_float4>();
  const std::size_t plane = frame.coverage.plane_size();
  const std::size_t first = static_cast<std::size_t>(first_row) * frame.width;
  for (std::size_t i = 0; i < gbuffer.pixel_count(); ++i) {
    const std::size_t out = first + i;
    const auto& rho = albedo[i].s;
    for (int c = 0; c < 3; ++c) {
      const float e = irradiance[i].s[c];
      frame.irradiance.data[c * plane + out] += scale * e;
      frame.radiance.data[c * plane + out] +=
          scale *
          (gbuffer.glossy() ? reflected[i].s[c] : rho[c] * std::numbers::inv_pi_v<float> * e);
    }
    // Of the irradiance, where surfaces are Lambertian: seen through the luminance of the albedo.
    const float shown = gbuffer.glossy()
                            ? 1.0f
                            : static_cast<float>(core::Luminance({rho[0], rho[1], rho[2]})) *
                                  std::numbers::inv_pi_v<float>;
    frame.variance.data[out] += scale * scale * shown * shown * variance[i];
    frame.samples.data[out] += static_cast<float>(samples[i]);
  }
}

}  // namespace luxfield::render
