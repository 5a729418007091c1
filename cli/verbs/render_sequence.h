// Pictures of the frames of a scene in which things move or whose environment is a sequence: what
// `render` makes of it, and its shards.
#pragma once

#include <cstddef>
#include <string>

#include "luxfield/cli/verbs/verb_render.h"
#include "luxfield/core/json.h"
#include "luxfield/render/picture_sequence.h"

namespace luxfield::cli {

// How many frames there are; 0: it is one picture and no sequence. Throws InputError for options
// that are for one picture where it is a sequence.
std::size_t FrameCount(const RenderSetUp& set_up);

// With the names of the files of frame n: X_0007.exr of X.exr.
RenderVerbOptions OfFrame(const RenderVerbOptions& options, std::size_t n);

class RenderedSequence {
 public:
  // Of a set-up that is a sequence. Throws as LitScene and PictureSequence.
  RenderedSequence(const render::Device& device, RenderSetUp set_up);

  std::size_t frame_count() const { return sequence_.frame_count(); }
  const std::string& geometry_sha256() const { return geometry_sha256_; }

  // Frame n, in any order, whose provenance has MadeOf(n) as "made_of_sha256".
  render::Frame Render(std::size_t n);
  // SHA-256 of all that decides the files of frame n, other than their names: content of the scene's
  // files, where things stand, options, device type, version.
  std::string MadeOf(std::size_t n) const;
  // Whether all files of frame n are there, and the EXR, which is put in place last, was made of
  // the same.
  bool IsThere(std::size_t n) const;

 private:
  RenderVerbOptions options_;
  std::vector<scene::Placement> placements_;
  std::string geometry_sha256_;
  render::LitScene lit_;
  render::PictureSequence sequence_;
};

// Every frame as files of its own, put in place one by one.
core::Json RenderSequence(const render::Device& device, RenderSetUp set_up);

}  // namespace luxfield::cli
