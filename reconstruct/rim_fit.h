// The rim of a mirroring ball or of a fisheye's picture, to a fraction of a pixel.
#pragma once

#include <optional>
#include <string>

#include "core/image.h"
#include "reconstruct/probe_optics.h"

namespace luxfield::reconstruct {

struct RimFit {
  Circle circle;
  Circle sigma;            // standard errors of x, y and radius
  int rays = 0, used = 0;  // rays from the centre; those on which the rim was seen and believed
  double residual_px = 0;  // robust standard deviation of the rim's points about the fit
};

// `picture`: one channel, radiance on any scale, whose largest part is about the circle. Without a
// start the circle is searched for: edges of the logarithm vote for centres along their gradients
// (Hough; Ballard 1981) in a reduced picture, then the radius whose circle has the steepest step in
// the mean. From the start on: on rays two pixels apart at the rim a profile of eight pixels is
// fitted by an edge, blurred as pixels are, with a level outside and, inside, a level and two
// orders of what the picture does next to it: powers of the root of the distance for a ball (the
// direction that it mirrors turns with it), of the distance for a lens; then optics.RimDistance is
// fitted to the edges by Gauss-Newton with Tukey's weights (c = 4.685), four times with a narrowing
// window.
//
// Standard errors are those of the weighted fit times the residuals' integrated autocorrelation
// along the rim and, in quadrature, what the second order moves the fit by: 37 degrees of the world
// lie within five pixels of the rim of a ball of 200, and no series ends there. Throws InputError
// naming `file` if no circle stands out, or less than a quarter of the rim is seen.
RimFit FitRim(const core::Image& picture, const ProbeOptics& optics, std::optional<Circle> start,
              const std::string& file);

}  // namespace luxfield::reconstruct
