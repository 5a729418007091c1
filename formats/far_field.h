// The far field of a light field, or its intensity at a distance, as a photometric table of type C
// (axes: docs/axes.md).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "luxfield/formats/photometric.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::formats {

// Luminous intensity (luminance of three channels) in a unit direction of the luminaire's frame:
// the far field's, or, with a distance D from the frame's origin, what a photometer that faces the
// origin there takes for it:
//
//   I = E(D direction) D^2
double IntensityOf(std::span<const lightfield::PosedLightField> fields, lightfield::Vec3 direction,
                   std::optional<double> distance_m);

// The table at these angles. Opening: the bounding rectangle of the filter planes' supports, in the
// luminaire's frame. Keywords: where it comes from, and the distance as NEARFIELD.
Photometry FarFieldTable(std::span<const lightfield::PosedLightField> fields,
                         const std::vector<double>& planes_deg,
                         const std::vector<double>& angles_deg, std::optional<double> distance_m);

}  // namespace luxfield::formats
