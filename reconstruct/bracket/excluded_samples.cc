#include "luxfield/reconstruct/bracket/excluded_samples.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "luxfield/core/parallel.h"
#include "luxfield/core/simd.h"

namespace luxfield::reconstruct {
namespace {

constexpr int kWindow = 4;
constexpr double kSigmas = 3, kExposureError = 0.002;
constexpr double kDecays = 5;  // decay lengths that a tail which was left out is taken to hold
constexpr int kGrainRows = 32;
constexpr std::uint64_t kAll = ~std::uint64_t{0};

// Clipped, or not a number.
LUXFIELD_INLINE bool Clips(float value, float saturation_dn) {
  return !(value < saturation_dn) || !(value >= std::numeric_limits<float>::lowest());
}

// How many of a word's samples are clipped; of most words none or all are, which their largest and
// smallest tell.
enum class Clipped { kNone, kSome, kEvery };

LUXFIELD_INLINE Clipped HowManyClip(const std::uint16_t* y, float saturation_dn) {
  std::uint16_t largest = 0, smallest = std::numeric_limits<std::uint16_t>::max();
  for (int l = 0; l < kBitsOfWord; ++l) {
    largest = std::max(largest, y[l]);
    smallest = std::min(smallest, y[l]);
  }
  if (!Clips(largest, saturation_dn)) return Clipped::kNone;
  return Clips(smallest, saturation_dn) ? Clipped::kEvery : Clipped::kSome;
}

LUXFIELD_INLINE Clipped HowManyClip(const float* y, float saturation_dn) {
  std::uint32_t any = 0, all = 1;
  for (int l = 0; l < kBitsOfWord; ++l) {
    const std::uint32_t clips = Clips(y[l], saturation_dn) ? 1u : 0u;
    any |= clips;
    all &= clips;
  }
  return !any ? Clipped::kNone : all ? Clipped::kEvery : Clipped::kSome;
}

template <typename T>
LUXFIELD_INLINE std::uint64_t ClippedBits(const T* y, int count, float saturation_dn) {
  std::uint64_t bits = 0;
  for (int l = 0; l < count; ++l)
    bits |= std::uint64_t{Clips(static_cast<float>(y[l]), saturation_dn)} << l;
  return bits;
}

template <typename T>
LUXFIELD_INLINE bool MarkRun(const T* y, int width, float saturation_dn, std::uint64_t* bits) {
  std::uint64_t any = 0;
  for (int column = 0; column < width; column += kBitsOfWord, y += kBitsOfWord, ++bits) {
    if (width - column < kBitsOfWord) {
      *bits = ClippedBits(y, width - column, saturation_dn);
    } else {
      const Clipped clipped = HowManyClip(y, saturation_dn);
      if (clipped == Clipped::kEvery) *bits = kAll;
      if (clipped == Clipped::kSome) *bits = ClippedBits(y, kBitsOfWord, saturation_dn);
    }
    any |= *bits;
  }
  return any != 0;
}

// Sets the bits of a row's clipped samples; whether there are any.
LUXFIELD_SIMD_CLONES bool MarkRow(const session::RawFrame& frame, int row, double saturation_dn,
                                  std::uint64_t* bits) {
  const auto saturation = static_cast<float>(saturation_dn);
  const std::size_t first = static_cast<std::size_t>(row) * frame.width;
  return frame.value.empty() ? MarkRun(frame.dn.data() + first, frame.width, saturation, bits)
                             : MarkRun(frame.value.data() + first, frame.width, saturation, bits);
}

// The bits of the columns before and after those of word w; `beyond` stands for what lies beside
// the row's first and last column.
std::uint64_t Before(const std::uint64_t* bits, int w, bool beyond) {
  return bits[w] << 1 | (w > 0 ? bits[w - 1] >> (kBitsOfWord - 1) : std::uint64_t{beyond});
}

std::uint64_t After(const std::uint64_t* bits, int w, int width, bool beyond) {
  const int last = (width - 1) % kBitsOfWord;
  return bits[w] >> 1 | (w + 1 < PixelBits::WordsOfRow(width) ? bits[w + 1] << (kBitsOfWord - 1)
                                                              : std::uint64_t{beyond} << last);
}

template <typename Body>
void ForRows(int height, const Body& body) {
  core::ParallelFor(height, kGrainRows, [&](std::size_t begin, std::size_t end) {
    for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row) body(row);
  });
}

// body(bit) for those that are set.
template <typename Body>
void ForBits(std::uint64_t bits, const Body& body) {
  for (; bits != 0; bits &= bits - 1) body(std::countr_zero(bits));
}

}  // namespace

