#include "reconstruct/merge_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/exr.h"
#include "core/parallel.h"
#include "lightfield/measurements.h"
#include "reconstruct/response_samples.h"

namespace luxfield::reconstruct {
namespace {

// A step is below 0.03 in ln I for curves of 17 stops; noise is a smooth function of it.
constexpr int kSteps = 512;
constexpr int kMaxIterations = 20;

// 0 at saturated pixels of a plane and their neighbours.
std::vector<std::uint8_t> Usable(std::span<const std::uint16_t> code, int width, int height,
                                 double saturation_code) {
  std::vector<std::uint8_t> usable(code.size(), 1);
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      if (code[static_cast<std::size_t>(row) * width + column] < saturation_code) continue;
      for (int r = std::max(row - 1, 0); r <= std::min(row + 1, height - 1); ++r)
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, width - 1); ++c)
          usable[static_cast<std::size_t>(r) * width + c] = 0;
    }
  return usable;
}

void RequireChannels(const PictureStack& stack, std::span<const ResponseCurve> curves) {
  if (static_cast<int>(curves.size()) != stack.channels)
    throw InputError(fmt::format(
        "the calibration has {} channels, the pictures {}; calibrate the response of this camera "
        "and mode",
        curves.size(), stack.channels));
}

}  // namespace

ResponseMerger::ResponseMerger(const ResponseCurve& curve, int bits, double end_margin)
    : low_(curve.log_exposure.front()),
      high_(curve.log_exposure.back()),
      saturation_code_(curve.saturation_code),
      end_margin_(end_margin) {
  const int codes = 1 << bits;
  for (int z = 0; z < codes; ++z)
    exposure_.push_back(std::exp(curve.LogExposure(std::max<double>(z, 0.5))));
  constexpr double kBeyond = 1;  // of the ends
  lowest_ = low_ - kBeyond;
  step_ = (high_ + kBeyond - lowest_) / (kSteps - 1);
  for (int k = 0; k < kSteps; ++k) {
    const double z = std::min(curve.Code(lowest_ + k * step_), curve.saturation_code - 0.5);
    const double noise = curve.Noise(z);
    predicted_.push_back({noise * noise, curve.Sigma(z)});
  }
}

ResponseMerger::Prediction ResponseMerger::At(double log_exposure) const {
  const double place = (log_exposure - lowest_) / step_;
  return predicted_[static_cast<std::size_t>(std::clamp(place + 0.5, 0.0, kSteps - 1.0))];
}

double ResponseMerger::Estimate(double radiance) {
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const double log_x = std::log(radiance);
    double numerator = 0, weights = 0;
    for (StackSample* sample = first_; sample != last_; ++sample) {
      sample->relative_variance = At(log_x + log_t_[sample - all_.data()]).relative_variance;
      const double weight = 1 / sample->relative_variance;
      numerator += weight * sample->radiance;
      weights += weight;
    }
    const double next = numerator / weights;
    const bool converged = std::abs(next - radiance) <= 1e-7 * next;
    radiance = next;
    if (converged) break;
  }
  return radiance;
}

PixelRadiance ResponseMerger::Merge(std::span<const std::uint16_t> codes,
                                    std::span<const std::uint8_t> usable,
                                    std::span<const double> exposures_s) {
  all_.clear();
  log_t_.clear();
  double exposure = 0, time = 0;
  for (std::size_t j = 0; j < codes.size(); ++j) {
    if (!usable[j] || codes[j] >= saturation_code_) continue;
    all_.push_back({static_cast<int>(j), exposure_[codes[j]] / exposures_s[j], 0});
    log_t_.push_back(std::log(exposures_s[j]));
    exposure += exposure_[codes[j]];
    time += exposures_s[j];
  }
  first_ = all_.data();
  last_ = first_ + all_.size();
  double radiance = time > 0 ? exposure / time : 0;
  for (; first_ != last_; --last_) {
    radiance = Estimate(radiance);
    const double log_exposure = std::log(radiance) + log_t_[last_ - 1 - all_.data()];
    const double sigma = std::sqrt(last_[-1].relative_variance);
    if (log_exposure + end_margin_ * sigma < high_) break;
  }
  if (first_ == last_) return {0, 0, 0, lightfield::kSaturated};
  for (; first_ != last_; ++first_) {
    radiance = Estimate(radiance);
    const double log_exposure = std::log(radiance) + log_t_[first_ - all_.data()];
    const double sigma = std::sqrt(first_->relative_variance);
    if (log_exposure - end_margin_ * sigma > low_) break;
  }
  if (first_ == last_) return {0, 0, 0, lightfield::kTooDark};
  double weights = 0, squares = 0, curve_sigma = 0;
  for (const StackSample& sample : samples()) {
    const double weight = 1 / sample.relative_variance;
    weights += weight;
    squares += weight * weight;
    curve_sigma += weight * At(std::log(radiance) + log_t_[&sample - all_.data()]).curve_sigma;
  }
  curve_sigma /= weights;
  return {radiance, radiance * std::sqrt(1 / weights + curve_sigma * curve_sigma),
          weights * weights / squares, 0};
}

