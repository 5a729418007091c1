// The cut-off of a headlamp's beam and how it is aimed by it (regulation.h; UN R149 Annexes 5 and 6).
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
// An aim (h, v) solves f(h, v, C) = 0, f how far the cut-off is from where it should be, so that
//
//   d(h, v) = -J^-1 df,   J = df / d(h, v)
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/photometry/beam.h"

namespace luxfield::photometry {

struct CutOff {
  Place place;
  double gradient = 0;  // the largest on the scan
  Place steepest;       // of the pair that has it, the brighter place
};

// Left out are pairs whose darker side is below a thousandth of the brightest on the scan, since the
// logarithm of darkness has no bounds, and those that the light field does not show all of. Absent: the
// scan has no light, or nowhere gets darker.
std::optional<CutOff> FindCutOff(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                                 const CutOffScan& scan);

// Weights of the gradient, and of how far along the scan the cut-off is (degrees, towards the dark).
// The second is empty where gradients about the largest are those of no peak.
Functional GradientOf(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                      const CutOffScan& scan, const CutOff& cut_off);
Functional ShiftOf(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                   const CutOffScan& scan, const CutOff& cut_off);

struct Aim {
  BeamFrame frame;        // H = V = 0 of the aimed lamp
  Place turned;           // where that lies in the frame of the lamp
  Functional of_h, of_v;  // weights of both angles; empty: not known, or there is no noise
  std::vector<std::string> remarks;
};

// `receiver` is that of the cut-off. What cannot be aimed (no cut-off, or too faint a gradient
// sideways) is left as it is, with a remark.
Aim AimOf(const Lamp& lamp, const Receiver& receiver, const Aiming& aiming, const BeamFrame& frame);

}  // namespace luxfield::photometry
