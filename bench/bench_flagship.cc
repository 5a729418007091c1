#include "luxfield/bench/bench_flagship.h"

#include <algorithm>
#include <memory>

#include "luxfield/bench/occluder_scene.h"
#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/car2.h"
#include "luxfield/render/accuracy/lamp_tables.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/lights/shadow_maps.h"
#include "luxfield/render/scene/device_scene.h"

namespace luxfield::bench {
namespace {

constexpr std::uint64_t kSeed = 3;

class Bench {
 public:
  explicit Bench(const BenchFlagshipOptions& options)
      : device_(render::Device::Open(options.device, options.threads)),
        field_(render::SyntheticCar2()),
        luminaire_(device_, field_),
        scene_(render::UploadScene(device_, OccluderScene())),
        primary_(device_),
        fast_(render::MakeEstimator("exact", device_)),
        traced_(render::MakeEstimator("windowed", device_)) {
    const render::LampTables tables =
        render::BuildLampTables(field_, render::GBuffer(device_, 1, 1), {.sat = true});
    luminaire_.Add(device_, tables.view());
    for (const double x : {-0.6, 0.6}) {
      scene::Pose pose;
      pose.translation = {x, 0, 0};
      poses_.push_back(pose);
    }
    const core::Stopwatch stopwatch;
    for (const scene::Pose& pose : poses_)
      maps_.push_back(std::make_unique<render::ShadowMaps>(device_, field_.geometry,
                                                           render::CellCentres(field_), pose,
                                                           scene_.bvh, options.map_size));
    device_.Finish();
    maps_core_s_ = stopwatch.CoreSeconds();
  }

  double maps_core_s() const { return maps_core_s_; }

  struct Picture {
    explicit Picture(const render::Device& device, int width, int height)
        : gbuffer(device, width, height), lighting(device, gbuffer) {}
    render::GBuffer gbuffer;
    render::Lighting lighting;
  };

  // samples 0: a frame of the fast path; else the traced truth.
  void Light(int samples, Picture& picture) {
    const render::GBuffer& gbuffer = picture.gbuffer;
    primary_.Render(scene_, OccluderCamera(gbuffer.width, gbuffer.height), 0, {0.5, 0.5},
                    picture.gbuffer);
    picture.lighting.Clear();
    render::EstimatorOptions how;
    how.seed = kSeed;
    how.samples_per_pixel = std::max(1, samples);
    for (std::size_t lamp = 0; lamp < poses_.size(); ++lamp) {
      how.stream = static_cast<std::uint32_t>(lamp);
      const render::Visibility visibility = samples > 0
                                                ? render::Visibility{.bvh = &scene_.bvh}
                                                : render::Visibility{.maps = maps_[lamp].get()};
      (samples > 0 ? *traced_ : *fast_)
          .Light({gbuffer, visibility}, render::PosedLuminaire{luminaire_, poses_[lamp]}, how,
                 picture.lighting);
    }
    device_.Finish();
  }

  core::Image Irradiance(int width, int height, int samples) {
    Picture picture(device_, width, height);
    Light(samples, picture);
    const auto irradiance = picture.lighting.irradiance.Download<cl_float4>();
    core::Image image(width, height, 3);
    for (std::size_t k = 0; k < irradiance.size(); ++k)
      for (std::size_t c = 0; c < 3; ++c)
        image.data[c * irradiance.size() + k] = irradiance[k].s[c];
    return image;
  }

  const render::Device& device() const { return device_; }

 private:
  render::Device device_;
  lightfield::LightField field_;
  render::LuminaireOnDevice luminaire_;
  render::DeviceScene scene_;
  render::PrimaryVisibility primary_;
  std::unique_ptr<render::Estimator> fast_, traced_;
  std::vector<scene::Pose> poses_;
  std::vector<std::unique_ptr<render::ShadowMaps>> maps_;
  double maps_core_s_ = 0;
};

}  // namespace

Flagship BenchFlagship(const BenchFlagshipOptions& options) {
  if (std::min({options.width, options.height, options.lab_width, options.lab_height,
                options.truth_samples, options.runs}) < 1)
    throw InputError("bench flagship: sizes, samples and runs must be at least 1");
  Bench bench(options);
  Flagship flagship;
  flagship.maps_core_s = bench.maps_core_s();
  // Compiles, too.
  const core::Image fast = bench.Irradiance(options.lab_width, options.lab_height, 0);
  const core::Image truth =
      bench.Irradiance(options.lab_width, options.lab_height, options.truth_samples);
  flagship.mean_lab = core::Compare(fast, truth).mean_lab;
  Bench::Picture picture(bench.device(), options.width, options.height);
  for (int run = 0; run < options.runs; ++run) {
    const core::Stopwatch stopwatch;
    bench.Light(0, picture);
    flagship.core_s.push_back(stopwatch.CoreSeconds());
    flagship.wall_s.push_back(stopwatch.WallSeconds());
  }
  return flagship;
}

}  // namespace luxfield::bench
