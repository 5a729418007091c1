// Illuminance on planes of many points, exact, with the sums that points of a line share done once
// (lightfield/light_vector_rows.h): docs/performance.md has what a million points take.
#pragma once

#include <vector>

#include "luxfield/photometry/asked.h"
#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

// [row][column], row 0 at the top. Fast where an edge of the plane lies along x of a field's frame,
// faster where the other lies along its y; points whose horizon cuts the lamp are done one by one.
std::vector<double> IlluminanceOn(const Lamp& lamp, const PlaneAsked& plane);

// The light vector, towards the light, without regard to a horizon; as fast.
std::vector<lightfield::Vec3> LightVectorsOn(const Lamp& lamp, const PlaneAsked& plane);

// What takes in light on it, its normal the plane's if it is one.
PointReceiver ReceiverOn(const PlaneAsked& plane);

// What the plane's receiver takes in: IlluminanceOn, or point by point for the other shapes.
std::vector<double> ReceivedOn(const Lamp& lamp, const PlaneAsked& plane);

// The mean of ReceivedOn as weights.
Functional MeanReceivedOn(const Lamp& lamp, const PlaneAsked& plane);

}  // namespace luxfield::photometry
