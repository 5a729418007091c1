// What of a lamp is as bright as a threshold or brighter, as an eye sees it, and how it glares
// (docs/photometry.md, "From an eye").
//
//   omega = integral dw,   A = integral r(w)^2 dw,   L_mean = integral L dw / omega
//
// over the directions w with L(w) >= threshold, r(w) the distance of the place on the filter plane that
// is seen there: A is the projected area of the luminous parts, of a flat one its area times the cosine
// at which it is seen (CIE 232:2019). Noise moves the border of these directions too. To first order,
// for any g(w, L),
//
//   d integral g dw = integral dg/dL dL dw + integral along the border of g(w, threshold) dL / |grad L|
//
// Directions are in the luminaire's frame.
#pragma once

#include <optional>
#include <vector>

#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

// A ray that an integral over the luminous directions is a sum of.
struct BrightRay {
  lightfield::Vec3 w;
  double luminance = 0;    // of one on the border the threshold
  double distance_m = 0;   // of the filter plane along it
  double solid_angle = 0;  // sr; 0 of one on the border
  double moves = 0;        // d solid angle / d luminance, of one on the border
};

// Of a picture of 400 fields across; those on the border are looked at in up to 16 places each.
std::vector<BrightRay> BrightRays(const Lamp& lamp, lightfield::Vec3 eye, double threshold);

struct LuminousArea {
  Estimate solid_angle;        // sr
  Estimate projected_m2;       // A
  Estimate luminance;          // the mean over it
  lightfield::Vec3 direction;  // of its middle, weighed by luminance
};
// Of BrightRays; absent where nothing is bright. Uncertainties are left out where the noise of a single
// ray on the border is more than half of the threshold: there darkness counts as bright in places.
std::optional<LuminousArea> AreaOf(const Lamp& lamp, lightfield::Vec3 eye,
                                   const std::vector<BrightRay>& rays);

// The unified glare rating of what is bright before a background luminance (UnifiedGlareRating), the eye
// looking along `line_of_sight`. Absent where nothing is bright, or where it is seen from the side or
// behind, which the formula is not for; uncertainties as of AreaOf.
std::optional<Estimate> GlareRatingOf(const Lamp& lamp, lightfield::Vec3 eye,
                                      const std::vector<BrightRay>& rays,
                                      lightfield::Vec3 line_of_sight, lightfield::Vec3 up,
                                      double background);

}  // namespace luxfield::photometry
