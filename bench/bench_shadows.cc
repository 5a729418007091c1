#include "luxfield/bench/bench_shadows.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "luxfield/bench/occluder_scene.h"
#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/lamp_tables.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/film/film.h"
#include "luxfield/render/lights/shadow_maps.h"
#include "luxfield/render/scene/device_scene.h"

namespace luxfield::bench {
namespace {

using render::Shadows;

class Bench {
 public:
  explicit Bench(const BenchShadowsOptions& options)
      : options_(options),
        device_(render::Device::Open(options.device, options.threads)),
        field_(render::SyntheticCar2(options.lamp)),
        luminaire_(device_, field_),
        scene_(render::UploadScene(device_, OccluderScene())),
        gbuffer_(device_, options.width, options.height) {
    estimators_["exact"] = render::MakeEstimator("exact", device_);
    estimators_["windowed"] = render::MakeEstimator("windowed", device_);
    for (const auto& name : options.estimators)
      estimators_[name] = render::MakeEstimator(name, device_);
    render::PrimaryVisibility(device_)
        .Render(scene_, OccluderCamera(options.width, options.height), 0, {0.5, 0.5}, gbuffer_)
        .Wait();
    render::TableNeeds needs{.sat = true, .cells = true};
    for (const auto& [name, estimator] : estimators_)
      needs.volume = needs.volume || estimator->traits().needs.volume;
    const render::LampTables tables = render::BuildLampTables(field_, gbuffer_, needs);
    luminaire_.Add(device_, tables.view());
    reference_positions_ = render::ReferencePositions(field_.geometry, tables.sat->reference);
  }

  nlohmann::json Run() {
    const render::Visibility traced{.rays = scene_.rays.get()};
    const int half = options_.reference_samples / 2;
    const core::Image a = Light("windowed", traced, half, 1),
                      b = Light("windowed", traced, half, 2);
    const double reference_core_s = core_s_;
    reference_ = a;
    for (std::size_t k = 0; k < a.data.size(); ++k)
      reference_.data[k] = 0.5f * (a.data[k] + b.data[k]);
    auto own = core::Compare(a, b);
    own.mean_lab /= 2;
    own.rel_rmse /= 2;
    core_s_ = 2 * reference_core_s;
    AddRow("reference", 0, 0, options_.reference_samples, 0, own);

    Report("exact, no shadows", {}, "exact", 0, {});
    for (const auto& name : options_.estimators)
      for (const int samples : options_.samples_per_pixel)
        Report(name + ", traced", traced, name, samples, {});
    for (const auto shadows : {Shadows::kMaps, Shadows::kThesisMaps})
      for (const int size : options_.map_sizes) ReportMaps(shadows, size);
    return rows_;
  }

 private:
  static constexpr std::uint64_t kSeed = 7;  // of the measured pictures; the reference's differ

  core::Image Light(const std::string& name, const render::Visibility& visibility, int samples,
                    std::uint64_t seed) {
    render::Estimator& estimator = *estimators_.at(name);
    render::EstimatorOptions how;
    how.seed = seed;
    how.samples_per_pixel = 1;
    render::Lighting lighting(device_, gbuffer_);
    // Compiles, and touches memory.
    estimator.Light({gbuffer_, visibility}, render::PosedLuminaire{luminaire_}, how, lighting);
    lighting.Clear();
    how.samples_per_pixel = std::max(samples, 1);
    device_.Finish();
    const core::Stopwatch stopwatch;
    estimator.Light({gbuffer_, visibility}, render::PosedLuminaire{luminaire_}, how, lighting);
    device_.Finish();
    core_s_ = stopwatch.CoreSeconds();
    const auto irradiance = lighting.irradiance.Download<cl_float4>();
    core::Image image(options_.width, options_.height, 3);
    for (std::size_t k = 0; k < irradiance.size(); ++k)
      for (std::size_t c = 0; c < 3; ++c)
        image.data[c * irradiance.size() + k] = irradiance[k].s[c];
    return image;
  }

