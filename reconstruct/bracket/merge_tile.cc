#include "luxfield/reconstruct/bracket/merge_tile.h"

#include <cmath>
#include <limits>

#include "luxfield/core/simd.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {
namespace {

constexpr float kExcluded = std::numeric_limits<float>::infinity();

// Asks for the samples of the next tile, to be there when this one is merged: two streams of every
// exposure are more than the processor follows by itself.
template <typename T>
LUXFIELD_INLINE void PrefetchNext(const T* from) {
  constexpr std::size_t kCacheLine = 64;
  const char* const next = reinterpret_cast<const char*>(from + kMergeLanes);
  for (std::size_t b = 0; b < kMergeLanes * sizeof(T); b += kCacheLine)
    __builtin_prefetch(next + b);
}

template <typename T>
LUXFIELD_INLINE void LoadRun(const T* y, const float* dark, std::uint64_t excluded,
                             std::size_t count, const MergeScale& scale, const MergeModel& model,
                             MergeTile::Exposure& to) {
  std::array<float, kMergeLanes> value, dark_dn;
  value.fill(0);
  dark_dn.fill(scale.dark_dn);
  PrefetchNext(y);
  if (dark) PrefetchNext(dark);
  if (count == kMergeLanes) {
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kMergeLanes; ++l) value[l] = static_cast<float>(y[l]);
    if (dark) {
      LUXFIELD_INDEPENDENT
      for (std::size_t l = 0; l < kMergeLanes; ++l) dark_dn[l] = dark[l];
    }
  } else {
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < count; ++l) value[l] = static_cast<float>(y[l]);
    if (dark) {
      LUXFIELD_INDEPENDENT
      for (std::size_t l = 0; l < count; ++l) dark_dn[l] = dark[l];
    }
  }
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kMergeLanes; ++l) {
    // A warm pixel's shot noise; where the dark value does not tell one, the model's mean is the
    // better guess.
    const float warm = dark_dn[l] - scale.warm_dn;
    const float expected = warm > scale.expected_dark_dn ? warm : scale.expected_dark_dn;
    to.signal[l] = value[l] - dark_dn[l];
    to.other_variance[l] = model.gain * expected + model.read_variance + scale.dark_variance;
    to.headroom[l] = model.saturation_dn - dark_dn[l];
  }
  if (excluded == 0) return;
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kMergeLanes; ++l) {
    const bool out = excluded >> l & 1;
    to.signal[l] = out ? 0 : to.signal[l];
    to.other_variance[l] = out ? kExcluded : to.other_variance[l];
  }
}

// x = sum s / sum k: the Poisson estimate, and where the iteration starts.
LUXFIELD_INLINE void SumEstimate(std::span<const MergeScale> scales, MergeTile& tile) {
  MergeLanes signal{}, k{};
  for (const std::size_t n : tile.used) {
    const MergeTile::Exposure& e = tile.exposures[n];
    const float own_k = scales[n].k;  // loaded here: a load on a condition is not vectorised
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kMergeLanes; ++l) {
      signal[l] += e.signal[l];
      k[l] += e.other_variance[l] < kExcluded ? own_k : 0;
    }
  }
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kMergeLanes; ++l) tile.x[l] = k[l] > 0 ? signal[l] / k[l] : 0;
}

LUXFIELD_INLINE void PoissonEstimate(std::span<const MergeScale> scales, MergeTile& tile) {
  SumEstimate(scales, tile);
  MergeLanes k{}, squares{}, variance{};
  for (const std::size_t n : tile.used) {
    const MergeTile::Exposure& e = tile.exposures[n];
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kMergeLanes; ++l) {
      const bool in = e.other_variance[l] < kExcluded;
      const float light = tile.x[l] > 0 ? tile.x[l] : 0;
      k[l] += in ? scales[n].k : 0;
      squares[l] += in ? scales[n].k * scales[n].k : 0;
      variance[l] += in ? scales[n].gain_k * light + e.other_variance[l] : 0;
    }
  }
  // As weights whose sum is 1 / variance and whose effective number is (sum k)^2 / sum k^2.
  LUXFIELD_INDEPENDENT
  for (std::size_t l = 0; l < kMergeLanes; ++l) {
    tile.weights[l] = k[l] > 0 ? k[l] * k[l] / variance[l] : 0;
    tile.squares[l] = k[l] > 0 ? tile.weights[l] * tile.weights[l] * squares[l] / (k[l] * k[l]) : 1;
  }
}

