// `render` of a sequence, cut into ranges of frames.
//
// A frame's files are made of the scene as it stands in that frame and of nothing else, so that
// shards are the verb's own files and gathering copies them to their names. The meshes and textures
// that scene.toml leads to are compared by what they make of the scene (Whole), the other files by
// their content.
#pragma once

#include "luxfield/cli/verbs/verb_render.h"
#include "luxfield/shard/task.h"

namespace luxfield::cli {

class RenderTask : public shard::Task {
 public:
  // Throws InputError where the set-up is no sequence of frames. `threads` are the device's.
  RenderTask(RenderSetUp set_up, int threads);

  std::string Axis() const override { return "frames"; }
  int Length() const override { return frames_; }
  std::vector<std::filesystem::path> Inputs() const override;
  core::Json Whole() const override;
  std::vector<std::string> Endings(int first, int last) const override;
  core::Json Run(const core::Json& whole, int first, int last,
                 std::span<const std::filesystem::path> files) const override;
  void Join(const core::Json& whole, std::span<const shard::Piece> pieces) const override;
  std::vector<std::filesystem::path> Outputs() const override;

 private:
  RenderSetUp set_up_;
  int threads_ = 0, frames_ = 0;
};

}  // namespace luxfield::cli
