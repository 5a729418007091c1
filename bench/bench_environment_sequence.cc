#include "luxfield/bench/bench_environment_sequence.h"

#include <nlohmann/json.hpp>

#include "luxfield/bench/ball_scene.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/renderer.h"

namespace luxfield::bench {
namespace {

nlohmann::json Row(const render::Device& device, const BenchEnvironmentOptions& options,
                   render::Shadows shadows) {
  scene::Scene scene = BallScene(options.width, options.height);
  scene::MakeLambertian(scene.geometry);
  scene.environment.emplace();
  scene.environment->file = options.sequence;
  scene.environment->face_size = options.face_size;
  render::LitScene lit(device, scene);
  render::RenderOptions how;
  how.shadows = shadows;
  how.samples_per_pixel = options.samples_per_pixel.front();
  render::Renderer renderer(lit, how);
  renderer.Render();  // compiles; its frame is rendered once more below

  const std::size_t frames = lit.frame_count();
  double next_s = 0, render_s = 0, first_half_mib = 0;
  core::TakePeakMib();
  for (std::size_t frame = 0; frame < frames; ++frame) {
    if (frame > 0) {
      const core::Stopwatch stopwatch;
      lit.NextFrame();
      device.Finish();
      next_s += stopwatch.WallSeconds();
    }
    if (frame == frames / 2) first_half_mib = core::TakePeakMib();
    const core::Stopwatch stopwatch;
    renderer.Render();
    render_s += stopwatch.WallSeconds();
  }
  const auto count = static_cast<double>(frames);
  return {{"frames", frames},
          {"spp", how.samples_per_pixel},
          {"shadows", render::ShadowsName(shadows)},
          {"fps", count / (next_s + render_s)},
          {"next_ms", 1e3 * next_s / (count - 1)},
          {"render_ms", 1e3 * render_s / count},
          {"first_half_mib", first_half_mib},
          {"second_half_mib", core::TakePeakMib()}};
}

}  // namespace

nlohmann::json SequenceRows(const render::Device& device, const BenchEnvironmentOptions& options) {
  return {Row(device, options, render::Shadows::kNone),
          Row(device, options, render::Shadows::kTraced)};
}

}  // namespace luxfield::bench
