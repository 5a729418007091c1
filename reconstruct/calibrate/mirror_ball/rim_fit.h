// The rim of a mirroring ball or of a fisheye's picture, to a fraction of a pixel.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/probe_optics.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_edges.h"

namespace luxfield::reconstruct {

// The edge that is seen along one ray.
struct RimPoint {
  lightfield::Vec2 p;
  bool seen = false;
  bool on_rim = false;  // within a pixel or a hundredth of the radius of the fit
};

struct RimFit {
  Circle circle;
  Circle sigma;            // standard errors of x, y and radius
  int rays = 0, used = 0;  // rays from the centre; those on which the rim was seen and believed
  int on_rim = 0;
  double residual_px = 0;        // robust standard deviation of the rim's points about the fit
  std::vector<RimPoint> points;  // of the rays
  RimEvidence evidence;          // that this is a rim
  bool told = false;             // where to look for it
};

// `picture`: one channel, radiance on any scale. Without a start the circle is searched for: of the
// candidates of rim_search.h the outermost about the best of those that stand out at least 0.6
// times as far as it does, since what a ball mirrors makes rings within its rim. From the start on:
// on rays two pixels apart at the rim a profile of eight pixels is fitted by an edge, blurred as
// pixels are, with a level outside and, inside, a level and two orders of what the picture does
// next to it: powers of the root of the distance for a ball (the direction that it mirrors turns
// with it), of the distance for a lens; then optics.RimDistance is fitted to the edges by
// Gauss-Newton with Tukey's weights (c = 4.685), four times with a narrowing window.
//
// Standard errors are those of the weighted fit times the residuals' integrated autocorrelation
// along the rim and, in quadrature, what the second order moves the fit by: 37 degrees of the world
// lie within five pixels of the rim of a ball of 200, and no series ends there. Throws InputError
// naming `file` if nothing is round. What is found may still be a piece of wall: RequireRim.
RimFit FitRim(const core::Image& picture, const ProbeOptics& optics, std::optional<Circle> start,
              const std::string& file);

// An edge so near to the circle is on it, pixels.
double RimTolerance(const Circle& circle);

// Throws InputError naming `file` and what was found unless edges run along the rim on so large a
// share of it that this stands out from circles of the same size elsewhere in the picture by
// kLeastStanding of their standard deviations. The best of all circles in pictures of bricks and
// windows without a ball stand out by 6 at most, of places that are told by 3.3
// (tests/reconstruct/rim_fit_test.cc prints both): one place is looked at there, not thousands.
inline constexpr double kLeastStanding = 8, kLeastStandingTold = 5;
void RequireRim(const RimFit& rim, const std::string& file);

}  // namespace luxfield::reconstruct
