#include "luxfield/reconstruct/bracket/merge_tile.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/core/simd.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {
namespace {

// A register of pixels: GCC's and Clang's own vectors. Comparisons of them come out lane by lane
// where the baseline has no such vectors: those are loops over arrays instead. Arrays of them state
// their alignment, which is that of the baseline otherwise.
constexpr std::size_t kRegister = kMergeRegisterBytes / sizeof(float);
static_assert(kMergeLanes % kRegister == 0);
typedef float Floats __attribute__((vector_size(kMergeRegisterBytes)));
typedef float FloatsInMemory
    __attribute__((vector_size(kMergeRegisterBytes), aligned(alignof(float)), may_alias));

LUXFIELD_INLINE Floats Load(const float* from) {
  return *reinterpret_cast<const FloatsInMemory*>(from);
}
LUXFIELD_INLINE void Store(Floats values, float* to) {
  *reinterpret_cast<FloatsInMemory*>(to) = values;
}

// Asks for the samples of the next tile, to be there when this one is merged: two streams of every
// exposure are more than the processor follows by itself.
template <typename T>
LUXFIELD_INLINE void PrefetchNext(const T* from) {
  constexpr std::size_t kCacheLine = 64;
  const char* const next = reinterpret_cast<const char*>(from + kMergeLanes);
  for (std::size_t b = 0; b < kMergeLanes * sizeof(T); b += kCacheLine)
    __builtin_prefetch(next + b);
}

// kMergeLanes samples; no `dark`: the model's.
template <typename T>
LUXFIELD_INLINE void LoadRun(const T* y, const float* dark, const MergeScale& scale,
                             const MergeModel& model, MergeTile::Exposure& to) {
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kMergeLanes; ++l) {
    const float dark_dn = dark ? dark[l] : scale.dark_dn;
    // A warm pixel's shot noise; where the dark value does not tell one, the model's mean is the
    // better guess.
    const float warm = dark_dn - scale.warm_dn;
    const float expected = warm > scale.expected_dark_dn ? warm : scale.expected_dark_dn;
    to.signal[l] = static_cast<float>(y[l]) - dark_dn;
    to.other_variance[l] = model.gain * expected + model.read_variance + scale.dark_variance;
    to.headroom[l] = model.saturation_dn - dark_dn;
    to.k[l] = scale.k;
  }
}

// The same for fewer at the end of a row.
template <typename T>
LUXFIELD_INLINE void LoadRest(const T* y, const float* dark, std::size_t count,
                              const MergeScale& scale, const MergeModel& model,
                              MergeTile::Exposure& to) {
  std::array<T, kMergeLanes> samples{};
  std::array<float, kMergeLanes> dark_dn{};
  std::copy_n(y, count, samples.begin());
  if (dark) std::copy_n(dark, count, dark_dn.begin());
  LoadRun(samples.data(), dark ? dark_dn.data() : nullptr, scale, model, to);
}

template <typename T>
LUXFIELD_INLINE void LoadPlane(const T* y, const float* dark, std::uint64_t excluded,
                               std::size_t count, const MergeScale& scale, const MergeModel& model,
                               MergeTile::Exposure& to) {
  PrefetchNext(y);
  if (dark) PrefetchNext(dark);
  if (count < kMergeLanes)
    LoadRest(y, dark, count, scale, model, to);
  else if (dark)
    LoadRun(y, dark, scale, model, to);
  else
    LoadRun(y, nullptr, scale, model, to);
  if (excluded == 0) return;
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kMergeLanes; ++l) {
    const bool out = excluded >> l & 1;
    to.signal[l] = out ? 0 : to.signal[l];
    to.k[l] = out ? 0 : to.k[l];
  }
}

// Registers of a tile's pixels that are summed side by side, which hides how long divisions take.
constexpr std::size_t kTogether = 2, kLanes = kTogether * kRegister;
static_assert(kMergeLanes % kLanes == 0);

// kLanes of a tile's pixels, from lane `first` on.
struct Pixels {
  std::span<const MergeScale> scales;
  const MergeModel& model;
  MergeTile& tile;
  std::size_t first;
};

// A value of each of kLanes pixels.
struct alignas(kMergeRegisterBytes) Lanes {
  std::array<float, kLanes> lane;

  float& operator[](std::size_t l) { return lane[l]; }
  float operator[](std::size_t l) const { return lane[l]; }
  LUXFIELD_INLINE void Set(const Floats (&values)[kTogether]) {
    for (std::size_t r = 0; r < kTogether; ++r) Store(values[r], &lane[r * kRegister]);
  }
};

struct SampleSums {
  Lanes signal, k;
};

