// How a headlamp is aimed before it is measured, by its cut-off or its peak (UN R149 Annexes 5 and 6).
//
// An aim (h, v) solves f(h, v, C) = 0, f how far the cut-off is from where it should be, so that
//
//   d(h, v) = -J^-1 df,   J = df / d(h, v)
//
// with df by the shifts of the cut-off on its scans (cut_off.h).
#pragma once

#include <string>
#include <vector>

#include "luxfield/photometry/cut_off.h"

namespace luxfield::photometry {

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
