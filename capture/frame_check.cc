#include "capture/frame_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "core/json.h"
#include "core/parallel.h"

namespace luxfield::capture {
namespace {

constexpr double kFewestPixels = 100;
// Pixels of a block: their sum fits 32 bits, and sums of 32 bits are what compilers vectorise.
constexpr std::size_t kBlock = 1 << 15;
constexpr std::size_t kGrain = 16;  // blocks that a thread takes at once

template <typename Value>
using BlockSum = std::conditional_t<std::is_integral_v<Value>, std::uint32_t, double>;

// Read noise and quantisation, DN.
double NoiseFloor(const hal::CameraCalibration& c, bool adc) {
  return std::sqrt(c.read_noise_dn * c.read_noise_dn + (adc ? 1.0 / 12 : 0.0));
}

// What pixels are compared as, and a bound for it: of whole numbers n, n >= x is n >= ceil(x).
template <typename Value>
using Number = std::conditional_t<std::is_integral_v<Value>, int, double>;
template <typename Value>
Number<Value> Up(double x) {
  return static_cast<Number<Value>>(std::is_integral_v<Value> ? std::ceil(x) : x);
}
template <typename Value>
Number<Value> Down(double x) {
  return static_cast<Number<Value>>(std::is_integral_v<Value> ? std::floor(x) : x);
}

// Lets `look(begin, end, block's total)` see every block of a plane, on all cores, and adds up the
// totals in their order.
template <typename Total, typename Look>
Total AddBlocks(std::size_t pixels, const Look& look) {
  std::vector<Total> totals((pixels + kBlock - 1) / kBlock);
  core::ParallelFor(totals.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t n = first; n < last; ++n)
      look(n * kBlock, std::min((n + 1) * kBlock, pixels), totals[n]);
  });
  Total sum;
  for (const Total& total : totals) sum += total;
  return sum;
}

struct Levels {
  double sum = 0, brightest = -HUGE_VAL;
  std::size_t count = 0, saturated = 0, black = 0;

  void operator+=(const Levels& other) {
    sum += other.sum;
    brightest = std::max(brightest, other.brightest);
    count += other.count;
    saturated += other.saturated;
    black += other.black;
  }
};

template <typename Value>
FrameStatistics MeasurePlane(const std::vector<Value>& plane, const std::vector<char>& usable,
                             const hal::CameraCalibration& c) {
  const auto saturation = Up<Value>(c.saturation_dn), black_level = Down<Value>(c.black_dn);
  constexpr auto kLowest = static_cast<Number<Value>>(std::numeric_limits<Value>::lowest());
  const auto look = [&](std::size_t begin, std::size_t end, Levels& levels) {
    BlockSum<Value> sum = 0;
    auto brightest = kLowest;
    std::uint32_t count = 0, saturated = 0, black = 0;
    for (std::size_t k = begin; k < end; ++k) {
      // Factors in place of conditions, which GCC 12 does not vectorise here.
      const int use = usable[k];
      const Number<Value> dn = plane[k];
      sum += dn * use;
      brightest = std::max(brightest, dn * use + kLowest * (1 - use));
      count += use;
      saturated += (dn >= saturation) & use;
      black += (dn <= black_level) & use;
    }
    levels = {double(sum), double(brightest), count, saturated, black};
  };
  const auto levels = AddBlocks<Levels>(plane.size(), look);
  if (levels.count == 0) return {};
  const auto n = static_cast<double>(levels.count);
  return {levels.sum / n, levels.brightest, static_cast<double>(levels.saturated) / n,
          static_cast<double>(levels.black) / n};
}

// Sums over the pixels that two frames both show well: the shorter one's above `low` and below
// `high`, the other's below `high`.
struct Common {
  double frame = 0, shorter = 0, count = 0;

  void operator+=(const Common& other) {
    frame += other.frame;
    shorter += other.shorter;
    count += other.count;
  }
};
template <typename Value>
Common SumCommon(const std::vector<Value>& frame, const std::vector<Value>& shorter,
                 const std::vector<char>& usable, double low_dn, double high_dn) {
  const auto low = Down<Value>(low_dn), high = Up<Value>(high_dn);
  return AddBlocks<Common>(frame.size(), [&](std::size_t begin, std::size_t end, Common& common) {
    BlockSum<Value> of_frame = 0, of_shorter = 0;
    std::uint32_t count = 0;
    for (std::size_t k = begin; k < end; ++k) {
      const Number<Value> a = frame[k], b = shorter[k];
      const bool use = bool(usable[k]) & (b > low) & (b < high) & (a < high);
      of_frame += use ? frame[k] : Value{0};
      of_shorter += use ? shorter[k] : Value{0};
      count += use;
    }
    common = {double(of_frame), double(of_shorter), double(count)};
  });
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
  return frame.value.empty() ? MeasurePlane(frame.dn, usable, c)
                             : MeasurePlane(frame.value, usable, c);
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
  const Common sums = frame.value.empty()
                          ? SumCommon(frame.dn, shorter.dn, usable, low, high)
                          : SumCommon(frame.value, shorter.value, usable, low, high);
  const double sum = sums.frame - sums.count * c.black_dn,
               sum_shorter = sums.shorter - sums.count * c.black_dn,
               variance = sums.count * noise * noise + c.gain_dn_per_e * sum_shorter;
  if (sums.count < kFewestPixels || std::sqrt(variance) > 0.1 * tolerance * sum_shorter)
    return std::nullopt;
  const double dark = c.gain_dn_per_e * c.dark_current_e_per_s * sums.count;
  return (sum - dark * exposure_s) / (sum_shorter - dark * shorter_exposure_s) *
         shorter_exposure_s / exposure_s;
}

}  // namespace luxfield::capture