// sum f_n s_n and sum f_n k_n over the samples that are not excluded.
template <typename Factor>
LUXFIELD_INLINE SampleSums SumSamples(const Pixels& pixels, const Factor& factor) {
  alignas(kMergeRegisterBytes) Floats signal[kTogether] = {}, k[kTogether] = {};
  for (const std::size_t n : pixels.tile.used) {
    const MergeTile::Exposure& e = pixels.tile.exposures[n];
    const float f = factor(n);
#pragma GCC unroll 4
    for (std::size_t r = 0; r < kTogether; ++r) {
      const std::size_t l = pixels.first + r * kRegister;
      signal[r] += f * Load(&e.signal[l]);
      k[r] += f * Load(&e.k[l]);
    }
  }
  SampleSums sums;
  sums.signal.Set(signal);
  sums.k.Set(k);
  return sums;
}

LUXFIELD_INLINE void SetRatio(const SampleSums& sums, float* x) {
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kLanes; ++l) x[l] = sums.k[l] > 0 ? sums.signal[l] / sums.k[l] : 0;
}

LUXFIELD_INLINE void PoissonEstimate(const Pixels& pixels) {
  MergeTile& tile = pixels.tile;
  const std::size_t first = pixels.first;
  const SampleSums sums = SumSamples(
      pixels, [](std::size_t) __attribute__((always_inline)) { return 1.0f; });
  SetRatio(sums, &tile.x[first]);
  Lanes squares, variance;
  squares.lane.fill(0);
  variance.lane.fill(0);
  for (const std::size_t n : tile.used) {
    const MergeTile::Exposure& e = tile.exposures[n];
    const float gain_k = pixels.scales[n].gain_k;
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float k = e.k[first + l], x = tile.x[first + l], light = x > 0 ? x : 0;
      squares[l] += k * k;
      variance[l] += k > 0 ? gain_k * light + e.other_variance[first + l] : 0;
    }
  }
  // As weights whose sum is 1 / variance and whose effective number is (sum k)^2 / sum k^2.
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float k = sums.k[l], weights = k > 0 ? k * k / variance[l] : 0;
    tile.weights[first + l] = weights;
    tile.squares[first + l] = k > 0 ? weights * weights * squares[l] / (k * k) : 1;
  }
}

LUXFIELD_INLINE float Sum(const Floats& values) {
  std::array<float, kRegister> lane;
  Store(values, lane.data());
  for (std::size_t half = kRegister / 2; half > 0; half /= 2)
    for (std::size_t l = 0; l < half; ++l) lane[l] += lane[l + half];
  return lane[0];
}

// What the samples of each exposure count for where the iteration starts: their weights if all
// pixels of the tile were as bright as their mean. Neighbours are about as bright as each other, and
// one step does for most.
LUXFIELD_INLINE void SetStart(std::span<const MergeScale> scales, const MergeModel& model,
                              MergeTile& tile) {
  Floats signals{}, ks{};
  for (const std::size_t n : tile.used)
    for (std::size_t l = 0; l < kMergeLanes; l += kRegister) {
      signals += Load(&tile.exposures[n].signal[l]);
      ks += Load(&tile.exposures[n].k[l]);
    }
  const float signal = Sum(signals), k = Sum(ks), mean = k > 0 && signal > 0 ? signal / k : 0;
  for (const std::size_t n : tile.used)
    tile.exposures[n].start =
        scales[n].k / (scales[n].gain_k * mean + model.gain * scales[n].expected_dark_dn +
                       model.read_variance + scales[n].dark_variance);
}

// What one step of Newton's method needs, w_i = k_i p_i, p_i = k_i / var_i(x).
struct NewtonSums {
  Lanes residual;  // sum p (s - k x)
  Lanes slope;     // sum p^2 (s - k x): what the weights' change with x adds to its derivative
  Lanes weights, squares;  // sum w, sum w^2
  Lanes bend;              // sum w p
};

LUXFIELD_INLINE NewtonSums SumNewton(const Pixels& pixels, const Lanes& light) {
  const float* const x = &pixels.tile.x[pixels.first];
  alignas(kMergeRegisterBytes) Floats residual[kTogether] = {}, slope[kTogether] = {},
                                      weights[kTogether] = {}, squares[kTogether] = {},
                                      bend[kTogether] = {};
  for (const std::size_t n : pixels.tile.used) {
    const MergeTile::Exposure& e = pixels.tile.exposures[n];
    const float gain_k = pixels.scales[n].gain_k;
#pragma GCC unroll 4
    for (std::size_t r = 0; r < kTogether; ++r) {
      const std::size_t l = pixels.first + r * kRegister;
      const Floats k = Load(&e.k[l]),
                   share =
                       k / (gain_k * Load(&light.lane[r * kRegister]) + Load(&e.other_variance[l])),
                   off = share * (Load(&e.signal[l]) - k * Load(x + r * kRegister)),
                   weight = k * share;
      residual[r] += off;
      slope[r] += share * off;
      weights[r] += weight;
      squares[r] += weight * weight;
      bend[r] += weight * share;
    }
  }
  NewtonSums sums;
  sums.residual.Set(residual);
  sums.slope.Set(slope);
  sums.weights.Set(weights);
  sums.squares.Set(squares);
  sums.bend.Set(bend);
  return sums;
}

