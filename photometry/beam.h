// A headlamp's beam by the angles H and V (regulation.h) as a receiver at a distance sees it.
#pragma once

#include <optional>
#include <vector>

#include "luxfield/photometry/functional.h"
#include "luxfield/photometry/regulation.h"

namespace luxfield::photometry {

// Unit vectors of the luminaire's frame at right angles: right = forward x up, the driver's.
struct BeamFrame {
  lightfield::Vec3 forward{0, 0, 1}, right{-1, 0, 0}, up{0, 1, 0};

  // `up` as near as can be to what is given; neither may be along the other.
  static BeamFrame Of(lightfield::Vec3 forward, lightfield::Vec3 up);
  lightfield::Vec3 Direction(Place place) const;
  Place PlaceOf(lightfield::Vec3 direction) const;
  // Whose H = V = 0 is this frame's `place`, turned about `up` first.
  BeamFrame Turned(Place place) const;
};

// A square receiver that faces the lamp, two sides along H. Its value is
//
//   I = r^2 mean E,   cd
//
// the mean by a rule of two nodes along both sides, which for the steepest cut-off that UN R149 allows
// (G = 0.4 per 0.1 degrees, 65 mm at 25 m) is off by 0.1 %, and of more where texels are small beside
// the receiver: else the gradient of a cut-off would have steps as wide as they are.
struct Receiver {
  double distance_m = 0, side_m = 0;
};
double ReceivedValue(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                     Place place);
Functional Received(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                    Place place);

// Values of many receivers side by side on a flat screen at the receiver's distance, for searches. A
// receiver off the middle is farther from the lamp than its own would be: at 25 m to the second order
// of the lamp's size over that, below 1e-4.
class BeamMap {
 public:
  // H and V from `low` to `high` of the frame, at most 60 degrees from its middle.
  BeamMap(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame, Place low,
          Place high);

  // Between the points of a lattice of a third of a receiver; absent beyond the map.
  std::optional<double> At(lightfield::Vec3 direction) const;

 private:
  BeamFrame frame_;
  double x0_ = 0, y1_ = 0, pitch_ = 0;  // tangents: of the first point, and between points
  int columns_ = 0, rows_ = 0;
  std::vector<double> values_;  // [row][column], row 0 at the top
};

}  // namespace luxfield::photometry
