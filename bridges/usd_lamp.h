// A lamp as an OpenUSD layer (*.usda): a UsdLuxRectLight of the size of the lamp's face, shaped by an
// LM-63 profile beside it, and the light field as an asset attribute for programs that know it.
//
// A rectangle of the area A emits the luminance of its profile in every direction, of whose cosine to
// the axis its intensity falls. The profile is therefore
//
//   L(C, gamma) = I(C, gamma) / (A cos gamma)
//
// and the rectangle has the lamp's intensities far away, as far as the profile's angles hold them. Near
// the lamp every part of the face shines alike, which no measured lamp does: `export` says how far the
// illuminance is off at several distances.
//
// The lamp shines along +z of its prim, C0 along +x (docs/axes.md); UsdLux shines along -z, so that the
// rectangle is turned by 180 degrees about x. OpenUSD does not say where C0 of a profile lies; it is
// written for C0 along +x and C90 along +y of the light, as EXT_lights_ies of glTF has it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/bridges/far_deviation.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::bridges {

struct UsdLamp {
  std::vector<std::filesystem::path> files;  // the layer, the profile
  std::vector<FarDeviation> deviations;
};

// Writes NAME.usda and NAME.usda.ies. `source` is the light field's file, which the layer names relative to
// itself. Throws InputError naming `source` where it is not of lm or holds no light, and naming a file
// that is in the way (core::RequireOwn).
UsdLamp WriteUsdLamp(const std::filesystem::path& path, const lightfield::LightField& field,
                     const std::filesystem::path& source);

}  // namespace luxfield::bridges
