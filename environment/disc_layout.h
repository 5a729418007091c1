// Layouts of the sphere on the unit disc q, |q| <= 1, in which only the angle to an axis changes
// with the radius: angular map, mirror ball, fisheye (environment/environment_layouts.h). Internal
// to lightfield/.
#pragma once

#include <optional>
#include <vector>

#include "luxfield/environment/environment_layouts.h"

namespace luxfield::environment {

// A piece of the border of rectangle and disc: a straight line, or an arc of the rim,
// counter-clockwise.
struct DiscPiece {
  lightfield::Vec2 from, to;
  bool is_arc = false;
  double angle = 0;  // of the arc
};

// The border of the part of the rectangle [low, high] within the disc, counter-clockwise, closed;
// empty if there is none.
std::vector<DiscPiece> ClipToDisc(lightfield::Vec2 low, lightfield::Vec2 high);

struct Disc {
  lightfield::Vec3 axis, right, up;  // what the middle shows, and where q.x and q.y point there
  bool is_mirror = false;
  double rim = 0;  // angle to the axis at r = 1

  // w = cos(theta) axis + sin(theta) (q.x right + q.y up) / r, theta = rim r, or 2 asin(r) for the
  // mirror; the density is per area of the picture, a quarter of q's.
  PictureToDirection At(lightfield::Vec2 q) const;
  std::optional<lightfield::Vec2> Find(lightfield::Vec3 unit_direction) const;

  // Over rectangle and disc, by Stokes' theorem,
  //
  //   closed integral of (1 - cos theta) / r^2 (q.x dq.y - q.y dq.x),
  //
  // a smooth integrand (for the mirror 2: exact).
  double SolidAngle(lightfield::Vec2 low, lightfield::Vec2 high) const;

 private:
  double HeightPerSquare(double r) const;  // (1 - cos theta) / r^2
};

// Null for layouts that are no disc.
const Disc* FindDisc(EnvironmentLayout layout);

}  // namespace luxfield::environment