// Solves sum k_i (s_i - k_i x) / var_i(x) = 0 by Newton's method. A step d changes the sum of the
// weights by its share q d, and the step after it is some q d^2,
//
//   q = gain sum w p / sum w
//
// The last step is the one after which neither matters (merge_exposures.h states how much).
LUXFIELD_INLINE void InverseVarianceEstimate(const Pixels& pixels) {
  constexpr float kNextOverSigma = 5e-5f, kChangeOfWeights = 1e-3f;
  const float gain = pixels.model.gain;
  float* const x = &pixels.tile.x[pixels.first];
  const auto start = [&](std::size_t n) __attribute__((always_inline)) {
    return pixels.tile.exposures[n].start;
  };
  SetRatio(SumSamples(pixels, start), x);
  for (int iteration = 0; iteration < pixels.model.max_iterations; ++iteration) {
    Lanes light;
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kLanes; ++l) light[l] = x[l] > 0 ? x[l] : 0;
    const NewtonSums sums = SumNewton(pixels, light);
    std::copy_n(sums.weights.lane.begin(), kLanes, &pixels.tile.weights[pixels.first]);
    std::copy_n(sums.squares.lane.begin(), kLanes, &pixels.tile.squares[pixels.first]);
    std::uint32_t moving = 0;
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float weights = sums.weights[l];
      // Bounded, should samples contradict each other.
      const float own_change = gain * sums.slope[l];
      const float change = x[l] > 0 ? own_change : 0;
      const float low = change > -0.5f * weights ? change : -0.5f * weights;
      const float bounded = low < weights ? low : weights;
      const float newton = sums.residual[l] / (weights + bounded);
      const float step = weights > 0 ? newton : 0;
      x[l] += step;
      const float changed = gain * sums.bend[l] * step, next = changed * step;
      const float bound = kChangeOfWeights * weights;
      moving |= (changed * changed > bound * bound ? 1u : 0u) |
                (next * next > kNextOverSigma * kNextOverSigma * weights ? 1u : 0u);
    }
    if (!moving) break;
  }
}

// Excludes the longest sample of every pixel that x predicts too near to clipping; whether any was.
LUXFIELD_INLINE bool ExcludeNearSaturation(const Pixels& pixels) {
  const float* const x = &pixels.tile.x[pixels.first];
  std::array<std::uint32_t, kLanes> decided{};
  std::uint32_t any = 0;
  for (const std::size_t n : pixels.tile.used) {
    MergeTile::Exposure& e = pixels.tile.exposures[n];
    float* const signal = &e.signal[pixels.first];
    float* const k = &e.k[pixels.first];
    const float* const other_variance = &e.other_variance[pixels.first];
    const float* const headroom = &e.headroom[pixels.first];
    const float own_k = pixels.scales[n].k, gain_k = pixels.scales[n].gain_k;
    std::uint32_t all = 1;
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float light = x[l] > 0 ? x[l] : 0;
      const float variance = gain_k * light + other_variance[l];
      const float room = headroom[l] - own_k * x[l];
      const std::uint32_t in = k[l] > 0 ? 1u : 0u;
      const std::uint32_t fits =
          (room > 0 ? 1u : 0u) & (room * room > pixels.model.margin_squared * variance ? 1u : 0u);
      const std::uint32_t out = in & ~fits & ~decided[l] & 1u;
      signal[l] = out ? 0 : signal[l];
      k[l] = out ? 0 : k[l];
      decided[l] |= in;
      any |= out;
      all &= decided[l];
    }
    // The others of a pixel are shorter: where all pixels have their longest, nothing is left.
    if (all) break;
  }
  return any;
}