MergedPicture MergeStack(const PictureStack& stack, std::span<const ResponseCurve> curves) {
  RequireChannels(stack, curves);
  MergedPicture merged{core::Image(stack.width, stack.height, stack.channels),
                       core::Image(stack.width, stack.height, stack.channels),
                       core::Image(stack.width, stack.height, stack.channels),
                       {},
                       {}};
  const std::size_t pixels = stack.plane_size(), exposures = stack.pictures.size();
  merged.mask.assign(pixels * stack.channels, 0);
  for (const StackPicture& picture : stack.pictures)
    merged.exposures_s.push_back(picture.exposure_s);
  for (int channel = 0; channel < stack.channels; ++channel) {
    std::vector<std::vector<std::uint8_t>> usable(exposures);
    core::ParallelFor(exposures, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j)
        usable[j] = Usable(stack.plane(j, channel), stack.width, stack.height,
                           curves[channel].saturation_code);
    });
    const ResponseMerger prototype(curves[channel], stack.bits);
    core::ParallelFor(pixels, 16384, [&](std::size_t begin, std::size_t end) {
      ResponseMerger merger = prototype;
      std::vector<std::uint16_t> codes(exposures);
      std::vector<std::uint8_t> use(exposures);
      for (std::size_t p = begin; p < end; ++p) {
        for (std::size_t j = 0; j < exposures; ++j) {
          codes[j] = stack.plane(j, channel)[p];
          use[j] = usable[j][p];
        }
        const PixelRadiance pixel = merger.Merge(codes, use, merged.exposures_s);
        const std::size_t at = channel * pixels + p;
        merged.radiance.data[at] = static_cast<float>(pixel.value);
        merged.sigma.data[at] = static_cast<float>(pixel.sigma);
        merged.count.data[at] = static_cast<float>(pixel.count);
        merged.mask[at] = pixel.mask;
      }
    });
  }
  return merged;
}

ExposureRatios::Result EstimateExposures(const PictureStack& stack,
                                         std::span<const ResponseCurve> curves) {
  constexpr int kPixels = 20000;
  RequireChannels(stack, curves);
  const auto exposures = static_cast<int>(stack.pictures.size());
  std::vector<double> exposures_s;
  for (const StackPicture& picture : stack.pictures) exposures_s.push_back(picture.exposure_s);
  ExposureRatios ratios(exposures);
  for (int channel = 0; channel < stack.channels; ++channel) {
    const ResponseSamples pixels =
        PixelSamples(stack, channel, curves[channel].saturation_code, kPixels);
    ResponseMerger merger(curves[channel], stack.bits);
    std::vector<std::uint8_t> usable(exposures, 1);
    std::vector<RungSample> rungs;
    for (int i = 0; i < pixels.count(); ++i) {
      const auto codes =
          std::span(pixels.code).subspan(pixels.index(i, 0), exposures);
      const PixelRadiance merged = merger.Merge(codes, usable, exposures_s);
      if (merged.mask) continue;
      rungs.clear();
      for (const StackSample& sample : merger.samples())
        rungs.push_back({sample.exposure, sample.radiance,
                         merged.value * merged.value * sample.relative_variance});
      ratios.Add(rungs);
    }
  }
  return ratios.Solve(exposures - 1);
}

void WriteMergedPicture(const std::filesystem::path& path, const MergedPicture& merged,
                        const std::map<std::string, std::string>& provenance) {
  const core::Image& radiance = merged.radiance;
  const std::vector<std::string> names = radiance.channels == 1
                                             ? std::vector<std::string>{"Y"}
                                             : std::vector<std::string>{"R", "G", "B"};
  core::ExrPartView part;
  part.width = radiance.width;
  part.height = radiance.height;
  for (int channel = 0; channel < radiance.channels; ++channel) {
    const std::string& name = names[channel];
    part.channels.push_back({name, radiance.plane(channel)});
    part.channels.push_back({"sigma." + name, merged.sigma.plane(channel)});
    part.channels.push_back({"count." + name, merged.count.plane(channel)});
    part.channels.push_back(
        {"mask." + name,
         std::span(merged.mask).subspan(radiance.plane_size() * channel, radiance.plane_size())});
  }
  part.attributes = {{"luxfield:kind", std::string("merged picture")},
                     {"luxfield:unit", std::string("relative")}};
  std::string exposures;
  for (const double t : merged.exposures_s)
    exposures += fmt::format("{}{:.9g}", exposures.empty() ? "" : " ", t);
  part.attributes["luxfield:exposures_s"] = exposures;
  for (const auto& [key, value] : provenance) part.attributes["luxfield:" + key] = value;
  core::WriteExr(path, std::span(&part, 1));
}

}  // namespace luxfield::reconstruct
