// `render` of one picture, cut into bands of its rows.
//
// Random numbers are indexed by the pixel of the whole picture, and a picture is lit in bands of
// Renderer::BandRows rows, so that a band is what it is in the picture. The variances' scale follows
// from pixels of all bands that are lit again; it is applied when the bands are joined.
#pragma once

#include <string>

#include "luxfield/render/renderer.h"
#include "luxfield/scene/scene.h"
#include "luxfield/shard/task.h"

namespace luxfield::shard {

struct RenderJob {
  std::filesystem::path scene, output;
  scene::SceneOverrides overrides;
  render::RenderOptions options;
  std::string device;
  int threads = 0;
};

class RenderTask : public Task {
 public:
  explicit RenderTask(RenderJob job) : job_(std::move(job)) {}

  std::string Axis() const override { return "rows"; }
  int Length() const override;
  int Grain() const override;
  std::vector<std::filesystem::path> Inputs() const override;
  core::Json Whole() const override;
  std::vector<std::string> Endings() const override { return {".exr"}; }
  core::Json Run(const core::Json& whole, int first, int last,
                 std::span<const std::filesystem::path> files) const override;
  void Join(const core::Json& whole, std::span<const Piece> pieces) const override;
  std::vector<std::filesystem::path> Outputs() const override { return {job_.output}; }

 private:
  scene::Scene Read() const;
  RenderJob job_;
};

}  // namespace luxfield::shard