// Excludes samples that x predicts too near to 0 DN, where the ADC clips the noise, and those but
// the longest of a pixel whose noise is too small to dither the rounding to whole DN; whether any
// was. Both would be biased without their variance telling it.
LUXFIELD_INLINE bool ExcludeBiasedInTheDark(const Pixels& pixels) {
  // 0.5 DN of analogue noise leave (1 / pi) exp(-2 pi^2 0.5^2) = 0.002 DN of rounding bias; 1/12 is
  // the rounding's own variance.
  constexpr float kDithered = 0.25f + 1.0f / 12;
  const MergeModel& model = pixels.model;
  const float undithered = model.undithered ? kDithered : 0;
  const float margin_squared = model.low_black ? model.margin_squared : 0;
  MergeTile& tile = pixels.tile;
  const std::size_t first = pixels.first;
  std::array<std::uint32_t, kLanes> longer{};
  std::uint32_t any = 0;
  for (const std::size_t n : tile.used) {
    MergeTile::Exposure& e = tile.exposures[n];
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float x = tile.x[first + l], light = x > 0 ? x : 0;
      const float variance = pixels.scales[n].gain_k * light + e.other_variance[first + l];
      const float level = model.saturation_dn - e.headroom[first + l] + pixels.scales[n].k * x;
      const std::uint32_t in = e.k[first + l] > 0 ? 1u : 0u;
      const std::uint32_t below = (model.low_black ? 1u : 0u) & (level <= 0 ? 1u : 0u);
      const std::uint32_t low = below | (level * level < margin_squared * variance ? 1u : 0u);
      const std::uint32_t coarse = longer[l] & (variance < undithered ? 1u : 0u);
      const std::uint32_t out = in & (low | coarse);
      e.signal[first + l] = out ? 0 : e.signal[first + l];
      e.k[first + l] = out ? 0 : e.k[first + l];
      tile.at_floor[first + l] |= in & low;
      tile.dark_k[first + l] += out ? pixels.scales[n].k : 0;
      longer[l] |= in & ~out & 1u;
      any |= out;
    }
  }
  return any;
}

}  // namespace

LUXFIELD_SIMD_CLONES bool LoadSamples(const Exposure& exposure, std::uint64_t excluded,
                                      std::size_t pixel, std::size_t count, const MergeScale& scale,
                                      const MergeModel& model, MergeTile::Exposure& to) {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  if (count < kMergeLanes) excluded |= kAll << count;
  if (excluded == kAll) return false;
  const session::RawFrame& frame = *exposure.frame;
  const float* const dark_dn = exposure.dark ? exposure.dark->mean_dn.data() + pixel : nullptr;
  if (frame.value.empty())
    LoadPlane(frame.dn.data() + pixel, dark_dn, excluded, count, scale, model, to);
  else
    LoadPlane(frame.value.data() + pixel, dark_dn, excluded, count, scale, model, to);
  return true;
}

LUXFIELD_SIMD_CLONES void EstimateMergeTile(std::span<const MergeScale> scales,
                                            const MergeModel& model, MergeTile& tile) {
  const bool dark_checks = model.low_black || model.undithered;
  tile.at_floor.fill(0);
  tile.dark_k.fill(0);
  if (!model.poisson) SetStart(scales, model, tile);
  for (std::size_t first = 0; first < kMergeLanes; first += kLanes) {
    const Pixels pixels{scales, model, tile, first};
    do {
      if (model.poisson)
        PoissonEstimate(pixels);
      else
        InverseVarianceEstimate(pixels);
    } while (ExcludeNearSaturation(pixels) || (dark_checks && ExcludeBiasedInTheDark(pixels)));
  }
}

LUXFIELD_SIMD_CLONES void StoreMergeTile(const MergeModel& model, const MergeTile& tile,
                                         std::uint64_t defects, std::size_t pixel,
                                         std::size_t count, MergedFrame* merged) {
  float* const rate = merged->rate_e_per_s.data() + pixel;
  float* const sigma = merged->sigma_e_per_s.data() + pixel;
  float* const samples = merged->count.data() + pixel;
  std::uint32_t* const mask = merged->mask.data() + pixel;
  const float per_x = static_cast<float>(1 / model.k0);
  MergeLanes rates, sigmas, counts;
  std::array<std::uint32_t, kMergeLanes> flags;
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kMergeLanes; ++l) {
    const float weights = tile.weights[l], x = tile.x[l];
    const float significance = x * x * weights;
    const std::uint32_t below =
        (x < 0 ? 1u : 0u) & (significance > 4 * model.margin_squared ? 1u : 0u);
    const std::uint32_t known = (weights > 0 ? 1u : 0u) & ~below & 1u;
    const float prnu = model.prnu * x;
    const float deviation = per_x * std::sqrt(1 / weights + prnu * prnu);
    const float samples_used = weights * weights / tile.squares[l];
    const std::uint32_t dark =
        (x < 0 ? 1u : 0u) | (significance < model.too_dark_squared ? 1u : 0u);
    const std::uint32_t dark_flag = dark ? lightfield::kTooDark : 0u;
    rates[l] = known ? per_x * x : 0;
    sigmas[l] = known ? deviation : 0;
    counts[l] = known ? samples_used : 0;
    const std::uint32_t unknown =
        tile.at_floor[l] | below ? lightfield::kBelowBlack : lightfield::kSaturated;
    const std::uint32_t own = known ? dark_flag : unknown;
    flags[l] = defects >> l & 1 ? lightfield::kDefect : own;
  }
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < count; ++l) {
    rate[l] = rates[l];
    sigma[l] = sigmas[l];
    samples[l] = counts[l];
    mask[l] = flags[l];
  }
}

}  // namespace luxfield::reconstruct
