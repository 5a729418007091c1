// Veiling glare: light that lens and housing scatter from where it belongs to elsewhere on the
// sensor.
#pragma once

#include <vector>

namespace luxfield::hal::sim {

// E'(p) = (1 - share) E(p) + share sum_q K(p - q) E(q),   K(x, y) = k(x) k(y),
// k(n) = (1 - a) / (1 + a) a^|n|,   a = exp(-1 / reach_px)
//
// What K carries beyond the sensor's edge is lost.
struct Glare {
  double share = 0;     // of all light; 0: none
  double reach_px = 1;  // over which K falls to 1 / e along an axis

  // `pixels` is row-major. Two recursive passes per axis, in double.
  void Veil(int width, int height, std::vector<float>& pixels) const;
};

}  // namespace luxfield::hal::sim