  void ReportMaps(Shadows shadows, int size) {
    const auto lights =
        shadows == Shadows::kMaps ? render::CellCentres(field_) : reference_positions_;
    // Once for the compiler, once for the clock.
    render::ShadowMaps(device_, field_.geometry, lights, {}, *scene_.rays,
                       render::ShadowMaps::kMinSize);
    device_.Finish();
    const core::Stopwatch stopwatch;
    const render::ShadowMaps maps(device_, field_.geometry, lights, {}, *scene_.rays, size);
    device_.Finish();
    const double build_core_s = stopwatch.CoreSeconds();
    for (const auto& name : options_.estimators) {
      const auto& traits = estimators_.at(name)->traits();
      if (!traits.map_shadows) continue;
      const auto samples = traits.noise_free ? std::vector<int>{0} : options_.samples_per_pixel;
      for (const int count : samples)
        Report(fmt::format("{}, {}", name, ShadowsName(shadows)), {.maps = &maps}, name, count,
               {maps.map_count(), size, build_core_s});
    }
  }

  struct MapFigures {
    int count = 0, size = 0;
    double build_core_s = 0;
  };

  void Report(const std::string& variant, const render::Visibility& visibility,
              const std::string& estimator, int samples, const MapFigures& maps) {
    const core::Image picture = Light(estimator, visibility, samples, kSeed);
    AddRow(variant, maps.count, maps.size, samples, maps.build_core_s,
           core::Compare(picture, reference_));
    if (!options_.pictures.empty()) WritePictures(variant, maps.size, samples, picture);
  }

  void AddRow(const std::string& variant, int maps, int map_size, int samples, double build_core_s,
              const core::Difference& difference) {
    rows_.push_back({{"variant", variant},
                     {"maps", maps},
                     {"map_size", map_size},
                     {"spp", samples},
                     {"mean_lab", difference.mean_lab},
                     {"rel_rmse", difference.rel_rmse},
                     {"bias", difference.bias},
                     {"core_s", core_s_},
                     {"build_core_s", build_core_s}});
  }

  // Beside the picture its Lab difference from the reference, 20 shown as white.
  void WritePictures(std::string name, int map_size, int samples, const core::Image& picture) {
    for (char& c : name)
      if (c == ',' || c == ' ') c = '-';
    if (map_size) name += fmt::format("-{}", map_size);
    if (samples) name += fmt::format("-{}spp", samples);
    const std::filesystem::path folder = options_.pictures;
    std::filesystem::create_directories(folder);
    render::WritePng(folder / "reference.png", render::ToneMap(reference_, {}));
    render::WritePng(folder / (name + ".png"), render::ToneMap(picture, {}));
    const core::Image lab = core::LabDifference(picture, reference_);
    core::Image grey(options_.width, options_.height, 3);
    for (int c = 0; c < 3; ++c) std::ranges::copy(lab.plane(0), grey.plane(c).begin());
    render::WritePng(folder / (name + "-lab.png"), render::ToneMap(grey, {.exposure = 0.05}));
  }

  BenchShadowsOptions options_;
  render::Device device_;
  lightfield::LightField field_;
  render::LuminaireOnDevice luminaire_;
  render::DeviceScene scene_;
  render::GBuffer gbuffer_;
  std::map<std::string, std::unique_ptr<render::Estimator>> estimators_;
  std::vector<render::CellLight> reference_positions_;
  core::Image reference_;
  double core_s_ = 0;  // of the last picture
  nlohmann::json rows_ = nlohmann::json::array();
};

}  // namespace

nlohmann::json BenchShadows(const BenchShadowsOptions& options) {
  const auto least = [](const std::vector<int>& values) {
    return values.empty() ? 1 << 30 : std::ranges::min(values);
  };
  if (std::min({options.width, options.height, least(options.samples_per_pixel)}) < 1 ||
      options.reference_samples < 2 || least(options.map_sizes) < render::ShadowMaps::kMinSize)
    throw InputError(
        fmt::format("bench shadows: width, height and samples must be at least 1, the reference's "
                    "samples 2, map sizes {}",
                    render::ShadowMaps::kMinSize));
  return Bench(options).Run();
}

}  // namespace luxfield::bench
