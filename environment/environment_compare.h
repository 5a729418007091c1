// How far two environment maps are from each other, whatever their layouts.
#pragma once

#include <optional>

#include "luxfield/environment/cube_map.h"

namespace luxfield::environment {

struct EnvironmentDifference {
  // integral of |A - B| dw over that of B, all channels together.
  double relative = 0;
  // Largest over the channels of |mean A - mean B| over the mean of B.
  double mean = 0;
  // Largest over 24 orientations of |E_A - E_B| over the mean E_B, of the luminance.
  double irradiance = 0;
  // The least `relative` that A has when it is turned or mirrored by another symmetry of the cube,
  // of those by which B differs from itself more than twice as much as from A: a wrong orientation
  // would be seen by it. Absent if there is none.
  std::optional<double> turned;
};

// Of maps of one face size; throws InputError otherwise, and if B is black. In double.
EnvironmentDifference CompareEnvironments(const CubeMap& a, const CubeMap& b);

}  // namespace luxfield::environment
