// Circles in a photograph that may be the rim of a ball or of a fisheye's picture.
#pragma once

#include <optional>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/probe_optics.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_edges.h"

namespace luxfield::reconstruct {

struct FoundCircle {
  Circle circle;
  RimEvidence evidence;
};

// At most `most` circles, those first whose evidence stands out most, to about a pixel (of the
// picture reduced to kEvidenceSide where it has more); none where nothing is round. `picture`: one
// channel on any scale.
//
// In the picture reduced to 192, 384, 768 and 1536 pixels, thinned edges of the logarithm vote, for
// each radius from 24 to 56 reduced pixels (in the smallest up to three fifths of its shorter
// side, in the picture's own pixels from 14), for centres along their slopes and up to 11 degrees
// beside them (Hough; Ballard 1981). The circles that stand out most from the votes of their radius
// move uphill in ShareOnEdge, there and in the finer pictures.
std::vector<FoundCircle> SearchCircles(const core::Image& picture, const ProbeOptics& optics,
                                       int most);

// A circle about `circle`, up to 12 % larger, along which edges run besides those of `circle`
// itself; none where that stands out by less than 6 standard deviations. What a ball mirrors is
// squeezed into rings just inside its rim, and any of them may be seen better than the rim.
std::optional<Circle> OuterCircle(const EdgeField& edges, const ProbeOptics& optics,
                                  const Circle& circle);

}  // namespace luxfield::reconstruct
