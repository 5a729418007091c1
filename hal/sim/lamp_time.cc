#include "luxfield/hal/sim/lamp_time.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace luxfield::hal::sim {

double LampTime::MeanFactor(double start_s, double duration_s) const {
  const double t = start_s + 0.5 * duration_s;
  double factor = 1 + warm_up_excess * std::exp(-t / warm_up_tau_s);
  factor *= 1 + drift_per_hour * t / 3600 +
            drift_amplitude * std::sin(2 * std::numbers::pi * t / drift_period_s + drift_phase_rad);
  if (pwm_hz > 0 && duration_s > 0) {
    // Time on since an arbitrary period's start, as a function of phase in periods.
    const auto on = [&](double periods) {
      const double whole = std::floor(periods);
      return whole * pwm_duty + std::min(periods - whole, pwm_duty);
    };
    const double periods = duration_s * pwm_hz, begin = start_s * pwm_hz;
    factor *= (on(begin + periods) - on(begin)) / (periods * pwm_duty);
  }
  return factor;
}

}  // namespace luxfield::hal::sim
