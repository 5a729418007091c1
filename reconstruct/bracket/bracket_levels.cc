#include "luxfield/reconstruct/bracket/bracket_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "luxfield/core/error.h"

namespace luxfield::reconstruct {
namespace {

constexpr std::size_t kFewestPixels = 100, kMostPixels = 1 << 18;
constexpr double kClearOfNoise = 10, kClearOfSaturation = 0.8, kShareOfTolerance = 0.1;

void RequireSize(const rig::SensorModel& sensor, const Exposure& exposure) {
  const session::RawFrame& frame = *exposure.frame;
  if (frame.width == sensor.width && frame.height == sensor.height) return;
  throw InputError(fmt::format(
      "a frame of {} x {} pixels does not fit the sensor of {} x {}; run `luxfield verify` on the "
      "session",
      frame.width, frame.height, sensor.width, sensor.height));
}

double DnPerRate(const rig::SensorModel& sensor, const Exposure& e) {
  return sensor.gain_dn_per_e * e.exposure_s * e.attenuation * e.lamp_factor;
}

double DarkSignal(const rig::SensorModel& sensor, const Exposure& e, std::size_t pixel) {
  return e.dark
             ? e.dark->mean_dn[pixel]
             : sensor.black_dn + sensor.gain_dn_per_e * sensor.dark_current_e_per_s * e.exposure_s;
}

// The sum of one frame's light over pixels, DN, and its variance without that of the noise floor.
struct Light {
  double sum = 0, variance = 0;
  double RelativeVariance(double floor_variance) const {
    return (variance + floor_variance) / (sum * sum);
  }
};

// Groups of frames that agree: each points to another one of its group, the root to itself.
class Groups {
 public:
  explicit Groups(std::size_t count) : next_(count) { std::iota(next_.begin(), next_.end(), 0); }
  std::size_t Root(std::size_t n) const {
    while (next_[n] != n) n = next_[n];
    return n;
  }
  void Join(std::size_t a, std::size_t b) { next_[Root(a)] = Root(b); }
  // The root of the largest group; none if two are as large.
  std::optional<std::size_t> Largest() const {
    std::vector<std::size_t> sizes(next_.size());
    for (std::size_t n = 0; n < next_.size(); ++n) ++sizes[Root(n)];
    const auto largest = std::max_element(sizes.begin(), sizes.end());
    if (std::count(sizes.begin(), sizes.end(), *largest) > 1) return {};
    return static_cast<std::size_t>(largest - sizes.begin());
  }

 private:
  std::vector<std::size_t> next_;
};

}  // namespace

std::optional<double> LevelRatio(const rig::SensorModel& sensor, const Exposure& a,
                                 const Exposure& b, double tolerance) {
  RequireSize(sensor, a);
  RequireSize(sensor, b);
  const double floor_variance =
      sensor.read_noise_dn * sensor.read_noise_dn + sensor.quantisation_variance_dn2();
  const double least = kClearOfNoise * std::sqrt(floor_variance),
               most_dn = kClearOfSaturation * sensor.saturation_dn;
  std::vector<bool> defect(a.frame->size());
  for (const auto& [row, column] : sensor.defects)
    defect[static_cast<std::size_t>(row) * sensor.width + column] = true;
  Light of_a, of_b;
  std::size_t count = 0;
  // An odd step sees all colours of a mosaic.
  const std::size_t step = defect.size() / kMostPixels | 1;
  for (std::size_t p = 0; p < defect.size(); p += step) {
    const double y_a = a.frame->at(p), y_b = b.frame->at(p);
    const double x_a = y_a - DarkSignal(sensor, a, p), x_b = y_b - DarkSignal(sensor, b, p);
    const bool well = y_a <= most_dn && y_b <= most_dn && x_a >= least && x_b >= least;
    if (!well || defect[p]) continue;
    ++count;
    of_a.sum += x_a;
    of_b.sum += x_b;
    of_a.variance += sensor.gain_dn_per_e * x_a;
    of_b.variance += sensor.gain_dn_per_e * x_b;
  }
  if (count < kFewestPixels) return {};
  const double floor = static_cast<double>(count) * floor_variance;
  const double relative = of_a.RelativeVariance(floor) + of_b.RelativeVariance(floor);
  if (!(std::sqrt(relative) <= kShareOfTolerance * tolerance)) return {};
  return of_a.sum / DnPerRate(sensor, a) * DnPerRate(sensor, b) / of_b.sum;
}

std::vector<bool> ContradictedFrames(const rig::SensorModel& sensor,
                                     std::span<const Exposure> exposures, double tolerance) {
  const std::size_t count = exposures.size();
  Groups groups(count);
  std::vector<bool> contradicted(count);
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < a; ++b) {
      const auto ratio = LevelRatio(sensor, exposures[a], exposures[b], tolerance);
      if (!ratio) continue;
      if (std::abs(*ratio - 1) <= tolerance)
        groups.Join(a, b);
      else
        contradicted[a] = contradicted[b] = true;
    }
  const auto believed = groups.Largest();
  for (std::size_t n = 0; n < count; ++n)
    if (believed && groups.Root(n) == *believed) contradicted[n] = false;
  return contradicted;
}

}  // namespace luxfield::reconstruct
