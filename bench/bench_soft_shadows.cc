#include "luxfield/bench/bench_soft_shadows.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <vector>

#include "luxfield/bench/occluder_scene.h"
#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/estimators/pixel_list.h"
#include "luxfield/render/estimators/volume.h"
#include "luxfield/render/film/film.h"
#include "luxfield/render/scene/device_scene.h"

namespace luxfield::bench {
namespace {

constexpr double kApart_m = 0.7, kStep_m = 0.01;

class Bench {
 public:
  explicit Bench(const SoftShadowsOptions& options)
      : options_(options),
        device_(render::Device::Open(options.device, options.threads)),
        field_(render::SyntheticCar2(options.lamp)),
        lamp_(device_, field_),
        scene_(render::UploadScene(device_, OccluderScene())),
        gbuffer_(device_, options.width, options.height),
        primary_(device_),
        volume_(render::MakeEstimator("volume", device_)),
        exact_(render::MakeEstimator("exact", device_)) {
    std::vector<preprocess::Receiver> receivers;
    // What the camera sees at the ends of its flight and halfway.
    for (int k = options.flight_frames > 1 ? 2 : 0; k >= 0; --k) {
      DrawPrimary((options.flight_frames - 1) * k / 2);
      for (int lamp = 0; lamp < 2; ++lamp) {
        const auto more = render::ReceiversOf(gbuffer_, PoseOf(lamp, 0));
        receivers.insert(receivers.end(), more.begin(), more.end());
      }
    }
    const auto volume =
        preprocess::BuildForReceivers(field_, receivers, {.max_rel_error = options.volume_error})
            .volume;
    const auto cells = preprocess::BuildCellTables(field_, "car2");
    const auto patches = preprocess::TabulatePatchLight(field_);
    lamp_.Add(device_, {.cells = &cells, .volume = &volume, .patches = &patches});
    for (int lamp = 0; lamp < 2; ++lamp)
      shadows_.emplace_back(device_, lamp_, PoseOf(lamp, 0), scene_.bvh(), options.map_size);
  }

  SoftShadowsFigures Run() {
    SoftShadowsFigures figures;
    TakeTimes(figures);
    const std::vector<cl_int> pixels = Subset(options_.reference_pixels);
    const render::GBuffer some = Gather(pixels);
    const int half = options_.reference_samples / 2;
    const core::Image a = Traced(some, 0, half, 1), b = Traced(some, 0, half, 2);
    core::Image truth = a;
    for (std::size_t k = 0; k < a.data.size(); ++k) truth.data[k] = 0.5f * (a.data[k] + b.data[k]);
    figures.reference_lab = core::Compare(a, b).mean_lab / 2;
    figures.unshadowed_lab = core::Compare(Pick(Fast(/*shadowed=*/false), pixels), truth).mean_lab;
    const core::Difference difference = core::Compare(Pick(Fast(), pixels), truth);
    figures.mean_lab = difference.mean_lab;
    figures.rel_rmse = difference.rel_rmse;
    figures.bias = difference.bias;
    if (!options_.pictures.empty()) WritePictures();
    if (options_.motion_frames > 1) figures.motion = MoveLamps();
    if (options_.flight_frames > 1) figures.flight = MoveCamera();
    return figures;
  }

 private:
  static scene::Pose PoseOf(int lamp, int frame) {
    return scene::Translation({(lamp - 0.5) * kApart_m + frame * kStep_m, 0, 0});
  }

  void DrawPrimary(int frame) {
    primary_
        .Render(scene_, OccluderCamera(options_.width, options_.height, frame), 0, {0.5, 0.5},
                gbuffer_)
        .Wait();
  }

  void DrawMaps(int frame) {
    for (int lamp = 0; lamp < 2; ++lamp) shadows_[lamp].Draw(PoseOf(lamp, frame), scene_.bvh());
  }

  void AddFast(int frame, bool shadowed, render::Lighting& lighting) {
    render::EstimatorOptions how;
    how.max_error = static_cast<float>(options_.volume_error);
    for (int lamp = 0; lamp < 2; ++lamp) {
      render::Visibility visibility;
      if (shadowed) visibility.patches = &shadows_[lamp];
      volume_->Light({gbuffer_, visibility}, render::PosedLuminaire{lamp_, PoseOf(lamp, frame)},
                     how, lighting);
    }
  }

  // The whole picture: tiles of neighbours are lit otherwise than single pixels.
  core::Image Fast(bool shadowed = true, int frame = 0) {
    render::Lighting lighting(device_, gbuffer_);
    AddFast(frame, shadowed, lighting);
    return Irradiance(gbuffer_, lighting);
  }

