#include "reconstruct/excluded_samples.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/parallel.h"
#include "reconstruct/simd.h"

namespace luxfield::reconstruct {
namespace {

constexpr std::uint8_t kNeighbour = 1, kTail = 2;
constexpr int kWindow = 4;
constexpr double kSigmas = 3, kExposureError = 0.002;
constexpr double kDecays = 5;  // decay lengths that a tail which was left out is taken to hold
constexpr int kGrainRows = 32;

// Sets 1 where a sample is clipped or not a number; whether any is.
template <typename T>
LUXFIELD_INLINE bool MarkRun(const T* y, std::size_t count, float saturation_dn,
                             std::uint8_t* out) {
  std::uint8_t any = 0;
  LUXFIELD_INDEPENDENT
  for (std::size_t p = 0; p < count; ++p) {
    const float value = static_cast<float>(y[p]);
    out[p] = static_cast<std::uint8_t>((value < saturation_dn ? 0 : 1) |
                                       (value >= std::numeric_limits<float>::lowest() ? 0 : 1));
    any |= out[p];
  }
  return any != 0;
}

LUXFIELD_SIMD_CLONES bool MarkRow(const core::RawFrame& frame, std::size_t first, std::size_t count,
                                  double saturation_dn, std::uint8_t* out) {
  const auto saturation = static_cast<float>(saturation_dn);
  return frame.value.empty() ? MarkRun(frame.dn.data() + first, count, saturation, out)
                             : MarkRun(frame.value.data() + first, count, saturation, out);
}

// out[column] = kNeighbour where a pixel of the three rows is clipped among the 9 around.
LUXFIELD_SIMD_CLONES void Dilate(const std::uint8_t* above, const std::uint8_t* middle,
                                 const std::uint8_t* below, int width, std::uint8_t* out) {
  const auto any = [&](int column) __attribute__((always_inline)) {
    return static_cast<std::uint8_t>(above[column] | middle[column] | below[column]);
  };
  out[0] = static_cast<std::uint8_t>(any(0) | any(std::min(1, width - 1)));
  LUXFIELD_INDEPENDENT
  for (int column = 1; column < width - 1; ++column)
    out[column] = static_cast<std::uint8_t>(any(column - 1) | any(column) | any(column + 1));
  out[width - 1] = static_cast<std::uint8_t>(any(width - 1) | any(std::max(width - 2, 0)));
}

// 1 where a run of seeds ends: a seed without one on either side.
LUXFIELD_SIMD_CLONES void MarkEnds(const std::uint8_t* before, const std::uint8_t* seed,
                                   const std::uint8_t* after, int width, std::uint8_t* ends) {
  LUXFIELD_INDEPENDENT
  for (int column = 0; column < width; ++column)
    ends[column] = seed[column] & static_cast<std::uint8_t>(~(before[column] & after[column]));
}

LUXFIELD_SIMD_CLONES void JoinTails(const std::uint8_t* clipped, const std::uint8_t* plane,
                                    int width, std::uint8_t* seed) {
  LUXFIELD_INDEPENDENT
  for (int column = 0; column < width; ++column)
    seed[column] = clipped[column] | (plane[column] & kTail ? 1 : 0);
}

// The first end from `column` on, or the width; eight at a time where there is none.
int NextEnd(const std::vector<std::uint8_t>& ends, int column) {
  const auto width = static_cast<int>(ends.size());
  for (std::uint64_t eight = 0; width - column >= 8; column += 8) {
    std::memcpy(&eight, ends.data() + column, 8);
    if (eight != 0) break;
  }
  while (column < width && ends[column] == 0) ++column;
  return column;
}

}  // namespace

ExcludedSamples::ExcludedSamples(const SensorModel& sensor, std::span<const Exposure> longest_first)
    : sensor_(sensor), exposures_(longest_first), planes_(longest_first.size()) {
  for (const Exposure& e : exposures_)
    k_.push_back(sensor.gain_dn_per_e * e.exposure_s * e.attenuation * e.lamp_factor);
  for (std::size_t n = exposures_.size(); n-- > 0;) {
    if (!AnyClipped(n)) continue;
    MarkClipped(n);
    FollowColumns(n);
    FollowRows(n);
  }
  clipped_.reset();
}

bool ExcludedSamples::AnyClipped(std::size_t n) const {
  const std::size_t width = static_cast<std::size_t>(sensor_.width);
  std::atomic<bool> any = false;
  core::ParallelFor(sensor_.height, kGrainRows, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> row(width);
    for (; begin < end && !any; ++begin)
      if (MarkRow(*exposures_[n].frame, begin * width, width, sensor_.saturation_dn, row.data()))
        any = true;
  });
  return any;
}

void ExcludedSamples::MarkClipped(std::size_t n) {
  const int width = sensor_.width, height = sensor_.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  if (!clipped_) clipped_ = std::make_unique_for_overwrite<std::uint8_t[]>(pixels);
  planes_[n] = std::make_unique_for_overwrite<std::uint8_t[]>(pixels);
  const auto mark = [&](int row, std::uint8_t* out) {
    MarkRow(*exposures_[n].frame, static_cast<std::size_t>(row) * width, width,
            sensor_.saturation_dn, out);
  };
  core::ParallelFor(height, kGrainRows, [&](std::size_t first, std::size_t last) {
    const auto begin = static_cast<int>(first), end = static_cast<int>(last);
    const auto at = [&](int row) { return clipped_.get() + static_cast<std::size_t>(row) * width; };
    // The rows beside these are another piece's to keep.
    std::vector<std::uint8_t> above(width), below(width);
    if (begin > 0) mark(begin - 1, above.data());
    if (end < height) mark(end, below.data());
    for (int row = begin; row < end; ++row) mark(row, at(row));
    for (int row = begin; row < end; ++row)
      Dilate(row > begin ? at(row - 1) : above.data(), at(row),
             row + 1 < end ? at(row + 1) : below.data(), width,
             planes_[n].get() + static_cast<std::size_t>(row) * width);
  });
}

