#include "luxfield/render/picture_sequence.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::render {

PictureSequence::PictureSequence(LitScene& scene, const PictureSequenceOptions& options)
    : scene_(scene), options_(options), frame_count_(scene.frame_count()) {
  if (options.placements.empty()) return;
  const std::size_t moving = options.placements.size();
  if (frame_count_ > 1 && frame_count_ != moving)
    throw InputError(
        options.path.string(),
        fmt::format("has {} frames and the scene's environment {}", moving, frame_count_),
        "set duration_s and frames_per_s so that they are as many");
  frame_count_ = moving;
}

Frame PictureSequence::Render(std::size_t n) {
  if (scene_.frame_count() > 1) scene_.ShowFrame(n);
  if (options_.placements.empty()) {
    if (!of_still_things_) of_still_things_.emplace(scene_, options_.picture);
    return of_still_things_->Render();
  }
  Place(options_.placements.at(n));
  RenderOptions picture = options_.picture;
  picture.seed += n;
  Frame frame = Renderer(scene_, picture).Render();
  if (!options_.path.empty()) frame.provenance["path sha256"] = core::Sha256OfFile(options_.path);
  return frame;
}

void PictureSequence::Place(const scene::Placement& placement) {
  scene_.SetCamera(placement.camera);
  for (std::size_t i = 0; i < placement.lamps.size(); ++i)
    scene_.PlaceLuminaire(i, placement.lamps[i]);
  scene_.DropVolumes();  // which are made of what was seen from where lamps stood
}

}  // namespace luxfield::render
