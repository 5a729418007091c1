#include "luxfield/reconstruct/bracket/merge_exposures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/simd.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/bracket/dark_codes.h"
#include "luxfield/reconstruct/bracket/excluded_samples.h"
#include "luxfield/reconstruct/bracket/merge_tile.h"
#include "luxfield/reconstruct/bracket/pixel_bits.h"

namespace luxfield::reconstruct {
namespace {

// Pixels of planes that are summed, in pieces that stay in the cache while frame after frame is
// added; kSumLanes of them side by side.
constexpr std::size_t kSumPiece = 8192, kSumLanes = 64;

template <typename Body>
void ForPieces(std::size_t pixels, const Body& body) {
  core::ParallelFor(pixels, kSumPiece, [&](std::size_t begin, std::size_t end) {
    for (; begin < end; begin += kSumPiece) body(begin, std::min(begin + kSumPiece, end));
  });
}

// body(p) for pixels begin to end - 1.
template <typename Body>
LUXFIELD_INLINE void ForLanes(std::size_t begin, std::size_t end, const Body& body) {
  for (; begin + kSumLanes <= end; begin += kSumLanes) {
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kSumLanes; ++l) body(begin + l);
  }
  for (; begin < end; ++begin) body(begin);
}

LUXFIELD_SIMD_CLONES void AddWhole(const std::uint16_t* dn, std::size_t begin, std::size_t end,
                                   std::uint32_t* sum) {
  ForLanes(
      begin, end, [&](std::size_t p) __attribute__((always_inline)) { sum[p] += dn[p]; });
}

LUXFIELD_SIMD_CLONES void ScaleWhole(const std::uint32_t* sum, std::size_t begin, std::size_t end,
                                     double factor, float* mean) {
  ForLanes(
      begin, end, [&](std::size_t p) __attribute__((always_inline)) {
        mean[p] = static_cast<float>(factor * static_cast<double>(sum[p]));
      });
}

void Check(const rig::SensorModel& sensor, std::span<const Exposure> exposures) {
  if (exposures.empty())
    throw InputError("an exposure bracket without a frame cannot be merged; retake the position");
  const std::size_t pixels = static_cast<std::size_t>(sensor.width) * sensor.height;
  for (const Exposure& exposure : exposures) {
    if (exposure.frame->width != sensor.width || exposure.frame->height != sensor.height ||
        (exposure.dark && exposure.dark->mean_dn.size() != pixels))
      throw InputError(
          fmt::format("a frame or dark frame of {} x {} pixels does not fit the sensor of {} x {}; "
                      "session.json is of another camera",
                      exposure.frame->width, exposure.frame->height, sensor.width, sensor.height));
    if (!(exposure.exposure_s > 0 && exposure.attenuation > 0 && exposure.lamp_factor > 0))
      throw InputError(
          fmt::format("exposure {} s, attenuation {} and lamp factor {} must be above 0; the "
                      "session's journal is wrong",
                      exposure.exposure_s, exposure.attenuation, exposure.lamp_factor));
  }
}

double Strength(const Exposure& e) { return e.exposure_s * e.attenuation * e.lamp_factor; }

MergeModel MakeMergeModel(const rig::SensorModel& sensor, const Exposure& longest,
                          const MergeOptions& options) {
  MergeModel model;
  model.gain = static_cast<float>(sensor.gain_dn_per_e);
  model.read_variance = static_cast<float>(sensor.read_noise_dn * sensor.read_noise_dn +
                                           sensor.quantisation_variance_dn2());
  model.saturation_dn = static_cast<float>(sensor.saturation_dn);
  model.margin_squared = static_cast<float>(options.saturation_margin * options.saturation_margin);
  model.too_dark_squared = lightfield::kDetectionSigmas * lightfield::kDetectionSigmas;
  model.prnu = static_cast<float>(sensor.prnu);
  const bool whole_numbers = sensor.bits < 32;
  const double dark_e = sensor.dark_current_e_per_s * longest.exposure_s;
  model.low_black =
      whole_numbers &&
      sensor.black_dn <
          options.saturation_margin *
              std::sqrt(model.read_variance + sensor.gain_dn_per_e * sensor.gain_dn_per_e * dark_e);
  model.undithered = whole_numbers && sensor.read_noise_dn < 0.5;
  model.max_iterations = std::max(options.max_iterations, 1);
  model.poisson = options.estimator == Estimator::kPoisson;
  model.k0 = sensor.gain_dn_per_e * Strength(longest);
  return model;
}

MergeScale MakeMergeScale(const rig::SensorModel& sensor, const Exposure& exposure,
                          const MergeModel& model) {
  MergeScale scale;
  scale.k = static_cast<float>(sensor.gain_dn_per_e * Strength(exposure) / model.k0);
  scale.gain_k = model.gain * scale.k;
  const double expected = sensor.gain_dn_per_e * sensor.dark_current_e_per_s * exposure.exposure_s;
  const double variance =
      exposure.dark ? (sensor.gain_dn_per_e * expected + model.read_variance) / exposure.dark->count
                    : 0.0;
  scale.expected_dark_dn = static_cast<float>(expected);
  scale.dark_dn = static_cast<float>(sensor.black_dn + expected);
  scale.dark_variance = static_cast<float>(variance);
  // Within 4 standard deviations of the model's mean a dark value tells nothing.
  scale.warm_dn = static_cast<float>(sensor.black_dn + 4 * std::sqrt(variance));
  return scale;
}

// A bracket, longest exposure first, and what merging makes of it.
struct SortedBracket {
  const rig::SensorModel& sensor;
  std::span<const Exposure> exposures;
  std::span<const MergeScale> scales;  // of each exposure
  const MergeModel& model;
  const ExcludedSamples& excluded;
};

// Pixels of one word of a row of PixelBits.
struct TilePixels {
  int row = 0, word = 0;
  std::size_t first = 0, count = 0;
};

// Pixels of the tile for which samples that tell something were left out in the dark, with what
// those tell (dark_codes.h).
void RefineInTheDark(const DarkCodes& codes, const SortedBracket& bracket, const TilePixels& pixels,
                     MergeTile& tile) {
  const auto& [sensor, exposures, scales, model, excluded] = bracket;
  constexpr double kWorthIt = 0.01;  // of the light
  // Below 0.3 DN of noise in the longest the codes hardly follow the light: the equation's root
  // would be as good as anywhere.
  constexpr double kFollows = 0.3 * 0.3 + 1.0 / 12;
  std::vector<DarkCodes::Sample> samples;
  for (std::size_t l = 0; l < pixels.count; ++l) {
    if (!(tile.dark_k[l] > 0 && tile.weights[l] > 0)) continue;
    samples.clear();
    double k = 0;
    const double x = tile.x[l], light = std::max(x, 0.0);
    for (std::size_t n = 0; n < exposures.size(); ++n) {
      if (excluded.Word(n, pixels.row, pixels.word) >> l & 1) continue;
      const MergeScale& scale = scales[n];
      const double room = model.saturation_dn - scale.dark_dn - scale.k * x;
      const double variance =
          scale.gain_k * light + model.gain * scale.expected_dark_dn + model.read_variance;
      if (!(room > 0 && room * room > model.margin_squared * variance)) continue;
      if (samples.empty() && variance < kFollows) break;
      samples.push_back({exposures[n].frame->at(pixels.first + l), scale.k / sensor.gain_dn_per_e,
                         sensor.dark_current_e_per_s * exposures[n].exposure_s});
      k += scale.k;
    }
    if (samples.empty() || tile.dark_k[l] < kWorthIt * k) continue;
    const DarkCodes::Estimate estimate = codes.Solve(samples, x);
    tile.x[l] = static_cast<float>(estimate.x);
    tile.weights[l] = static_cast<float>(estimate.information);
    tile.squares[l] = static_cast<float>(estimate.squared_weights);
  }
}

}  // namespace

