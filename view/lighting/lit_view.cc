#include "luxfield/view/lighting/lit_view.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/render/accuracy/soft_maps_error.h"
#include "luxfield/render/film/film.h"

namespace luxfield::view {
namespace {

constexpr double kQuickError = 5e-3;  // of the volume
constexpr int kQuickSamples = 8;      // of a light that is sampled
constexpr int kFirstSamples = 16;     // of the first pass, over all lights
constexpr int kFewestSamples =
    2 * render::kSmoothAntialias;      // of other passes: two strata of lights
constexpr int kMostSamples = 1 << 12;  // of a pass
constexpr int kMostPasses = 1 << 15;
constexpr double kAim = 0.97;          // of the error asked for, as its estimate scatters
constexpr double kSmallest = 1.0 / 6;  // side of a quick picture over the whole one's

bool TakesNoSamples(const render::LitScene& scene) {
  return !scene.has_strategies() && !scene.environment();
}

}  // namespace

LitView::LitView(const render::Device& device, const scene::Scene& scene)
    : scene_(device, scene), textures_(scene.geometry.textures) {
  request_.camera = scene.camera;
}

void LitView::Ask(const LitRequest& request) {
  request_ = request;
  scene_.SetCamera(request.camera);
  for (std::size_t i = 0; i < request.lamps.size(); ++i) scene_.PlaceLuminaire(i, request.lamps[i]);
  if (request.environment)
    scene_.PlaceEnvironment(request.environment->world_from_environment,
                            request.environment->scale);
  if (request.materials && request.materials != materials_) {
    scene_.SetMaterials(*request.materials, textures_);
    materials_ = request.materials;
  }
  refined_.reset();
  soft_maps_error_.reset();
  feedback_.reset();
  samples_ = error_ = pass_s_ = 0;
  pass_samples_ = passes_ = 0;
}

bool LitView::NoiseFree() const {
  return !request_.shadows && !scene_.geometry().glossy && TakesNoSamples(scene_);
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
  if (VolumesAreOfNow() && options.shadows == render::Shadows::kNone) picture.error = kQuickError;
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

int LitView::NextSamples() const {
  if (passes_ == 0) return kFirstSamples;
  const double needed = samples_ * (std::pow(error_ / (kAim * request_.error), 2) - 1);
  const int grown = pass_s_ < request_.pass_s ? 2 * pass_samples_ : pass_samples_;
  return std::clamp(static_cast<int>(std::min(std::ceil(needed), double{kMostSamples})),
                    kFewestSamples, std::min(grown, kMostSamples));
}

LitPicture LitView::Refine() {
  const core::Stopwatch stopwatch;
  render::RenderOptions options;
  options.seed = request_.seed;
  options.antialias = render::kSmoothAntialias;
  options.shadows = request_.shadows ? render::Shadows::kTraced : render::Shadows::kNone;
  LitPicture picture;
  picture.quick = false;
  if (NoiseFree()) {
    options.estimator = "volume";
    options.approximation_error = request_.error;
    if (!VolumesAreOfNow()) scene_.DropVolumes();
    volumes_of_ = request_;
    picture.frame = std::make_shared<render::Frame>(render::Renderer(scene_, options).Render());
    picture.error = request_.error;
    picture.reached = true;
    picture.feedback = feedback_;
    picture.took_s = stopwatch.WallSeconds();
    return picture;
  }
  options.samples_per_pixel = NextSamples();
  options.first_pass = passes_;
  render::Frame pass = render::Renderer(scene_, options).Render();
  const double samples = options.samples_per_pixel;
  refined_ = std::make_shared<render::Frame>(
      refined_ ? render::MeanFrame(*refined_, samples_, pass, samples) : std::move(pass));
  samples_ += samples;
  pass_samples_ = options.samples_per_pixel;
  ++passes_;
  pass_s_ = stopwatch.WallSeconds();
  error_ = render::NoiseOf(*refined_, std::max(1, static_cast<int>(samples_) - 1)).RelativeError();
  picture.frame = refined_;
  picture.error = error_;
  picture.soft_maps_error = soft_maps_error_;
  picture.feedback = feedback_;
  picture.samples = samples_;
  picture.reached = error_ <= request_.error || passes_ >= kMostPasses;
  picture.took_s = pass_s_;
  return picture;
}

}  // namespace luxfield::view
