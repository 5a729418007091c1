// The far field of a light field, or its intensity at a distance, as a photometric table of type C
// (axes: docs/axes.md). Light fields of three channels are taken by their luminance.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "luxfield/formats/photometric.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::formats {

// The fields' luminance as fields of one channel, C = 0.2126 R + 0.7152 G + 0.0722 B in float32.
std::vector<lightfield::PosedLightField> LuminanceOf(
    std::span<const lightfield::PosedLightField> fields);

// Luminous intensity in a unit direction of the luminaire's frame: the far field's, or, with a
// distance D from the frame's origin, what a photometer that faces the origin there takes for it:
//
//   I = E(D direction) D^2
//
// Where all supports on F lie within D of the origin, its integral over all directions is the flux.
double IntensityOf(std::span<const lightfield::PosedLightField> fields, lightfield::Vec3 direction,
                   std::optional<double> distance_m);

// Largest distance of the supports on F from the luminaire's origin, m.
double ReachOfSupports(std::span<const lightfield::PosedLightField> fields);

// Angles between planes C and between angles gamma; those not given are chosen.
struct FarFieldSteps {
  std::optional<double> plane_deg, angle_deg;
};

struct FarField {
  Photometry table;
  // Largest deviation of the table, interpolated in the middle between two of its planes or angles,
  // from the intensity there; of the peak.
  double plane_error = 0, angle_error = 0;
  // The table's integral over the light field's flux, less 1.
  double flux_error = 0;
  lightfield::Vec3 opening_middle_m;  // of the table's opening, in the luminaire's frame

  // Bound of the deviation in any direction, of the peak. The middle of an interval shows a smooth
  // function's error whole, and of a kink's s f (1 - f) at f it shows s min(f, 1 - f) / 2, at least
  // half.
  double interpolation_error() const { return 2 * (plane_error + angle_error); }
};

// Steps that are not given begin at 5 degrees of C and 1 of gamma and are halved, down to 1.25 and
// 0.25 degrees, while plane_error or angle_error is above 1e-3, or flux_error above 1e-4. Steps
// that are given become the nearest ones that are whole thousandths of a degree, which six digits
// hold up to 360, and divide 90, so that tables have the planes C0, C90, C180 and C270. gamma ends at 90 degrees where all light goes to +z.
//
// Opening: the bounding box, in the luminaire's frame, of the supports on F whose functions have
// more than a thousandth of the largest one's flux. Keywords: TEST and, with a distance, NEARFIELD;
// the middle of the opening where it is not the origin, the unit where it is not lm, and the first
// field's provenance as keywords of the user's. Throws InputError naming `file` where there is no
// light, or where the distance lies within ReachOfSupports.
FarField SampleFarField(std::span<const lightfield::PosedLightField> fields,
                        const FarFieldSteps& steps, std::optional<double> distance_m,
                        const std::string& file);

// Unit of a table's flux: lm, or what the keyword _UNIT says of one that SampleFarField made.
lightfield::FluxUnit FluxUnitOf(const Photometry& table);

// Standard uncertainty of the table's flux and of its peak, from standard deviations of the
// coefficients that are taken as independent of each other:
//
//   var(Q) = sum (w sigma)^2,   Q = sum w C
//
// The Gram system leaves neighbouring coefficients with opposite errors, so that the flux is known
// better than that. What all coefficients share, as a light meter's error, is not in it.
struct FarFieldUncertainty {
  double flux = 0, peak = 0;
};

// `sigma`: fields of the same geometry, whose coefficients are standard deviations. Throws
// InputError naming `file` where they are not of that geometry.
FarFieldUncertainty PropagateSigma(std::span<const lightfield::PosedLightField> fields,
                                   std::span<const lightfield::PosedLightField> sigma,
                                   const Photometry& table, std::optional<double> distance_m,
                                   const std::string& file);

}  // namespace luxfield::formats
