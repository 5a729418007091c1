// Pixels merged side by side: the arithmetic of merge_exposures.h on vectors.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/reconstruct/bracket/pixel_bits.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::reconstruct {

// Pixels merged together: those of a word of a row (pixel_bits.h). Their samples, 8 exposures of
// them, stay in the first-level cache.
constexpr std::size_t kMergeLanes = kBitsOfWord;
constexpr std::size_t kMergeRegisterBytes = 64;  // a vector of them
using MergeLanes = std::array<float, kMergeLanes>;

// What is the same for all pixels of an exposure. Light is counted in DN of the longest exposure,
// x = X k_0, so that floats hold the weights of exposures 17 stops apart.
struct MergeScale {
  float k;                                  // k_i / k_0
  float gain_k;                             // DN of shot noise variance per x
  float dark_dn = 0, expected_dark_dn = 0;  // black level and dark signal; the latter alone
  float dark_variance = 0;                  // of the subtracted dark value, DN^2
  float warm_dn = 0;                        // a measured dark value above this tells a warm pixel
};

struct MergeModel {
  float gain = 1, read_variance = 0;
  float saturation_dn = 0;
  float margin_squared = 0, too_dark_squared = 0;
  float prnu = 0;
  bool low_black = false;   // the ADC may clip dark samples at 0 DN
  bool undithered = false;  // dark samples may have less noise than rounding needs
  int max_iterations = 0;
  bool poisson = false;
  double k0 = 1;  // DN per electron per second of the longest exposure
};

// The samples of kMergeLanes pixels. An excluded one has signal 0 and k 0, hence the weight 0.
struct MergeTile {
  struct alignas(kMergeRegisterBytes) Exposure {
    MergeLanes signal;          // y - d, DN
    MergeLanes other_variance;  // all but the light's shot noise, DN^2
    MergeLanes headroom;        // saturation - d, DN
    MergeLanes k;               // k_i / k_0, 0: excluded
    float start;                // what they count for where the iteration starts
  };
  std::vector<Exposure> exposures;
  std::vector<std::size_t> used;  // exposures with a sample that isn't excluded
  alignas(kMergeRegisterBytes) MergeLanes x, weights, squares;  // the estimate, sum w, sum w^2
  std::array<std::uint32_t, kMergeLanes> at_floor;  // 1: a sample was excluded for being near 0 DN
  MergeLanes dark_k;  // sum of k of the samples that were excluded for being biased in the dark

  explicit MergeTile(std::size_t count) : exposures(count) {}
};

// Loads the samples of pixels [pixel, pixel + count) of an exposure, but those whose bit of
// `excluded` is 1; lanes beyond are excluded. False, and nothing is loaded: all are excluded.
bool LoadSamples(const Exposure& exposure, std::uint64_t excluded, std::size_t pixel,
                 std::size_t count, const MergeScale& scale, const MergeModel& model,
                 MergeTile::Exposure& to);

// Estimates x from tile.used, the longest exposure first, and excludes on the way what saturates or
// is biased in the dark.
void EstimateMergeTile(std::span<const MergeScale> scales, const MergeModel& model,
                       MergeTile& tile);

// Values, sigmas and flags of the tile's first `count` pixels from `pixel` on; those whose bit of
// `defects` is 1, excluded from every exposure, get that flag alone.
void StoreMergeTile(const MergeModel& model, const MergeTile& tile, std::uint64_t defects,
                    std::size_t pixel, std::size_t count, MergedFrame* merged);

}  // namespace luxfield::reconstruct
