#include "luxfield/capture/lamp/flicker.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace luxfield::capture {

Scatter ScatterOf(std::span<const double> level_dn, double pixels, const rig::SensorModel& c) {
  const auto frames = static_cast<double>(level_dn.size());
  double mean = 0, squares = 0;
  for (const double level : level_dn) mean += level / frames;
  for (std::size_t n = 1; n < level_dn.size(); ++n) {
    const double step = level_dn[n] - level_dn[n - 1];
    squares += step * step;
  }
  const double signal = mean - c.black_dn, variance = squares / (2 * (frames - 1));
  const double noise =
      (c.gain_dn_per_e * std::max(0.0, signal) + c.read_noise_dn * c.read_noise_dn + 1.0 / 12) /
      pixels;
  Scatter scatter;
  scatter.light = signal > 5 * std::sqrt(noise);
  if (!scatter.light) return scatter;
  scatter.rms = std::sqrt(std::max(0.0, variance - noise)) / signal;
  scatter.noise = std::sqrt(noise) / signal;
  scatter.present = variance > noise * (1 + 4 * std::sqrt(3 / (frames - 1)));
  return scatter;
}

double FlickerWait(int n) {
  constexpr double kLongestWait_s = 0.02;
  const double turns = (n + 1) / std::numbers::phi;
  return kLongestWait_s * (turns - std::floor(turns));
}

}  // namespace luxfield::capture
