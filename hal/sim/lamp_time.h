// How a lamp's output changes with time.
#pragma once

#include <cstdint>

namespace luxfield::hal::sim {

struct LampTime {
  // Warm-up: 1 + excess * exp(-t / tau) after switching on (LEDs start brighter).
  double warm_up_excess = 0, warm_up_tau_s = 600;
  // Drift: 1 + slope * t + amplitude * sin(2 pi t / period + phase).
  double drift_per_hour = 0, drift_amplitude = 0, drift_period_s = 1800, drift_phase_rad = 0;
  // PWM: on for `duty` of each period at 1/duty of the mean power; 0 Hz: direct current.
  double pwm_hz = 0, pwm_duty = 1;

  // Mean output over [start, start + duration] seconds after switching on, relative to the settled
  // lamp; the slow terms at mid-exposure, PWM exactly. duration 0: without PWM.
  double MeanFactor(double start_s, double duration_s) const;
};

}  // namespace luxfield::hal::sim
