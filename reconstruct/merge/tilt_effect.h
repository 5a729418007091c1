// What merging leaves out of a geometry that was calibrated: it takes the filter as parallel to I
// and the stage's travel as parallel to both (docs/theory.md 3, "Planes that are not parallel").
//
// Filter tilted by (a, b) (geometry_fit.h), place q on I from the filter's axis, first order:
//
//   dE / E = (b q_s - a q_t) / delta    behind an evenly lit filter
//
// and the filter looks stretched by as much. Travel with slopes g: at position c the filter and I
// stand g . c nearer to or farther from the luminaire, and rays pass its plane beside where they
// are taken to, by q g . c / delta.
#pragma once

#include <string>

#include "luxfield/reconstruct/bracket/session_plan.h"

namespace luxfield::reconstruct {

struct TiltEffect {
  double light = 0;         // |dE / E| at the worst texel and position
  double displacement = 0;  // of the filter against the rays, there, in basis spacings
  // What the calibration's own uncertainty does, which the error budget's geometry row holds, for
  // comparison: 2 sigma(delta) / delta of E, and the largest sigma of a place on I, in spacings.
  double stated_light = 0, stated_displacement = 0;

  bool BeyondStated() const { return light > stated_light || displacement > stated_displacement; }
};

// Of plan.tilts, which must be there.
TiltEffect EffectOfTilts(const SessionPlan& plan);

// For people: how large, that it is not corrected, and what to do where it is beyond what is
// stated.
std::string TextOf(const TiltEffect& effect);

}  // namespace luxfield::reconstruct
