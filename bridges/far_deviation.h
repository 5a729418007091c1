// How far a light that knows no near field is from a light field.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::bridges {

struct FarDeviation {
  double distance_m = 0;
  // Largest deviation over directions with more than a hundredth of the peak, on surfaces that face
  // the lamp's origin, of the largest illuminance at that distance.
  double largest = 0;
};

// At 0.1, 0.3, 1, 3 and 10 m, of those beyond the supports on F. `illuminance` is that of the light at
// p on a surface with the unit normal n; `fields` have one channel (formats::LuminanceOf).
std::vector<FarDeviation> DeviationsOf(
    std::span<const lightfield::PosedLightField> fields,
    const std::function<double(lightfield::Vec3 p, lightfield::Vec3 n)>& illuminance);

}  // namespace luxfield::bridges