ExcludedSamples::ExcludedSamples(const rig::SensorModel& sensor,
                                 std::span<const Exposure> longest_first)
    : sensor_(sensor),
      exposures_(longest_first),
      left_out_(longest_first.size()),
      tails_(longest_first.size()) {
  const double gain = sensor.gain_dn_per_e;
  for (const Exposure& e : exposures_) {
    const double dark_dn = gain * sensor.dark_current_e_per_s * e.exposure_s,
                 variance = sensor.read_noise_dn * sensor.read_noise_dn +
                            sensor.quantisation_variance_dn2() + gain * dark_dn;
    k_.push_back(gain * e.exposure_s * e.attenuation * e.lamp_factor);
    other_variance_.push_back(e.dark ? variance * (1 + 1.0 / e.dark->count) : variance);
    dark_dn_.push_back(sensor.black_dn + dark_dn);
  }
  for (std::size_t n = exposures_.size(); n-- > 0;) {
    if (!MarkClipped(n)) continue;
    tails_[n] = PixelBits(sensor.width, sensor.height);
    FollowColumns(n);
    FollowRows(n);
    JoinNeighboursAndTails(n);
  }
}

bool ExcludedSamples::MarkClipped(std::size_t n) {
  clipped_ = PixelBits(sensor_.width, sensor_.height);
  std::atomic<bool> any = false;
  ForRows(sensor_.height, [&](int row) {
    if (MarkRow(*exposures_[n].frame, row, sensor_.saturation_dn, clipped_.row(row))) any = true;
  });
  return any;
}

void ExcludedSamples::JoinNeighboursAndTails(std::size_t n) {
  const int width = sensor_.width, height = sensor_.height, words = clipped_.words_of_row();
  left_out_[n] = PixelBits(width, height);
  ForRows(height, [&](int row) {
    std::vector<std::uint64_t> three(clipped_.row(row), clipped_.row(row) + words);
    for (const int beside : {row - 1, row + 1})
      if (beside >= 0 && beside < height)
        for (int w = 0; w < words; ++w) three[w] |= clipped_.row(beside)[w];
    std::uint64_t* const out = left_out_[n].row(row);
    for (int w = 0; w < words; ++w)
      out[w] = three[w] | Before(three.data(), w, false) | After(three.data(), w, width, false) |
               tails_[n].row(row)[w];
    out[words - 1] &= PixelBits::LastWord(width);
  });
}

void ExcludedSamples::FollowColumns(std::size_t n) {
  const int height = sensor_.height;
  ForRows(height, [&](int row) {
    for (int w = 0; w < clipped_.words_of_row(); ++w) {
      const std::uint64_t here = clipped_.row(row)[w],
                          above = row > 0 ? clipped_.row(row - 1)[w] : kAll,
                          below = row + 1 < height ? clipped_.row(row + 1)[w] : kAll;
      ForBits(here & ~above, [&](int bit) {
        FollowTail(n, {row, w * kBitsOfWord + bit}, {-1, 0}, row);
      });
      ForBits(here & ~below, [&](int bit) {
        FollowTail(n, {row, w * kBitsOfWord + bit}, {1, 0}, height - 1 - row);
      });
    }
  });
}

