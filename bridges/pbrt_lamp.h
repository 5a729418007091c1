// A lamp's far field as a goniometric light of pbrt-v4 (Pharr, Jakob, Humphreys 2023, 12.2.3), whose
// lights of points know no near field.
//
// The picture beside it holds the luminous intensity by direction in the equal-area mapping of the
// sphere to the square (Clarberg 2008). With (x, y) the place of a pixel's middle in [-1, 1]^2, row 0 at
// y = -1,
//
//   s = 1 - |x| - |y|,   r = 1 - |s|,   phi = pi/4 ((|y| - |x|) / r + 1)
//   direction = (sign(x) cos(phi) r sqrt(2 - r^2), sign(y) sin(phi) r sqrt(2 - r^2), sign(s) (1 - r^2))
//
// in the luminaire's frame, which is the light's. pbrt takes the nearest pixel: 0.1 to 0.2 degrees of
// 1024 x 1024.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "luxfield/bridges/far_deviation.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::bridges {

// The direction of a place in [-1, 1]^2.
lightfield::Vec3 EqualAreaDirection(double x, double y);

struct PbrtLamp {
  std::vector<std::filesystem::path> files;  // the scene's part, the picture
  std::vector<FarDeviation> deviations;
};

// Writes NAME.pbrt, to be included where the transformation is the lamp's, and NAME.exr. Intensities
// below zero become 0. Throws InputError naming `source` where there is no light.
PbrtLamp WritePbrtLamp(const std::filesystem::path& path,
                       std::span<const lightfield::PosedLightField> fields,
                       const std::string& source);

}  // namespace luxfield::bridges
