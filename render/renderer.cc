#include "render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>

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

std::filesystem::path TablesOf(const scene::Luminaire& luminaire) {
  if (!luminaire.tables.empty()) return luminaire.tables;
  // X.lf.exr -> X.tab.exr
  auto path = luminaire.light_field;
  path.replace_extension();
  if (path.extension() == ".lf") path.replace_extension();
  path += ".tab.exr";
  return path;
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
  const bool needs_tables =
      traits.needs_tables || (options_.shadows && traits.needs_tables_for_shadows);
  std::map<std::pair<std::string, std::string>, std::shared_ptr<const LuminaireOnDevice>> loaded;
  for (const auto& luminaire : scene.luminaires) {
    const std::string tables_file = needs_tables ? TablesOf(luminaire).string() : std::string();
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
      if (needs_tables) {
        if (!std::filesystem::exists(tables_file))
          throw InputError(
              tables_file,
              fmt::format("luminaire '{}' needs tables{}, and there are none", luminaire.name,
                          traits.needs_tables ? "" : " for its shadows"),
              fmt::format("run 'luxfield preprocess {} -o {}'", luminaire.light_field.string(),
                          tables_file));
        const auto tables = preprocess::ReadTables(tables_file);
        preprocess::CheckTables(tables, tables_file, field.geometry, sha256);
        light_field = std::make_shared<LuminaireOnDevice>(device_, field, &tables);
      } else {
        light_field = std::make_shared<LuminaireOnDevice>(device_, field, nullptr);
      }
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
    if (hits > 0) frame.variance.data[i] /= hits * hits;
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

  const std::size_t pixels = gbuffer.pixel_count();
  std::vector<float> irradiance(4 * pixels), variance(pixels), samples(pixels);
  Light(gbuffer, first_row, pixel_sample, irradiance, variance, samples, frame);

  const auto position = gbuffer.position.Download<cl_float4>();
  const auto normal = gbuffer.normal.Download<cl_float4>();
  const auto albedo = gbuffer.albedo.Download<cl_float4>();
  const std::size_t plane = frame.coverage.plane_size();
  const std::size_t first = static_cast<std::size_t>(first_row) * frame.width;
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::size_t out = first + i;
    frame.coverage.data[out] += position[i].s[3];
    frame.variance.data[out] += variance[i];
    frame.samples.data[out] += samples[i];
    for (int c = 0; c < 3; ++c) {
      const float e = irradiance[4 * i + c];
      frame.irradiance.data[c * plane + out] += e;
      frame.radiance.data[c * plane + out] += albedo[i].s[c] * std::numbers::inv_pi_v<float> * e;
      if (pixel_sample > 0) continue;
      frame.normal.data[c * plane + out] = normal[i].s[c];
      frame.position.data[c * plane + out] = position[i].s[c];
    }
  }
}

void Renderer::Light(const GBuffer& gbuffer, int first_row, int pixel_sample,
                     std::vector<float>& irradiance, std::vector<float>& variance,
                     std::vector<float>& samples, Frame& frame) {
  const std::size_t pixels = gbuffer.pixel_count();
  Buffer irradiance_buffer(device_, pixels * sizeof(cl_float4));
  Buffer variance_buffer(device_, pixels * sizeof(cl_float));
  Buffer samples_buffer(device_, pixels * sizeof(cl_uint));
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
    irradiance_buffer.FillZero();
    variance_buffer.FillZero();
    samples_buffer.FillZero();
    device_.Finish();

    const Stopwatch stopwatch;
    estimator_->Light(gbuffer, options_.shadows ? &scene_.bvh : nullptr, *luminaire.light_field,
                      luminaire.world_from_luminaire, options, irradiance_buffer, variance_buffer,
                      samples_buffer);
    device_.Finish();
    frame.times.lighting_s += stopwatch.Seconds();

    const auto scale = static_cast<float>(luminaire.scale);
    const auto e = irradiance_buffer.Download<float>();
    const auto v = variance_buffer.Download<float>();
    const auto n = samples_buffer.Download<cl_uint>();
    for (std::size_t i = 0; i < 4 * pixels; ++i) irradiance[i] += scale * e[i];
    for (std::size_t i = 0; i < pixels; ++i) {
      variance[i] += scale * scale * v[i];
      samples[i] += static_cast<float>(n[i]);
    }
  }
}

}  // namespace luxfield::render
