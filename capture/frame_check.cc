#include "capture/frame_check.h"

#include <algorithm>
#include <cmath>

#include "core/json.h"

namespace luxfield::capture {
namespace {

constexpr std::size_t kFewestPixels = 100;

// Read noise and quantisation, DN.
double NoiseFloor(const hal::CameraCalibration& c, bool adc) {
  return std::sqrt(c.read_noise_dn * c.read_noise_dn + (adc ? 1.0 / 12 : 0.0));
}

}  // namespace

std::vector<char> UsablePixels(const hal::CameraCapabilities& camera,
                               const hal::CameraCalibration& calibration) {
  std::vector<char> usable(static_cast<std::size_t>(camera.width) * camera.height, 1);
  for (const auto& [row, column] : calibration.defects)
    if (row >= 0 && row < camera.height && column >= 0 && column < camera.width)
      usable[static_cast<std::size_t>(row) * camera.width + column] = 0;
  return usable;
}

FrameStatistics Measure(const core::RawFrame& frame, const std::vector<char>& usable,
                        const hal::CameraCalibration& c) {
  FrameStatistics s;
  double sum = 0;
  std::size_t count = 0, saturated = 0, black = 0;
  for (std::size_t k = 0; k < frame.size(); ++k) {
    if (!usable[k]) continue;
    const double dn = frame.at(k);
    sum += dn;
    s.brightest_dn = count == 0 ? dn : std::max(s.brightest_dn, dn);
    saturated += dn >= c.saturation_dn;
    black += dn <= c.black_dn;
    ++count;
  }
  if (count == 0) return s;
  const auto n = static_cast<double>(count);
  s.mean_dn = sum / n;
  s.saturated_share = static_cast<double>(saturated) / n;
  s.black_share = static_cast<double>(black) / n;
  return s;
}

core::Json ToJson(const FrameStatistics& s) {
  return {{"mean_dn", s.mean_dn},
          {"brightest_dn", s.brightest_dn},
          {"saturated_share", s.saturated_share},
          {"black_share", s.black_share}};
}

Rungs ChooseRungs(double rate, const std::vector<double>& ladder_s, const ExposurePolicy& policy,
                  const hal::CameraCalibration& c) {
  const int top = static_cast<int>(ladder_s.size()) - 1;
  Rungs rungs;
  const double room = policy.saturation_share * c.saturation_dn - c.black_dn;
  while (rungs.first < top && rate * ladder_s[rungs.first + 1] <= room) ++rungs.first;
  rungs.last = rungs.first;
  const double needed = policy.floor_sigmas * c.read_noise_dn;
  while (rungs.last < top && policy.relevant_share * rate * ladder_s[rungs.last] < needed)
    ++rungs.last;
  return rungs;
}

std::optional<Probe> ProbeWalk::Next(const Probe& probe, double brightest_dn) const {
  const hal::CameraCalibration& c = calibration;
  if (brightest_dn >= policy.saturation_share * c.saturation_dn)
    return probe.rung > 0 ? std::optional(Probe{probe.rung - 1, true}) : std::nullopt;
  const double dim =
      c.black_dn + std::max(20 * c.read_noise_dn, 0.02 * (c.saturation_dn - c.black_dn));
  if (!probe.came_down && brightest_dn < dim && probe.rung < top)
    return Probe{probe.rung + 1, false};
  return std::nullopt;
}

std::optional<double> LevelRatio(const core::RawFrame& frame, double exposure_s,
                                 const core::RawFrame& shorter, double shorter_exposure_s,
                                 const std::vector<char>& usable, const hal::CameraCalibration& c,
                                 double tolerance) {
  const double noise = NoiseFloor(c, frame.value.empty());
  const double low = c.black_dn + 10 * noise, high = 0.8 * c.saturation_dn;
  double sum = 0, sum_shorter = 0, variance = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < frame.size(); ++k) {
    const double a = frame.at(k), b = shorter.at(k);
    if (!usable[k] || b <= low || b >= high || a >= high) continue;
    sum += a - c.black_dn;
    sum_shorter += b - c.black_dn;
    variance += noise * noise + c.gain_dn_per_e * (b - c.black_dn);
    ++count;
  }
  if (count < kFewestPixels || std::sqrt(variance) > 0.1 * tolerance * sum_shorter)
    return std::nullopt;
  const double dark = c.gain_dn_per_e * c.dark_current_e_per_s * static_cast<double>(count);
  return (sum - dark * exposure_s) / (sum_shorter - dark * shorter_exposure_s) *
         shorter_exposure_s / exposure_s;
}

}  // namespace luxfield::capture
