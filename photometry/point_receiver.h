// What takes in light at a point: the side of a small plane, a sphere, a cylinder or half of one, and
// how much falls on it per area (CIE S 017, ILV; EN 12665), L(w) being the radiance seen in direction w:
//
//   Q = integral L(w) k(w) dw
//
//   plane            k = max(0, n.w)                       n: its normal
//   sphere           k = 1/4                               a quarter of the fluence rate
//   cylinder         k = sqrt(1 - (a.w)^2) / pi            a: its axis
//   semicylinder     k = (sqrt(1 - (a.w)^2) + f.w) / pi    f: where it faces, across a
//
// lx of a lamp in lm, W/m^2 of one in W. A plane is as exact as IlluminanceAt, the others are the
// rule of point_nodes.h. Directions are unit vectors in the luminaire's frame.
//
//   const PointReceiver head{.shape = ReceiverShape::kCylinder};
//   const Estimate e = Evaluate(lamp, ReceivedAt(lamp, head, {0.5, 0, 2}));
#pragma once

#include <optional>

#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

enum class ReceiverShape { kPlane, kSphere, kCylinder, kSemicylinder };

struct PointReceiver {
  ReceiverShape shape = ReceiverShape::kPlane;
  std::optional<lightfield::Vec3> normal = {};  // of a plane; absent: towards the origin
  lightfield::Vec3 axis{0, 0, 1};
  lightfield::Vec3 facing{1, 0, 0};
};

Functional ReceivedAt(const Lamp& lamp, const PointReceiver& receiver, lightfield::Vec3 p);

// The value alone, faster.
double ReceivedValue(const Lamp& lamp, const PointReceiver& receiver, lightfield::Vec3 p);

// factor times ReceivedAt, added to weights over all texels (ZeroOf): for sums of many points.
void AddReceived(Functional& sum, double factor, const Lamp& lamp, const PointReceiver& receiver,
                 lightfield::Vec3 p);

}  // namespace luxfield::photometry
