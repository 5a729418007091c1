#include "luxfield/view/lighting/lit_view.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/choose_setting.h"
#include "luxfield/render/accuracy/soft_maps_error.h"
#include "luxfield/render/film/film.h"

namespace luxfield::view {
namespace {

constexpr double kQuickError = 5e-3;   // of the volume
constexpr int kQuickSamples = 8;       // of a light that is sampled
constexpr double kSmallest = 1.0 / 6;  // side of a quick picture over the whole one's

}  // namespace

LitView::LitView(const render::Device& device, const scene::Scene& scene)
    : scene_(device, scene), textures_(scene.geometry.textures) {
  request_.camera = scene.camera;
}

void LitView::Ask(const LitRequest& request) {
  request_ = request;
  scene_.SetCamera(request.camera);
  for (std::size_t i = 0; i < request.lamps.size(); ++i) scene_.PlaceLuminaire(i, request.lamps[i]);
  for (std::size_t i = 0; i < request.classical_lights.size(); ++i)
    scene_.PlaceClassicalLight(i, request.classical_lights[i]);
  if (request.environment)
    scene_.PlaceEnvironment(request.environment->world_from_environment,
                            request.environment->scale);
  if (request.materials && request.materials != materials_) {
    scene_.SetMaterials(*request.materials, textures_);
    materials_ = request.materials;
  }
  refining_.reset();
  soft_maps_error_.reset();
  feedback_.reset();
}

bool LitView::VolumesAreOfNow() const {
  if (!volumes_of_ || volumes_of_->lamps.size() != request_.lamps.size()) return false;
  const auto same = [](const lightfield::Vec3& a, const lightfield::Vec3& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  };
  const scene::Camera &then = volumes_of_->camera, &now = request_.camera;
  if (!same(then.position, now.position) || !same(then.forward, now.forward) ||
      !same(then.up, now.up) || then.vertical_fov_deg != now.vertical_fov_deg)
    return false;
  for (std::size_t i = 0; i < request_.lamps.size(); ++i) {
    const scene::Pose &before = volumes_of_->lamps[i].world_from_luminaire,
                      &after = request_.lamps[i].world_from_luminaire;
    if (before.linear != after.linear || !same(before.translation, after.translation)) return false;
  }
  return true;
}

render::RenderOptions LitView::QuickOptions() const {
  render::RenderOptions options;
  options.estimator = "volume";
  options.approximation_error = kQuickError;
  options.matt = true;
  options.relight = false;
  options.shadows = request_.shadows && request_.moving_shadows ? render::Shadows::kSoftMaps
                                                                : render::Shadows::kNone;
  options.light_samples.assign(scene_.Lights().size(), kQuickSamples);
  options.seed = request_.seed;
  const double pixels = static_cast<double>(request_.camera.width) * request_.camera.height;
  const double affordable = quick_pixel_s_ > 0 ? request_.frame_s / quick_pixel_s_ : pixels / 4;
  const double side = std::clamp(std::sqrt(affordable / pixels), kSmallest, 1.0);
  options.width = std::max(1, static_cast<int>(std::lround(side * request_.camera.width)));
  options.height = std::max(1, static_cast<int>(std::lround(side * request_.camera.height)));
  return options;
}

LitPicture LitView::Quick() {
  const render::RenderOptions options = QuickOptions();
  if (!volumes_of_) volumes_of_ = request_;
  render::Renderer renderer(scene_, options);  // tables are built here, and are not timed
  const core::Stopwatch stopwatch;
  LitPicture picture;
  picture.frame = std::make_shared<render::Frame>(renderer.Render());
  picture.took_s = stopwatch.WallSeconds();
  const bool sampled = scene_.has_strategies() || scene_.environment();
  if (VolumesAreOfNow() && options.shadows == render::Shadows::kNone && !sampled)
    picture.error = kQuickError;
  const double pixels = static_cast<double>(options.width) * options.height;
  picture.samples = render::SumOf(picture.frame->samples) / pixels;
  quick_pixel_s_ = picture.took_s / pixels;
  return picture;
}

bool LitView::HasUnknownShadows() const {
  return request_.shadows && request_.moving_shadows && !request_.lamps.empty() &&
         !soft_maps_error_;
}

void LitView::MeasureShadows() {
  soft_maps_error_ = render::MeasureSoftMaps(scene_, QuickOptions()).rel_error;
}

void LitView::MeasureFeedback() {
  try {
    feedback_ = std::make_shared<const render::Feedback>(
        render::MeasureFeedback(scene_, {.shadows = request_.shadows, .seed = request_.seed}));
  } catch (const InputError&) {
    feedback_ = std::make_shared<const render::Feedback>();
  }
}

std::unique_ptr<render::AccurateRendering> LitView::Begin() {
  render::AccuracyRequest request;
  request.rel_error = request_.error;
  request.round_s = request_.round_s;
  request.picture.seed = request_.seed;
  request.picture.antialias = render::kSmoothAntialias;
  request.picture.shadows = request_.shadows ? render::Shadows::kTraced : render::Shadows::kNone;
  // Volumes of elsewhere are made anew where nothing is sampled, for the next quick pictures too.
  if (!request_.shadows && !scene_.geometry().glossy && render::ReadsCostModel(scene_, request) &&
      !VolumesAreOfNow()) {
    scene_.DropVolumes();
    scene_.Require({.volume = true}, std::min(kQuickError, render::ApproximationError(request)));
    volumes_of_ = request_;
  }
  return render::BeginRendering(scene_, request);
}

LitPicture LitView::Refine() {
  const core::Stopwatch stopwatch;
  if (!refining_) refining_ = Begin();
  if (!refining_->done()) refining_->TakeRound();
  const render::AccurateFrame& result = refining_->result();
  LitPicture picture;
  picture.quick = false;
  picture.frame = std::make_shared<render::Frame>(result.frame);
  picture.error = result.estimated_error;
  picture.done = refining_->done();
  picture.reached = result.met;
  picture.soft_maps_error = soft_maps_error_;
  picture.feedback = feedback_;
  picture.estimator = result.chosen.estimator;
  picture.samples = result.chosen.samples_per_pixel;
  picture.took_s = stopwatch.WallSeconds();
  return picture;
}

}  // namespace luxfield::view
