// Pictures of a scene as time goes by: its camera and lamps on their paths, the frames of its
// environment, or both.
//
//   scene::Scene scene = scene::ReadScene("room.toml");
//   PictureSequenceOptions options;
//   options.path = "path.toml";
//   options.placements = scene::PlacementsOf(scene::ReadMotionPath(options.path), scene);
//   LitScene lit(Device::Open(), std::move(scene));
//   PictureSequence sequence(lit, options);
//   for (std::size_t n = 0; n < sequence.frame_count(); ++n) WriteFrame(..., sequence.Render(n));
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "luxfield/render/renderer.h"
#include "luxfield/scene/motion_path.h"

namespace luxfield::render {

struct PictureSequenceOptions {
  RenderOptions picture;
  std::filesystem::path path;                // path.toml, whose hash pictures tell; with placements
  std::vector<scene::Placement> placements;  // of each frame; empty: nothing moves
};

class PictureSequence {
 public:
  // Throws InputError where things move and the environment is a sequence of another number of
  // frames.
  PictureSequence(LitScene& scene, const PictureSequenceOptions& options);

  std::size_t frame_count() const { return frame_count_; }

  // Frame n, in any order. Its pixels are those of a scene in which everything stands like that,
  // whatever frames came before. Where things move its seed is the picture's plus n. Throws what
  // Renderer throws.
  Frame Render(std::size_t n);

 private:
  void Place(const scene::Placement& placement);

  LitScene& scene_;
  PictureSequenceOptions options_;
  std::size_t frame_count_ = 1;
  std::optional<Renderer> of_still_things_;
};

}  // namespace luxfield::render