void ExcludedSamples::FollowColumns(std::size_t n) {
  const int width = sensor_.width, height = sensor_.height;
  const std::vector<std::uint8_t> beyond(width, 1);
  core::ParallelFor(height, kGrainRows, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> ends(width);
    for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
      const std::uint8_t* const here = clipped_.get() + static_cast<std::size_t>(row) * width;
      const std::uint8_t* const above = row > 0 ? here - width : beyond.data();
      const std::uint8_t* const below = row + 1 < height ? here + width : beyond.data();
      MarkEnds(above, here, below, width, ends.data());
      for (int column = 0; (column = NextEnd(ends, column)) < width; ++column) {
        const std::size_t pixel = static_cast<std::size_t>(row) * width + column;
        if (!above[column]) FollowTail(n, pixel, -width, row);
        if (!below[column]) FollowTail(n, pixel, width, height - 1 - row);
      }
    }
  });
}

void ExcludedSamples::FollowRows(std::size_t n) {
  const int width = sensor_.width;
  core::ParallelFor(sensor_.height, kGrainRows, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> seeds(width + 2, 1), ends(width);  // a spare one at either end
    std::uint8_t* const seed = seeds.data() + 1;
    for (std::size_t row = begin; row < end; ++row) {
      const std::size_t first = row * width;
      JoinTails(clipped_.get() + first, planes_[n].get() + first, width, seed);
      MarkEnds(seed - 1, seed, seed + 1, width, ends.data());
      for (int column = 0; (column = NextEnd(ends, column)) < width; ++column) {
        if (!seed[column - 1]) FollowTail(n, first + column, -1, column);
        if (!seed[column + 1]) FollowTail(n, first + column, 1, width - 1 - column);
      }
    }
  });
}

// From a seed outwards over at most `room` pixels; the first one is the seed's neighbour.
void ExcludedSamples::FollowTail(std::size_t n, std::size_t from, std::ptrdiff_t step, int room) {
  const auto pixel = [&](int distance) {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(from) + distance * step);
  };
  // What ran over in the next shorter exposure runs over in this one, and farther.
  int inherited = 0;
  const bool shorter = n + 1 < planes_.size() && planes_[n + 1];
  while (shorter && inherited < room && planes_[n + 1][pixel(inherited + 1)] & kTail) ++inherited;
  int reach = inherited;
  if (inherited > 0)
    reach += static_cast<int>(std::ceil(inherited * std::log(k_[n] / k_[n + 1]) / kDecays));

  for (int first = std::max(2, inherited + 1); first <= room; ++first) {
    Excess sum;
    for (int d = first; d < first + kWindow && d <= room; ++d) {
      const Excess here = ExcessAt(n, pixel(d));
      sum.value += here.value;
      sum.variance += here.variance;
      sum.light += here.light;
    }
    if (!(sum.value > kSigmas * std::sqrt(sum.variance) + kExposureError * sum.light)) break;
    reach = std::max(reach, 2 * (first + kWindow - 1));
  }
  for (int d = 1; d <= std::min(reach, room); ++d)
    std::atomic_ref(planes_[n][pixel(d)]).fetch_or(kTail, std::memory_order_relaxed);
}

double ExcludedSamples::Signal(const Exposure& exposure, std::size_t pixel) const {
  const double dark = exposure.dark ? exposure.dark->mean_dn[pixel]
                                    : sensor_.black_dn + sensor_.gain_dn_per_e *
                                                             sensor_.dark_current_e_per_s *
                                                             exposure.exposure_s;
  return exposure.frame->at(pixel) - dark;
}

double ExcludedSamples::OtherVariance(const Exposure& exposure) const {
  const double gain = sensor_.gain_dn_per_e;
  const double variance = sensor_.read_noise_dn * sensor_.read_noise_dn +
                          sensor_.quantisation_variance_dn2() +
                          gain * gain * sensor_.dark_current_e_per_s * exposure.exposure_s;
  return exposure.dark ? variance * (1 + 1.0 / exposure.dark->count) : variance;
}

ExcludedSamples::Excess ExcludedSamples::ExcessAt(std::size_t n, std::size_t pixel) const {
  if (clipped_[pixel]) return {};
  double signal = 0, k = 0, other = 0;
  for (std::size_t m = n + 1; m < exposures_.size(); ++m) {
    if (!(k_[m] < k_[n]) || (planes_[m] && planes_[m][pixel])) continue;
    signal += Signal(exposures_[m], pixel);
    k += k_[m];
    other += OtherVariance(exposures_[m]);
  }
  if (!(k > 0)) return {};
  const double x = signal / k, light = std::max(x, 0.0), gain = sensor_.gain_dn_per_e;
  const double variance = gain * k_[n] * light + OtherVariance(exposures_[n]),
               of_prediction = (gain * k * light + other) / (k * k);
  return {Signal(exposures_[n], pixel) - k_[n] * x, variance + k_[n] * k_[n] * of_prediction,
          k_[n] * light};
}

}  // namespace luxfield::reconstruct
