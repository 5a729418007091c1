#include "reconstruct/merge_exposures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "lightfield/measurements.h"
#include "reconstruct/merge_tile.h"
#include "reconstruct/simd.h"

namespace luxfield::reconstruct {
namespace {

constexpr int kBandRows = 8;  // a thread's piece: the band of every frame stays in its cache

template <typename T>
LUXFIELD_INLINE void MarkClipped(const T* y, int width, float saturation_dn, std::uint8_t* out) {
  LUXFIELD_INDEPENDENT
  for (int column = 0; column < width; ++column) {
    const float value = static_cast<float>(y[column]);
    out[column] = static_cast<std::uint8_t>(
        (value < saturation_dn ? 0 : 1) | (value >= std::numeric_limits<float>::lowest() ? 0 : 1));
  }
}

LUXFIELD_SIMD_CLONES void MarkClippedRow(const core::RawFrame& frame, int row, float saturation_dn,
                                         std::uint8_t* out) {
  const std::size_t first = static_cast<std::size_t>(row) * frame.width;
  if (frame.value.empty())
    MarkClipped(frame.dn.data() + first, frame.width, saturation_dn, out);
  else
    MarkClipped(frame.value.data() + first, frame.width, saturation_dn, out);
}

// out[column] |= a clipped pixel among the 9 around; rows have a spare byte at each end.
LUXFIELD_SIMD_CLONES void Dilate(const std::uint8_t* above, const std::uint8_t* middle,
                                 const std::uint8_t* below, int width, std::uint8_t* either,
                                 std::uint8_t* out) {
  LUXFIELD_INDEPENDENT
  for (int column = 0; column < width + 2; ++column)
    either[column] = above[column] | middle[column] | below[column];
  LUXFIELD_INDEPENDENT
  for (int column = 0; column < width; ++column)
    out[column] |= either[column] | either[column + 1] | either[column + 2];
}

// Which samples of a frame's rows [begin, end) have weight zero: clipped, neighbour of one that is,
// or a defect of the sensor.
class ExcludedRows {
 public:
  explicit ExcludedRows(int width)
      : width_(width), clipped_((kBandRows + 2) * stride(), 0), either_(stride(), 0) {}

  void Find(const core::RawFrame& frame, float saturation_dn, int begin, int end,
            const std::uint32_t* mask, std::vector<std::uint8_t>& excluded) {
    for (int row = begin - 1; row <= end; ++row) {
      std::uint8_t* to = clipped_.data() + (row - begin + 1) * stride() + 1;
      if (row < 0 || row >= frame.height)
        std::fill_n(to, width_, std::uint8_t{0});
      else
        MarkClippedRow(frame, row, saturation_dn, to);
    }
    for (int row = begin; row < end; ++row) {
      std::uint8_t* to = excluded.data() + static_cast<std::size_t>(row - begin) * width_;
      for (int column = 0; column < width_; ++column)
        to[column] = mask[static_cast<std::size_t>(row) * width_ + column] ? 1 : 0;
      const std::uint8_t* above = clipped_.data() + (row - begin) * stride();
      Dilate(above, above + stride(), above + 2 * stride(), width_, either_.data(), to);
    }
  }

 private:
  std::size_t stride() const { return static_cast<std::size_t>(width_) + 2; }
  int width_;
  std::vector<std::uint8_t> clipped_, either_;
};

void Check(const SensorModel& sensor, std::span<const Exposure> exposures) {
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

MergeModel MakeMergeModel(const SensorModel& sensor, const Exposure& longest,
                          const MergeOptions& options) {
  MergeModel model;
  model.gain = static_cast<float>(sensor.gain_dn_per_e);
  model.read_variance = static_cast<float>(sensor.read_noise_dn * sensor.read_noise_dn +
                                           sensor.quantisation_variance_dn2());
  model.saturation_dn = static_cast<float>(sensor.saturation_dn);
  model.margin_squared = static_cast<float>(options.saturation_margin * options.saturation_margin);
  model.too_dark_squared = static_cast<float>(options.too_dark_sigmas * options.too_dark_sigmas);
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

MergeScale MakeMergeScale(const SensorModel& sensor, const Exposure& exposure,
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

}  // namespace

DarkSum::DarkSum(double exposure_s) : exposure_s_(exposure_s) {}

void DarkSum::Add(const core::RawFrame& frame) {
  if (count_ == 0) {
    width_ = frame.width;
    height_ = frame.height;
    sum_dn_.assign(frame.size(), 0);
  }
  if (frame.width != width_ || frame.height != height_)
    throw InputError(
        fmt::format("dark frames of {} s have different sizes; retake them", exposure_s_));
  ++count_;
  for (std::size_t p = 0; p < sum_dn_.size(); ++p) sum_dn_[p] += frame.at(p);
}

DarkFrame DarkSum::Mean() const {
  if (count_ == 0) throw InputError("no dark frame to average");
  DarkFrame dark{exposure_s_, count_, {}};
  dark.mean_dn.reserve(sum_dn_.size());
  for (const double value : sum_dn_) dark.mean_dn.push_back(static_cast<float>(value / count_));
  return dark;
}

DarkFrame AverageDarks(std::span<const core::RawFrame> frames, double exposure_s) {
  DarkSum sum(exposure_s);
  for (const core::RawFrame& frame : frames) sum.Add(frame);
  return sum.Mean();
}

void MergeExposures(const SensorModel& sensor, std::span<const Exposure> exposures,
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
  merged->mask.assign(pixels, 0);
  for (const auto& [row, column] : sensor.defects)
    merged->mask[static_cast<std::size_t>(row) * width + column] = lightfield::kDefect;

  const std::size_t bands = (static_cast<std::size_t>(height) + kBandRows - 1) / kBandRows;
  core::ParallelFor(bands, 4, [&](std::size_t first, std::size_t last) {
    MergeTile tile(sorted.size());
    ExcludedRows rows(width);
    std::vector<std::vector<std::uint8_t>> excluded(
        sorted.size(), std::vector<std::uint8_t>(static_cast<std::size_t>(kBandRows) * width));
    for (std::size_t band = first; band < last; ++band) {
      const int begin = static_cast<int>(band) * kBandRows,
                end = std::min(begin + kBandRows, height);
      for (std::size_t n = 0; n < sorted.size(); ++n)
        rows.Find(*sorted[n].frame, model.saturation_dn, begin, end, merged->mask.data(),
                  excluded[n]);
      // A band is one run of pixels.
      const std::size_t run = static_cast<std::size_t>(begin) * width;
      const std::size_t length = static_cast<std::size_t>(end - begin) * width;
      for (std::size_t offset = 0; offset < length; offset += kMergeLanes) {
        const std::size_t count = std::min(kMergeLanes, length - offset), pixel = run + offset;
        tile.used.clear();
        for (std::size_t n = 0; n < sorted.size(); ++n)
          if (LoadSamples(sorted[n], excluded[n].data() + offset, pixel, count, scales[n], model,
                          tile.exposures[n]))
            tile.used.push_back(n);
        EstimateMergeTile(scales, model, tile);
        StoreMergeTile(model, tile, pixel, count, merged);
      }
    }
  });
}

MergedFrame MergeExposures(const SensorModel& sensor, std::span<const Exposure> exposures,
                           const MergeOptions& options) {
  MergedFrame merged;
  MergeExposures(sensor, exposures, options, &merged);
  return merged;
}

}  // namespace luxfield::reconstruct
