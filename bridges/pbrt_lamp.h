// A lamp as lights of pbrt-v4 (Pharr, Jakob, Humphreys 2023): projectors that carry its near field, and
// its far field as one goniometric light.
//
// Projectors (pbrt's 12.2.2): one in the middle m of each knot cell of F, with the far field of the
// cell's light in the unit (W, lm) sr^-1 by the texel s that it shines through,
//
//   I(s) = delta^2 / cos^3(theta) integral_cell sum_ij C_ij(s + u - m) Phi_ij(u) du
//
// Far away their sum is the lamp's far field; near it, each cell shines from its middle and is blurred by
// its own size. Projectors of pbrt look along the middle of their picture; a shear of the light's
// transformation lets all of them look at the same window of I.
//
// The goniometric light (12.2.3) holds the far field by direction in the equal-area mapping of the sphere
// to the square (Clarberg 2008). With (x, y) the place of a pixel's middle in [-1, 1]^2, row 0 at y = -1,
//
//   s = 1 - |x| - |y|,   r = 1 - |s|,   phi = pi/4 ((|y| - |x|) / r + 1)
//   direction = (sign(x) cos(phi) r sqrt(2 - r^2), sign(y) sin(phi) r sqrt(2 - r^2), sign(s) (1 - r^2))
//
// in pbrt's frame of the light, whose y and z are the luminaire's z and y. pbrt takes the nearest pixel:
// 0.1 to 0.2 degrees of 1024 x 1024.
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
  // NAME.pbrt, NAME.pbrt.far.pbrt, NAME.pbrt.far.exr, then the projectors' pictures in the folder
  // NAME.pbrt.pictures.
  std::vector<std::filesystem::path> files;
  int projectors = 0;
  double negative_share = 0;  // of the flux, which the projectors leave out
  std::vector<FarDeviation> near, far;
};

// Writes NAME.pbrt, the projectors, and NAME.pbrt.far.pbrt, the far field, either to be included where the
// transformation is the luminaire's. Intensities below zero become 0. Throws InputError naming `source`
// where there is no light, and naming a file that is in the way (core::RequireOwn).
PbrtLamp WritePbrtLamp(const std::filesystem::path& path,
                       std::span<const lightfield::PosedLightField> fields,
                       const std::string& source);

}  // namespace luxfield::bridges
