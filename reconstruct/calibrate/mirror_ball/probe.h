// A bracketed photograph of a mirroring ball or a fisheye sky -> environment map with its standard
// deviation (docs/theory.md 3, "Cameras that develop their pictures", and 8, "Probe formats";
// docs/formats/probe.md).
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/environment/cube_map.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/probe_description.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_fit.h"

namespace luxfield::reconstruct {

// The exposures merged (reconstruct/bracket/merge_exposures.h) and scaled: radiance and its
// standard deviation, 1 or 3 channels, the whole picture. Negative values kept.
struct ProbePicture {
  core::Image radiance, sigma;
  core::Image unknown;           // 1 channel: not 0 where a channel is saturated in every exposure
  std::size_t lower_bounds = 0;  // pixels that are and are taken for what they hold all the same
};

// Throws InputError naming the file: pictures of different sizes or numbers of channels.
ProbePicture MergeProbe(const ProbeDescription& description);

struct Probe {
  RimFit rim;
  environment::CubeMap radiance;  // not negative
  // Of each texel, from what merging says of the pixels: they are independent but for PRNU, which
  // is independent between pixels too. Filled texels: the spread around the hole.
  environment::CubeMap sigma;
  std::vector<float> coverage;  // share of each texel that the photograph shows; 0 if filled
  double seen_sr = 0;           // solid angle of the pixels used
  double filled_sr = 0;         // of texels that no pixel shows and that were filled
  std::size_t used_pixels = 0;
  // Share of the energy, by luminance, that cutting negative texels off added.
  double clamped_share = 0;
};

struct ProbeOptions {
  int face_size = 0;  // 0: half of the rim's radius, in pixels; the ball shows the sphere in pi r^2
  bool fill = true;   // of a ball: what no pixel shows, from its neighbours
};

// The circle of ball or lens: FitRim. It may be none.
RimFit FindRim(const ProbePicture& picture, const ProbeDescription& description);

// Throws InputError as RequireRim, and if a pixel inside the rim is unknown, naming the exposure
// that lets through least; if the rim's margin leaves no pixels; if the mask has another size.
Probe MakeProbe(const ProbePicture& picture, const ProbeDescription& description, const RimFit& rim,
                const ProbeOptions& options = {});

// As OpenEXR FLOAT in layout `cube` (docs/formats/probe.md, "The output").
void WriteProbe(const std::filesystem::path& path, const Probe& probe,
                const ProbeDescription& description);

}  // namespace luxfield::reconstruct