// Solves sum k_i (s_i - k_i x) / var_i(x) = 0 by Newton's method from the Poisson estimate.
LUXFIELD_INLINE void InverseVarianceEstimate(std::span<const MergeScale> scales,
                                             const MergeModel& model, MergeTile& tile) {
  constexpr float kConverged = 1e-6f;  // (step / sigma)^2; the next step would be its square
  SumEstimate(scales, tile);
  for (int iteration = 0; iteration < model.max_iterations; ++iteration) {
    MergeLanes residual{}, slope{};
    tile.weights.fill(0);
    tile.squares.fill(0);
    for (const std::size_t n : tile.used) {
      const MergeTile::Exposure& e = tile.exposures[n];
      const float k = scales[n].k, gain_k = scales[n].gain_k;
      LUXFIELD_INDEPENDENT
      for (std::size_t l = 0; l < kMergeLanes; ++l) {
        const float light = tile.x[l] > 0 ? tile.x[l] : 0;
        const float share = k / (gain_k * light + e.other_variance[l]);
        const float off = share * (e.signal[l] - k * tile.x[l]);
        const float weight = k * share;
        residual[l] += off;
        slope[l] += share * off;
        tile.weights[l] += weight;
        tile.squares[l] += weight * weight;
      }
    }
    std::uint32_t moving = 0;
    const float gain = model.gain;
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kMergeLanes; ++l) {
      const float weights = tile.weights[l], x = tile.x[l];
      // The weights' own change with x; bounded, should samples contradict each other.
      const float own_change = gain * slope[l];
      const float change = x > 0 ? own_change : 0;
      const float low = change > -0.5f * weights ? change : -0.5f * weights;
      const float bounded = low < weights ? low : weights;
      const float newton = residual[l] / (weights + bounded);
      const float step = weights > 0 ? newton : 0;
      tile.x[l] = x + step;
      moving |= step * step * weights > kConverged ? 1u : 0u;
    }
    if (!moving) break;
  }
}

// Excludes the longest sample of every pixel that x predicts too near to clipping; whether any was.
LUXFIELD_INLINE bool ExcludeNearSaturation(std::span<const MergeScale> scales,
                                           const MergeModel& model, MergeTile& tile) {
  std::array<std::uint32_t, kMergeLanes> decided{};
  std::uint32_t any = 0;
  for (const std::size_t n : tile.used) {
    MergeTile::Exposure& e = tile.exposures[n];
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kMergeLanes; ++l) {
      const float light = tile.x[l] > 0 ? tile.x[l] : 0;
      const float variance = scales[n].gain_k * light + e.other_variance[l];
      const float room = e.headroom[l] - scales[n].k * tile.x[l];
      const std::uint32_t in = e.other_variance[l] < kExcluded ? 1u : 0u;
      const std::uint32_t fits =
          (room > 0 ? 1u : 0u) & (room * room > model.margin_squared * variance ? 1u : 0u);
      const std::uint32_t out = in & ~fits & ~decided[l] & 1u;
      e.signal[l] = out ? 0 : e.signal[l];
      e.other_variance[l] = out ? kExcluded : e.other_variance[l];
      decided[l] |= in;
      any |= out;
    }
    // The others of a pixel are shorter: where all pixels have their longest, nothing is left.
    std::uint32_t all = 1;
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kMergeLanes; ++l) all &= decided[l];
    if (all) break;
  }
  return any;
}

// Excludes samples that x predicts too near to 0 DN, where the ADC clips the noise, and those but
// the longest of a pixel whose noise is too small to dither the rounding to whole DN; whether any
// was. Both would be biased without their variance telling it.
LUXFIELD_INLINE bool ExcludeBiasedInTheDark(std::span<const MergeScale> scales,
                                            const MergeModel& model, MergeTile& tile) {
  // 0.5 DN of analogue noise leave (1 / pi) exp(-2 pi^2 0.5^2) = 0.002 DN of rounding bias; 1/12 is
  // the rounding's own variance.
  constexpr float kDithered = 0.25f + 1.0f / 12;
  const float undithered = model.undithered ? kDithered : 0;
  const float margin_squared = model.low_black ? model.margin_squared : 0;
  std::array<std::uint32_t, kMergeLanes> longer{};
  std::uint32_t any = 0;
  for (const std::size_t n : tile.used) {
    MergeTile::Exposure& e = tile.exposures[n];
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kMergeLanes; ++l) {
      const float light = tile.x[l] > 0 ? tile.x[l] : 0;
      const float variance = scales[n].gain_k * light + e.other_variance[l];
      const float level = model.saturation_dn - e.headroom[l] + scales[n].k * tile.x[l];
      const std::uint32_t in = e.other_variance[l] < kExcluded ? 1u : 0u;
      const std::uint32_t below = (model.low_black ? 1u : 0u) & (level <= 0 ? 1u : 0u);
      const std::uint32_t low = below | (level * level < margin_squared * variance ? 1u : 0u);
      const std::uint32_t coarse = longer[l] & (variance < undithered ? 1u : 0u);
      const std::uint32_t out = in & (low | coarse);
      e.signal[l] = out ? 0 : e.signal[l];
      e.other_variance[l] = out ? kExcluded : e.other_variance[l];
      tile.at_floor[l] |= in & low;
      tile.dark_k[l] += out ? scales[n].k : 0;
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
    LoadRun(frame.dn.data() + pixel, dark_dn, excluded, count, scale, model, to);
  else
    LoadRun(frame.value.data() + pixel, dark_dn, excluded, count, scale, model, to);
  return true;
}

LUXFIELD_SIMD_CLONES void EstimateMergeTile(std::span<const MergeScale> scales,
                                            const MergeModel& model, MergeTile& tile) {
  const bool dark_checks = model.low_black || model.undithered;
  tile.at_floor.fill(0);
  tile.dark_k.fill(0);
  do {
    if (model.poisson)
      PoissonEstimate(scales, tile);
    else
      InverseVarianceEstimate(scales, model, tile);
  } while (ExcludeNearSaturation(scales, model, tile) ||
           (dark_checks && ExcludeBiasedInTheDark(scales, model, tile)));
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
