// Edges of a photograph, and how far they run along a circle.
#pragma once

#include "luxfield/core/image.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/probe_optics.h"

namespace luxfield::reconstruct {

// The slope of the logarithm of a picture that was reduced by `factor` (at most 1), d ln L / dx and
// d ln L / dy per reduced pixel (two channels). A floor of a thousandth of the median keeps the
// noise of black surroundings down.
struct EdgeField {
  core::Image slope;
  double factor = 1;
};

// The longer side of the picture in which evidence is looked for, pixels.
inline constexpr int kEvidenceSide = 1536;

// How much a picture is reduced to look for evidence in it.
double EvidenceFactor(const core::Image& picture);

// `picture`: one channel, radiance on any scale. Reduced by means over areas, then blurred by a
// Gaussian of 0.6 pixels.
EdgeField FindEdges(const core::Image& picture, double factor);

// The share of directions from the centre, `apart` reduced pixels of the rim apart, in which an
// edge runs along the rim of the circle (pixels of the picture itself): within 0.6 reduced pixels
// of it the slope is steepest, more than 3 % per pixel, and it points along the radius within 11.5
// degrees. How steep it is does not matter otherwise, so that neither lamps nor windows outvote a
// rim that is faint but whole. Of directions that leave the picture none counts.
//
// With `besides`, edges within two reduced pixels of that other circle do not count either.
double ShareOnEdge(const EdgeField& edges, const ProbeOptics& optics, const Circle& circle,
                   double apart = 1, const Circle* besides = nullptr);

// That share, and what it is of circles of the same size anywhere in the same picture.
struct RimEvidence {
  double share = 0;
  double by_chance = 0;  // mean of 200 circles of that radius, places drawn by a fixed seed
  double standing = 0;   // (share - by_chance) in their standard deviations
};

RimEvidence Evidence(const EdgeField& edges, const ProbeOptics& optics, const Circle& circle,
                     const Circle* besides = nullptr);

}  // namespace luxfield::reconstruct
