// Whether a lamp flickers: how much frames of one exposure time differ, against what their noise
// explains (docs/lab.md, "Pulsed light").
//
// A frame of exposure T of a lamp that is on for the share D of each period 1/f, begun at a phase
// of its own, is off by at most (1 - D) / (f T), and by nothing where f T is whole. With level x_n
// of frame n of N,
//
//   s^2 = sum (x_{n+1} - x_n)^2 / (2 (N - 1)),   scatter^2 = s^2 - noise^2,
//
// the mean square successive difference (J. von Neumann et al., Ann. Math. Statist. 12, 1941),
// which a lamp that drifts slowly does not raise; its standard error is about
// s^2 sqrt(3 / (N - 1)). The shutter's jitter is in it too. No lamp of 50 Hz and more keeps step
// with frames that begin at irregular times (FlickerWait).
#pragma once

#include <span>

#include "luxfield/hal/devices.h"

namespace luxfield::capture {

struct Scatter {
  double rms = 0;        // beyond noise, relative to the mean; 0: s^2 is below noise^2
  double noise = 0;      // rms that photons and read-out explain, relative
  bool present = false;  // s^2 lies more than four standard errors above noise^2
  bool light = false;    // the mean lies more than five noises above black
};

// `level_dn`: mean over `pixels` pixels of each frame, two frames at least.
Scatter ScatterOf(std::span<const double> level_dn, double pixels,
                  const rig::SensorModel& calibration);

// Before frame n of a burst: spread over (0, 20 ms), the golden ratio's multiples modulo 1.
double FlickerWait(int n);

}  // namespace luxfield::capture