void ExcludedSamples::FollowRows(std::size_t n) {
  const int width = sensor_.width, words = clipped_.words_of_row();
  ForRows(sensor_.height, [&](int row) {
    std::vector<std::uint64_t> seeds(clipped_.row(row), clipped_.row(row) + words);
    for (int w = 0; w < words; ++w) seeds[w] |= tails_[n].row(row)[w];
    for (int w = 0; w < words; ++w) {
      ForBits(seeds[w] & ~Before(seeds.data(), w, true), [&](int bit) {
        const int column = w * kBitsOfWord + bit;
        FollowTail(n, {row, column}, {0, -1}, column);
      });
      ForBits(seeds[w] & ~After(seeds.data(), w, width, true), [&](int bit) {
        const int column = w * kBitsOfWord + bit;
        FollowTail(n, {row, column}, {0, 1}, width - 1 - column);
      });
    }
  });
}

// From a seed outwards over at most `room` pixels; the first one is the seed's neighbour.
void ExcludedSamples::FollowTail(std::size_t n, Pixel seed, Pixel step, int room) {
  const auto at = [&](int distance) {
    return Pixel{seed.row + distance * step.row, seed.column + distance * step.column};
  };
  // What ran over in the next shorter exposure runs over in this one, and farther.
  int inherited = 0;
  const bool shorter = n + 1 < tails_.size() && tails_[n + 1];
  while (shorter && inherited < room &&
         tails_[n + 1].at(at(inherited + 1).row, at(inherited + 1).column))
    ++inherited;
  int reach = inherited;
  if (inherited > 0)
    reach += static_cast<int>(std::ceil(inherited * std::log(k_[n] / k_[n + 1]) / kDecays));

  for (int first = std::max(2, inherited + 1); first <= room; ++first) {
    Excess sum;
    for (int d = first; d < first + kWindow && d <= room; ++d) {
      const Excess here = ExcessAt(n, at(d));
      sum.value += here.value;
      sum.variance += here.variance;
      sum.light += here.light;
    }
    if (!(sum.value > kSigmas * std::sqrt(sum.variance) + kExposureError * sum.light)) break;
    reach = std::max(reach, 2 * (first + kWindow - 1));
  }
  for (int d = 1; d <= std::min(reach, room); ++d) {
    const Pixel p = at(d);
    std::atomic_ref(tails_[n].row(p.row)[p.column / kBitsOfWord])
        .fetch_or(std::uint64_t{1} << (p.column % kBitsOfWord), std::memory_order_relaxed);
  }
}

double ExcludedSamples::Signal(std::size_t n, std::size_t pixel) const {
  const Exposure& e = exposures_[n];
  return e.frame->at(pixel) - (e.dark ? e.dark->mean_dn[pixel] : dark_dn_[n]);
}

ExcludedSamples::Excess ExcludedSamples::ExcessAt(std::size_t n, Pixel p) const {
  if (clipped_.at(p.row, p.column)) return {};
  const std::size_t pixel = static_cast<std::size_t>(p.row) * sensor_.width + p.column;
  double signal = 0, k = 0, other = 0;
  for (std::size_t m = n + 1; m < exposures_.size(); ++m) {
    if (!(k_[m] < k_[n]) || At(m, p.row, p.column)) continue;
    signal += Signal(m, pixel);
    k += k_[m];
    other += other_variance_[m];
  }
  if (!(k > 0)) return {};
  const double x = signal / k, light = std::max(x, 0.0), gain = sensor_.gain_dn_per_e;
  const double variance = gain * k_[n] * light + other_variance_[n],
               of_prediction = (gain * k * light + other) / (k * k);
  return {Signal(n, pixel) - k_[n] * x, variance + k_[n] * k_[n] * of_prediction, k_[n] * light};
}

}  // namespace luxfield::reconstruct