DarkSum::DarkSum(double exposure_s) : exposure_s_(exposure_s) {}

void DarkSum::Require(const session::RawFrame& frame) const {
  constexpr int kMostFrames = 1 << 16;  // of 16 bits, whose sums fit 32
  if (frame.width != width_ || frame.height != height_ || frame.value.empty() != sum_dn_.empty())
    throw InputError(
        fmt::format("dark frames of {} s have different sizes; retake them", exposure_s_));
  if (count_ >= kMostFrames)
    throw InputError(
        fmt::format("there are more than {} dark frames of {} s; leave some of them out",
                    kMostFrames, exposure_s_));
}

void DarkSum::Add(std::span<const session::RawFrame> frames) {
  if (frames.empty()) return;
  if (count_ == 0) {
    width_ = frames[0].width;
    height_ = frames[0].height;
    whole_dn_.assign(frames[0].dn.size(), 0);
    sum_dn_.assign(frames[0].value.size(), 0);
  }
  for (const session::RawFrame& frame : frames) {
    Require(frame);
    ++count_;
  }
  ForPieces(frames[0].size(), [&](std::size_t begin, std::size_t end) {
    for (const session::RawFrame& frame : frames) {
      if (!whole_dn_.empty()) AddWhole(frame.dn.data(), begin, end, whole_dn_.data());
      for (std::size_t p = begin; p < end && !sum_dn_.empty(); ++p) sum_dn_[p] += frame.value[p];
    }
  });
}

