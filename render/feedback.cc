#include "luxfield/render/feedback.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/render/image_shares.h"
#include "luxfield/render/lights_apart.h"

namespace luxfield::render {
namespace {

// Of the scene for as long as this lives.
class SmallCamera {
 public:
  SmallCamera(LitScene& scene, int most_pixels) : scene_(scene), whole_(scene.camera()) {
    scene::Camera small = whole_;
    const double shrink =
        std::min(1.0, std::sqrt(most_pixels / (static_cast<double>(whole_.width) * whole_.height)));
    small.width = std::max(1, static_cast<int>(std::lround(shrink * whole_.width)));
    small.height = std::max(1, static_cast<int>(std::lround(shrink * whole_.height)));
    scene_.SetCamera(small);
  }
  ~SmallCamera() { scene_.SetCamera(whole_); }
  SmallCamera(const SmallCamera&) = delete;
  SmallCamera& operator=(const SmallCamera&) = delete;

 private:
  LitScene& scene_;
  const scene::Camera whole_;
};

}  // namespace

Feedback MeasureFeedback(LitScene& scene, const FeedbackOptions& options) {
  constexpr float kMissed = std::numeric_limits<float>::quiet_NaN();
  const SmallCamera camera(scene, options.most_pixels);
  LightsApart lights(scene, options.shadows);
  Feedback feedback;
  const auto parts = lights.LightParts(
      {Strategies::kNewton, options.samples_per_light, 0.5f, options.pilot}, options.seed);
  feedback.light_share = lights.Spread(MeanLightShare(parts), kMissed);
  if (!scene.luminaires().empty())
    feedback.image_share = lights.Spread(ImageSharesAt(scene, lights.points()), kMissed);
  return feedback;
}

}  // namespace luxfield::render
