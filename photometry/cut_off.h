// Where the cut-off of a headlamp's beam is and how sharp it is (regulation.h; UN R149 Annex 6).
//
// The cut-off on a scan lies where the straight line that fits G best at five places, 0.05 degrees
// apart, is level in the middle of them: where, with G the gradient of regulation.h,
//
//   a(x) = sum t G(x + 0.05 t) = 0,   t = -2 ... 2
//
// a smooth function of what is measured, which the place of the largest G is not. To first order
//
//   dx = -da(x) / a'(x)
//
// with a' over as far as noise moves the place, x -+ sqrt(3) u(x), the outer nodes of a Gaussian rule of
// three: over more a peak of G bends, over less a(x) may have steps of the texels.
//
// Where a light field blurs the cut-off, darkness begins nowhere, and G grows until the last light is
// gone. Then the cut-off is where illuminance itself falls most steeply, D in the place of G,
//
//   D = E(x) - E(x + 0.1)
//
// which a blur that is alike to both sides leaves in its place.
#pragma once

#include <optional>

#include "luxfield/photometry/beam.h"

namespace luxfield::photometry {

struct CutOff {
  Place place;
  double gradient = 0;            // the largest on the scan
  Place steepest;                 // of the pair that has it, the brighter place
  double brightest = 0;           // the largest value on the scan, cd
  bool has_gradient_peak = true;  // else its place is that of the steepest fall of E
};

// Left out are pairs whose darker side is below a hundredth of the brightest on the scan or of
// `brightest`, cd, whichever is more, since the logarithm of darkness has no bounds, and those that the
// light field does not show all of. Absent: the scan has no such light, or nowhere gets darker.
std::optional<CutOff> FindCutOff(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                                 const CutOffScan& scan, double brightest = 0);

// Weights of the gradient, and of how far along the scan the cut-off is (degrees, towards the dark).
// The second is empty where gradients about the largest are those of no peak.
Functional GradientOf(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                      const CutOffScan& scan, const CutOff& cut_off);
Functional ShiftOf(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                   const CutOffScan& scan, const CutOff& cut_off);

}  // namespace luxfield::photometry