  static core::Image Pick(const core::Image& picture, const std::vector<cl_int>& pixels) {
    core::Image some(static_cast<int>(pixels.size()), 1, picture.channels);
    for (int c = 0; c < picture.channels; ++c)
      for (std::size_t k = 0; k < pixels.size(); ++k)
        some.plane(c)[k] = picture.plane(c)[pixels[k]];
    return some;
  }

  core::Image Traced(const render::GBuffer& gbuffer, int frame, int samples, std::uint64_t seed) {
    render::Lighting lighting(device_, gbuffer);
    render::EstimatorOptions how;
    how.seed = seed;
    how.samples_per_pixel = std::max(samples, 1);
    for (int lamp = 0; lamp < 2; ++lamp) {
      how.stream = static_cast<std::uint32_t>(lamp);
      exact_->Light({gbuffer, {.rays = scene_.rays.get()}},
                    render::PosedLuminaire{lamp_, PoseOf(lamp, frame)}, how, lighting);
    }
    return Irradiance(gbuffer, lighting);
  }

  static core::Image Irradiance(const render::GBuffer& gbuffer, const render::Lighting& lighting) {
    const auto values = lighting.irradiance.Download<cl_float4>();
    core::Image image(gbuffer.width, gbuffer.height, 3);
    for (std::size_t k = 0; k < values.size(); ++k)
      for (std::size_t c = 0; c < 3; ++c) image.data[c * values.size() + k] = values[k].s[c];
    return image;
  }

  // Pixels that hit something, at random.
  std::vector<cl_int> Subset(int count) {
    const auto positions = gbuffer_.position.Download<cl_float4>();
    std::vector<cl_int> pixels;
    core::Random random(1, 0);
    for (int k = 0; k < count;) {
      const auto pixel =
          static_cast<std::size_t>(random.Uniform() * static_cast<double>(positions.size()));
      if (positions[pixel].s[3] == 0) continue;
      pixels.push_back(static_cast<cl_int>(pixel));
      ++k;
    }
    std::ranges::sort(pixels);
    return pixels;
  }

  // As a picture of one row.
  render::GBuffer Gather(const std::vector<cl_int>& pixels) {
    return render::PixelList(device_).Gather(gbuffer_, pixels);
  }

  template <typename Work>
  std::vector<SoftShadowsTime> Time(Work&& work) {
    work();  // compiles, and touches memory
    device_.Finish();
    std::vector<SoftShadowsTime> runs;
    for (int run = 0; run < options_.repeats; ++run) {
      const core::Stopwatch stopwatch;
      work();
      device_.Finish();
      runs.push_back({stopwatch.CoreSeconds(), stopwatch.WallSeconds()});
    }
    return runs;
  }

  static SoftShadowsTime MedianOf(const std::vector<SoftShadowsTime>& runs) {
    std::vector<double> core_s, wall_s;
    for (const SoftShadowsTime& run : runs) {
      core_s.push_back(run.core_s);
      wall_s.push_back(run.wall_s);
    }
    return {core::Median(core_s), core::Median(wall_s)};
  }

  void TakeTimes(SoftShadowsFigures& figures) {
    render::Lighting lighting(device_, gbuffer_);
    const auto light = [&](bool shadowed) { AddFast(0, shadowed, lighting); };
    figures.primary_core_s = MedianOf(Time([&] { DrawPrimary(0); })).core_s;
    figures.unshadowed_core_s = MedianOf(Time([&] { light(false); })).core_s;
    figures.maps_core_s = MedianOf(Time([&] { DrawMaps(0); })).core_s;
    const SoftShadowsTime camera = MedianOf(Time([&] { light(true); }));
    figures.camera_fps = 1 / camera.wall_s;
    figures.camera_core_s = camera.core_s;
    figures.runs = Time([&] {
      DrawMaps(0);
      light(true);
    });
    const SoftShadowsTime lamps = MedianOf(figures.runs);
    figures.fps = 1 / lamps.wall_s;
    figures.core_s = lamps.core_s;
  }

  MotionFigures MoveLamps() {
    const std::vector<cl_int> pixels = Subset(options_.motion_pixels);
    const MotionFigures figures = Compare(options_.motion_frames, [&](int frame) {
      DrawMaps(frame);
      return Pictures(pixels, frame);
    });
    DrawMaps(0);
    return figures;
  }

  MotionFigures MoveCamera() {
    const std::vector<cl_int> pixels = Subset(options_.motion_pixels);
    const MotionFigures figures = Compare(options_.flight_frames, [&](int frame) {
      DrawPrimary(frame);
      return Pictures(pixels, 0);
    });
    DrawPrimary(0);
    return figures;
  }

