// Pictures of a scene for who moves through it: quick ones while something moves, and ones that get
// better as long as nothing does.
//
// While something moves, light of luminaires is taken from the light-vector volume and its shadows
// from soft maps, without noise; what is glossy is shown as a matt surface of its base colour; other
// lights are sampled with a few samples and traced. The picture has fewer pixels where it would take
// longer than it may.
//
// When nothing moves, the picture is that of `render --error` (render/accuracy/accuracy.h): the
// estimator that is expected to reach the error soonest, round by round, with several surface points
// in each pixel, as `render --png` has them. The error is the expected RMSE of the luminance over its
// mean.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/render/accuracy/accuracy.h"
#include "luxfield/render/feedback.h"
#include "luxfield/render/renderer.h"
#include "luxfield/scene/motion_path.h"

namespace luxfield::view {

struct PlacedSky {
  scene::Pose world_from_environment;
  double scale = 1;
};

struct LitRequest {
  // Another scene than was asked for before, whose things are not only elsewhere; null: the same.
  std::shared_ptr<const scene::Scene> scene;
  scene::Camera camera;
  std::vector<scene::PlacedLamp> lamps;             // luminaires that are light fields
  std::vector<scene::PlacedLamp> classical_lights;  // empty: as the scene has them
  std::optional<PlacedSky> environment;             // empty: as the scene has it
  std::shared_ptr<const std::vector<scene::Material>> materials;  // null: likewise
  bool shadows = true;                                            // of refined pictures
  bool moving_shadows = true;                                     // of quick ones
  double error = 0.005;  // that refined pictures are to reach
  double frame_s = 0.1;  // that a quick picture may take
  // Refined ones come at least as often as that, or as what they took so far grows threefold. Empty:
  // no sooner than they must.
  std::optional<double> round_s = 1.5;
  std::uint64_t seed = 1;
};

struct LitPicture {
  std::shared_ptr<const render::Frame> frame;
  bool quick = true;     // shadows or gloss may be missing
  bool done = false;     // nothing follows
  bool reached = false;  // the error asked for
  // Estimated relative RMSE; of a quick picture that of its volumes, which is known where nothing
  // moved since they were made. What soft maps of shadows add to it is not part of it.
  std::optional<double> error;
  // Relative RMSE that soft maps of shadows add to quick pictures of this view and these lamps, once
  // it is measured (render/accuracy/soft_maps_error.h).
  std::optional<double> soft_maps_error;
  std::shared_ptr<const render::Feedback> feedback;  // of this view and these lamps, once known
  std::string estimator;                             // of luminaires
  double samples = 0;                                // light samples a pixel
  double took_s = 0;                                 // the last round
  // That it shows, of pictures that a LightingThread publishes.
  std::shared_ptr<const scene::Scene> scene;
};

class LitView {
 public:
  // Uploads the scene, which outlives this; throws what render::LitScene throws.
  LitView(const render::Device& device, const scene::Scene& scene);

  // What the next pictures show; forgets what was refined.
  void Ask(const LitRequest& request);
  // Throws what render::Renderer throws.
  LitPicture Quick();
  // The picture of all rounds since Ask, with one more; the first chooses the estimator. Throws
  // Interrupted too: the round is lost, those before it are kept.
  LitPicture Refine();
  // Whether quick pictures have soft maps whose error is not measured yet.
  bool HasUnknownShadows() const;
  // Measures it against traced shadows at a small picture; pictures tell it from then on, until the
  // next Ask. Throws what Refine throws.
  void MeasureShadows();
  const std::optional<double>& soft_maps_error() const { return soft_maps_error_; }
  // Measures what guides the samples; pictures tell it from then on, until the next Ask. Empty images
  // where that is not to be had of the scene's lights. Throws DeviceError, Interrupted.
  void MeasureFeedback();
  const std::shared_ptr<const render::Feedback>& feedback() const { return feedback_; }

  const render::LitScene& scene() const { return scene_; }

 private:
  std::unique_ptr<render::AccurateRendering> Begin();
  // Whether the volumes were made of where camera and lamps are.
  bool VolumesAreOfNow() const;
  render::RenderOptions QuickOptions() const;

  render::LitScene scene_;
  const std::vector<scene::Texture>& textures_;
  std::shared_ptr<const std::vector<scene::Material>> materials_;  // that were asked for last
  LitRequest request_;
  std::optional<LitRequest> volumes_of_;  // where things stood when they were made
  double quick_pixel_s_ = 0;              // that a pixel of the last quick picture took
  std::unique_ptr<render::AccurateRendering> refining_;  // of this request; null: not yet begun
  std::optional<double> soft_maps_error_;
  std::shared_ptr<const render::Feedback> feedback_;
};

}  // namespace luxfield::view