DarkFrame DarkSum::Mean() const {
  if (count_ == 0) throw InputError("no dark frame to average");
  DarkFrame dark{exposure_s_, count_, std::vector<float>(whole_dn_.size() + sum_dn_.size())};
  ForPieces(dark.mean_dn.size(), [&](std::size_t begin, std::size_t end) {
    if (!whole_dn_.empty())
      ScaleWhole(whole_dn_.data(), begin, end, 1.0 / count_, dark.mean_dn.data());
    for (std::size_t p = begin; p < end && !sum_dn_.empty(); ++p)
      dark.mean_dn[p] = static_cast<float>(sum_dn_[p] / count_);
  });
  return dark;
}

DarkFrame AverageDarks(std::span<const session::RawFrame> frames, double exposure_s) {
  DarkSum sum(exposure_s);
  sum.Add(frames);
  return sum.Mean();
}

void MergeExposures(const rig::SensorModel& sensor, std::span<const Exposure> exposures,
                    const MergeOptions& options, MergedFrame* merged) {
  Check(sensor, exposures);
  std::vector<Exposure> sorted(exposures.begin(), exposures.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Exposure& a, const Exposure& b) { return Strength(a) > Strength(b); });
  const MergeModel model = MakeMergeModel(sensor, sorted.front(), options);
  std::vector<MergeScale> scales;
  for (const Exposure& exposure : sorted) scales.push_back(MakeMergeScale(sensor, exposure, model));

  const int width = merged->width = sensor.width, height = merged->height = sensor.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  for (auto* plane : {&merged->rate_e_per_s, &merged->sigma_e_per_s, &merged->count})
    plane->resize(pixels);
  merged->mask.resize(pixels);
  PixelBits defects(width, height);
  for (const auto& [row, column] : sensor.defects)
    defects.row(row)[column / kBitsOfWord] |= std::uint64_t{1} << (column % kBitsOfWord);

  const ExcludedSamples excluded(sensor, sorted);
  // What measured darks are worth where they clip or do not dither is not known.
  const bool stated_darks = std::none_of(sorted.begin(), sorted.end(),
                                         [](const Exposure& e) { return e.dark != nullptr; });
  std::optional<DarkCodes> codes;
  if (stated_darks && !model.poisson && (model.low_black || model.undithered))
    codes.emplace(sensor, options.saturation_margin);
  const auto words = static_cast<std::size_t>(defects.words_of_row());
  core::ParallelFor(
      words * static_cast<std::size_t>(height), 128, [&](std::size_t begin, std::size_t end) {
        MergeTile tile(sorted.size());
        for (; begin < end; ++begin) {
          const auto row = static_cast<int>(begin / words), w = static_cast<int>(begin % words);
          const int first = w * kBitsOfWord, count = std::min(kBitsOfWord, width - first);
          const std::size_t pixel = static_cast<std::size_t>(row) * width + first;
          const std::uint64_t defect = defects.row(row)[w];
          tile.used.clear();
          for (std::size_t n = 0; n < sorted.size(); ++n)
            if (LoadSamples(sorted[n], excluded.Word(n, row, w) | defect, pixel, count, scales[n],
                            model, tile.exposures[n]))
              tile.used.push_back(n);
          EstimateMergeTile(scales, model, tile);
          if (codes)
            RefineInTheDark(*codes, {sensor, sorted, scales, model, excluded},
                            {row, w, pixel, static_cast<std::size_t>(count)}, tile);
          StoreMergeTile(model, tile, defect, pixel, count, merged);
        }
      });
}

MergedFrame MergeExposures(const rig::SensorModel& sensor, std::span<const Exposure> exposures,
                           const MergeOptions& options) {
  MergedFrame merged;
  MergeExposures(sensor, exposures, options, &merged);
  return merged;
}

}  // namespace luxfield::reconstruct