  struct PictureAndTruth {
    core::Image picture, truth;
  };

  // The reference draws the same samples in every frame, so that its noise moves with the light.
  PictureAndTruth Pictures(const std::vector<cl_int>& pixels, int lamp_frame) {
    return {Pick(Fast(true, lamp_frame), pixels),
            Traced(Gather(pixels), lamp_frame, options_.reference_samples, 1)};
  }

  template <typename PicturesOfFrame>
  static MotionFigures Compare(int frames, PicturesOfFrame&& pictures_of) {
    MotionFigures figures;
    PictureAndTruth before = pictures_of(0);
    const int steps = frames - 1;
    for (int frame = 1; frame <= steps; ++frame) {
      PictureAndTruth now = pictures_of(frame);
      // The change of these pictures laid upon the reference.
      core::Image changed = before.truth;
      for (std::size_t k = 0; k < changed.data.size(); ++k)
        changed.data[k] =
            std::max(0.0f, changed.data[k] + now.picture.data[k] - before.picture.data[k]);
      const double lab = core::Compare(now.picture, before.picture).mean_lab,
                   reference_lab = core::Compare(now.truth, before.truth).mean_lab;
      figures.lab += lab / steps;
      figures.reference_lab += reference_lab / steps;
      figures.error_lab += core::Compare(changed, now.truth).mean_lab / steps;
      figures.excess_lab += (lab - reference_lab) / steps;
      figures.largest_excess_lab = std::max(
          frame == 1 ? lab - reference_lab : figures.largest_excess_lab, lab - reference_lab);
      before = std::move(now);
    }
    return figures;
  }

  // The picture, the reference of fewer samples, and their Lab difference, 20 shown as white.
  void WritePictures() {
    const std::filesystem::path folder = options_.pictures;
    std::filesystem::create_directories(folder);
    const core::Image picture = Fast(), truth = Traced(gbuffer_, 0, 64, 3);
    render::WritePng(folder / "soft-maps.png", render::ToneMap(picture, {}));
    render::WritePng(folder / "soft-maps-reference.png", render::ToneMap(truth, {}));
    const core::Image lab = core::LabDifference(picture, truth);
    core::Image grey(options_.width, options_.height, 3);
    for (int c = 0; c < 3; ++c) std::ranges::copy(lab.plane(0), grey.plane(c).begin());
    render::WritePng(folder / "soft-maps-lab.png", render::ToneMap(grey, {.exposure = 0.05}));
  }

  SoftShadowsOptions options_;
  render::Device device_;
  lightfield::LightField field_;
  render::LuminaireOnDevice lamp_;
  render::DeviceScene scene_;
  render::GBuffer gbuffer_;
  render::PrimaryVisibility primary_;
  std::unique_ptr<render::Estimator> volume_, exact_;
  std::vector<render::PatchShadows> shadows_;
};

}  // namespace

SoftShadowsFigures MeasureSoftShadows(const SoftShadowsOptions& options) {
  if (std::min({options.width, options.height, options.repeats, options.reference_pixels,
                options.motion_pixels}) < 1 ||
      options.reference_samples < 2)
    throw InputError(
        "bench shadows: width, height, repeats and pixels must be at least 1, the reference's "
        "samples 2");
  return Bench(options).Run();
}

nlohmann::json SoftShadowsRow(const SoftShadowsOptions& options,
                              const SoftShadowsFigures& figures) {
  nlohmann::json row{{"width", options.width},
                     {"height", options.height},
                     {"map_size", options.map_size},
                     {"fps", figures.fps},
                     {"core_s", figures.core_s},
                     {"primary_core_s", figures.primary_core_s},
                     {"camera_fps", figures.camera_fps},
                     {"camera_core_s", figures.camera_core_s},
                     {"maps_core_s", figures.maps_core_s},
                     {"unshadowed_core_s", figures.unshadowed_core_s},
                     {"mean_lab", figures.mean_lab},
                     {"rel_rmse", figures.rel_rmse},
                     {"bias", figures.bias},
                     {"reference_lab", figures.reference_lab},
                     {"unshadowed_lab", figures.unshadowed_lab}};
  const auto add = [&row](const std::string& what, int frames, const MotionFigures& of) {
    if (frames < 2) return;
    row[what + "_lab"] = of.lab;
    row[what + "_reference_lab"] = of.reference_lab;
    row[what + "_error_lab"] = of.error_lab;
    row[what + "_excess_lab"] = of.excess_lab;
    row[what + "_largest_excess_lab"] = of.largest_excess_lab;
  };
  add("motion", options.motion_frames, figures.motion);
  add("flight", options.flight_frames, figures.flight);
  return row;
}

}  // namespace luxfield::bench
