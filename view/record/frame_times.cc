#include "luxfield/view/record/frame_times.h"

#include <numbers>

#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/view/lighting/camera_control.h"
#include "luxfield/view/picture/look.h"

namespace luxfield::view {
namespace {

constexpr int kUncounted = 2;
constexpr double kOrbit = 0.5 * std::numbers::pi / 180, kPivot_m = 3, kStep_m = 0.01;
constexpr double kAnyTime_s = 1e9;  // all pixels, however long they take

enum class Moving { kCamera, kLamps };

void Move(Moving what, CameraControl& camera, LitRequest& request) {
  if (what == Moving::kCamera) {
    camera.Orbit(kOrbit, 0);
    request.camera = camera.camera();
    return;
  }
  for (scene::PlacedLamp& lamp : request.lamps)
    lamp.world_from_luminaire.translation =
        lamp.world_from_luminaire.translation + kStep_m * request.camera.right;
}

MovingTimes Measure(LitView& view, LitRequest request, Moving what, bool shadows, int frames) {
  request.moving_shadows = shadows;
  CameraControl camera(request.camera, kPivot_m);
  std::vector<double> frame_s, core_s, picture_s, colours_s, primary_s, lighting_s;
  for (int n = -kUncounted; n < frames; ++n) {
    core::ThrowIfInterrupted();
    Move(what, camera, request);
    const core::Stopwatch whole;
    view.Ask(request);
    const LitPicture picture = view.Quick();
    const double lit_core_s = whole.CoreSeconds();
    const auto colours = ColoursOf(*picture.frame, {});
    if (n < 0) continue;
    frame_s.push_back(whole.WallSeconds());
    core_s.push_back(whole.CoreSeconds());
    picture_s.push_back(lit_core_s);
    colours_s.push_back(core_s.back() - lit_core_s);
    primary_s.push_back(picture.frame->times.gbuffer_s);
    lighting_s.push_back(picture.frame->times.lighting_s);
  }
  return {what == Moving::kCamera ? "camera" : "lamps",
          shadows,
          core::Median(frame_s),
          core::Median(core_s),
          core::Median(picture_s),
          core::Median(colours_s),
          core::Median(primary_s),
          core::Median(lighting_s)};
}

void Refine(LitView& view, const LitRequest& request, FrameTimes& times) {
  const core::Stopwatch stopwatch;
  view.Ask(request);
  LitPicture picture;
  do {
    core::ThrowIfInterrupted();
    picture = view.Refine();
  } while (!picture.done);
  times.refined_s = stopwatch.WallSeconds();
  times.refined_core_s = stopwatch.CoreSeconds();
  times.refined_error = picture.error.value_or(0);
  times.samples = picture.samples;
}

}  // namespace

FrameTimes MeasureFrameTimes(const FrameTimesOptions& options) {
  core::Progress progress("bench", 6);  // whose pictures tell nothing then
  FrameTimes times;
  auto took_s = [watch = core::Stopwatch()]() mutable {
    const double s = watch.WallSeconds();
    watch = core::Stopwatch();
    return s;
  };
  const scene::Scene scene = LoadScene(options.input, options.kind);
  times.first.scene_s = took_s();
  const render::Device device = render::Device::Open(options.input.device, options.input.threads);
  times.first.device_s = took_s();
  LitView view(device, scene);
  times.first.lamps_s = took_s();
  LitRequest request = RequestOf(scene, options.input);
  view.Ask(request);
  times.first.picture_s = view.Quick().took_s;
  times.first.tables_s = took_s() - times.first.picture_s;
  times.width = scene.camera.width;
  times.height = scene.camera.height;
  times.device = device.info().name;
  progress.Advance();
  request.frame_s = kAnyTime_s;
  for (const Moving what : {Moving::kCamera, Moving::kLamps})
    for (const bool shadows : {false, true}) {
      times.moving.push_back(Measure(view, request, what, shadows, options.frames));
      progress.Advance();
    }
  Refine(view, request, times);
  progress.Advance();
  return times;
}

}  // namespace luxfield::view
