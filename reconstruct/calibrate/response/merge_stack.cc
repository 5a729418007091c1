#include "luxfield/reconstruct/calibrate/response/merge_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/calibrate/response/response_samples.h"

namespace luxfield::reconstruct {
namespace {

// A step is below 0.03 in ln I for curves of 17 stops; noise is a smooth function of it.
constexpr int kSteps = 512;
constexpr int kMaxIterations = 20;
constexpr double kEndMargin = 4;      // standard deviations
constexpr double kContradiction = 4;  // standard deviations of chi-squared
constexpr double kBeyond = 1;         // of the curve's ends, in ln I
constexpr double kEndSpan = 0.5;      // whose slope the curve goes on with outside, in ln I

// ln I of any code: beyond its ends the curve goes on with its mean slope next to them. That of the
// last nodes alone is mostly noise.
double ExtendedLogExposure(const ResponseCurve& curve, double z) {
  const auto& g = curve.log_exposure;
  const auto beyond = [&](std::size_t end, std::size_t inner) {
    const double slope = (g[end] - g[inner]) / std::log(curve.code[end] / curve.code[inner]);
    return g[end] + slope * std::log(z / curve.code[end]);
  };
  if (z < curve.low_code()) {
    const auto inner = std::upper_bound(g.begin(), g.end() - 1, g.front() + kEndSpan);
    return beyond(0, inner - g.begin());
  }
  if (z > curve.high_code()) {
    const auto inner = std::lower_bound(g.begin() + 1, g.end(), g.back() - kEndSpan) - 1;
    return beyond(g.size() - 1, inner - g.begin());
  }
  return curve.LogExposure(z);
}

// By how many standard deviations the mean of what a limit leaves lies below the mean of all, the
// limit `sigmas` above it.
double TruncatedShare(double sigmas) {
  if (sigmas < -20) return -sigmas;  // to 1 / 400 of it; both factors underflow farther out
  const double density = std::exp(-sigmas * sigmas / 2) / std::sqrt(2 * std::numbers::pi);
  return density / (0.5 * std::erfc(-sigmas / std::numbers::sqrt2));
}

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

constexpr const char* kKindAttribute = "luxfield:kind";
constexpr const char* kKind = "merged picture";

std::string ChannelName(int channels, int channel) {
  return channels == 1 ? "Y" : std::string(1, "RGB"[channel]);
}

void RequireChannels(const PictureStack& stack, std::span<const ResponseCurve> curves) {
  if (static_cast<int>(curves.size()) != stack.channels)
    throw InputError(fmt::format(
        "the calibration has {} channels, the pictures {}; calibrate the response of this camera "
        "and mode",
        curves.size(), stack.channels));
}

}  // namespace

void MergeFigures::Add(const PixelRadiance& pixel) {
  ++pixels;
  saturated += pixel.mask == lightfield::kSaturated;
  too_dark += pixel.mask == lightfield::kTooDark;
  if (pixel.mask) return;
  chi_squared += pixel.misfit;
  degrees += pixel.degrees;
}

MergeFigures& MergeFigures::operator+=(const MergeFigures& other) {
  pixels += other.pixels;
  saturated += other.saturated;
  too_dark += other.too_dark;
  chi_squared += other.chi_squared;
  degrees += other.degrees;
  return *this;
}

ResponseMerger::ResponseMerger(const ResponseCurve& curve, int bits)
    : low_(curve.log_exposure.front()),
      high_(curve.log_exposure.back()),
      saturation_code_(curve.saturation_code) {
  const int codes = 1 << bits;
  for (int z = 0; z < codes; ++z)
    exposure_.push_back(std::exp(ExtendedLogExposure(curve, std::max<double>(z, 0.5))));
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

double ResponseMerger::LogExposure(double radiance, const StackSample* sample) const {
  return std::log(radiance) + log_t_[sample - all_.data()];
}

void ResponseMerger::Collect(std::span<const std::uint16_t> codes,
                             std::span<const std::uint8_t> usable,
                             std::span<const double> exposures_s) {
  all_.clear();
  log_t_.clear();
  for (std::size_t j = 0; j < codes.size(); ++j) {
    if (!usable[j] || codes[j] >= saturation_code_) continue;
    all_.push_back({static_cast<int>(j), exposure_[codes[j]] / exposures_s[j], 0});
    log_t_.push_back(std::log(exposures_s[j]));
  }
  first_ = all_.data();
  last_ = first_ + all_.size();
}

double ResponseMerger::Choose() {
  // The longest exposure tells where the others lie well enough to leave out what is nowhere near
  // the curve and would only draw the estimate away.
  double radiance = last_[-1].radiance;
  while (last_ - first_ > 1 && LogExposure(radiance, first_) < low_ - kBeyond) ++first_;
  for (;; --last_) {
    radiance = Estimate(radiance);
    const double sigma = std::sqrt(last_[-1].relative_variance);
    if (LogExposure(radiance, last_ - 1) + kEndMargin * sigma < high_) break;
    // The next is a sample only where the curve is known.
    if (last_ - first_ == 1 || LogExposure(radiance, last_ - 2) < low_) break;
  }
  for (; last_ - first_ > 1 && LogExposure(radiance, first_) < low_; ++first_)
    radiance = Estimate(radiance);
  return Estimate(radiance);
}

void ResponseMerger::StateRange(PixelRadiance& pixel) const {
  const StackSample& longest = last_[-1];
  const double log_exposure = LogExposure(pixel.value, &longest);
  if (log_exposure < low_) {
    // Anywhere between 0 and the curve's lower end.
    const double range = pixel.value * std::exp(low_ - log_exposure), off = pixel.value - range / 2;
    pixel.sigma = std::sqrt(pixel.sigma * pixel.sigma + range * range / 12 + off * off);
    pixel.mask = lightfield::kTooDark;
    return;
  }
  // Had the pixel been saturated here, it would have been left out: what is left is too dark.
  const double sigma = std::sqrt(longest.relative_variance),
               truncated = sigma * TruncatedShare((high_ - log_exposure) / sigma);
  pixel.sigma = std::hypot(pixel.sigma, pixel.value * truncated);
  if (log_exposure > high_) pixel.mask = lightfield::kSaturated;
}

PixelRadiance ResponseMerger::Merge(std::span<const std::uint16_t> codes,
                                    std::span<const std::uint8_t> usable,
                                    std::span<const double> exposures_s) {
  Collect(codes, usable, exposures_s);
  if (first_ == last_) {
    const double least = exposure_[codes[0]] / exposures_s[0];
    return {least, least, 0, lightfield::kSaturated};
  }
  const double radiance = Choose();
  double weights = 0, squares = 0, curve_sigma = 0, misfit = 0;
  for (const StackSample& sample : samples()) {
    const double weight = 1 / sample.relative_variance, off = sample.radiance / radiance - 1;
    weights += weight;
    squares += weight * weight;
    curve_sigma += weight * At(LogExposure(radiance, &sample)).curve_sigma;
    misfit += weight * off * off;
  }
  curve_sigma /= weights;
  const auto degrees = static_cast<double>(samples().size() - 1);
  // Samples that contradict one another: something moved, or the pictures do not lie upon one
  // another.
  const double excess = degrees > 0 && misfit > degrees + kContradiction * std::sqrt(2 * degrees)
                            ? misfit / degrees
                            : 1;
  PixelRadiance pixel = {radiance,
                         radiance * std::sqrt(excess / weights + curve_sigma * curve_sigma),
                         weights * weights / squares, 0};
  pixel.misfit = misfit;
  pixel.degrees = degrees;
  StateRange(pixel);
  return pixel;
}

MergedPicture MergeStack(const PictureStack& stack, std::span<const ResponseCurve> curves) {
  RequireChannels(stack, curves);
  MergedPicture merged{core::Image(stack.width, stack.height, stack.channels),
                       core::Image(stack.width, stack.height, stack.channels),
                       core::Image(stack.width, stack.height, stack.channels),
                       {},
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
    constexpr std::size_t kPart = 16384;
    std::vector<MergeFigures> parts((pixels + kPart - 1) / kPart);
    core::ParallelFor(parts.size(), 1, [&](std::size_t first, std::size_t last) {
      ResponseMerger merger = prototype;
      std::vector<std::uint16_t> codes(exposures);
      std::vector<std::uint8_t> use(exposures);
      for (std::size_t p = first * kPart; p < std::min(last * kPart, pixels); ++p) {
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
        parts[p / kPart].Add(pixel);
      }
    });
    MergeFigures& figures = merged.figures.emplace_back();
    for (const MergeFigures& part : parts) figures += part;
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
      const auto codes = std::span(pixels.code).subspan(pixels.index(i, 0), exposures);
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

bool IsMergedPicture(const std::filesystem::path& path) {
  const core::ExrReader reader(path);
  return reader.parts()[0].attributes.contains(kKindAttribute) &&
         reader.GetString(0, kKindAttribute) == kKind;
}

MergedPicture ReadMergedPicture(const std::filesystem::path& path) {
  if (!IsMergedPicture(path))
    throw InputError(path.string(), "is not a merged picture",
                     "name what `luxfield merge IMAGES` has written");
  core::ExrReader reader(path);
  const auto& part = reader.parts()[0];
  const bool grey = reader.has_channel(0, "Y");
  const int channels = grey ? 1 : 3;
  const core::Image empty(part.width, part.height, channels);
  MergedPicture merged{empty, empty, empty, {}, {}, {}};
  for (int channel = 0; channel < channels; ++channel) {
    const std::string name = ChannelName(channels, channel);
    for (const std::string& needed : {name, "sigma." + name, "count." + name, "mask." + name})
      if (!reader.has_channel(0, needed))
        throw InputError(path.string(), fmt::format("has no channel {}", needed),
                         "merge the pictures again");
    reader.ReadFloat(0, name, merged.radiance.plane(channel));
    reader.ReadFloat(0, "sigma." + name, merged.sigma.plane(channel));
    reader.ReadFloat(0, "count." + name, merged.count.plane(channel));
    const auto mask = reader.ReadUint(0, "mask." + name);
    merged.mask.insert(merged.mask.end(), mask.begin(), mask.end());
  }
  for (std::size_t k = 0; k < merged.mask.size(); ++k)
    if (!(std::isfinite(merged.radiance.data[k]) && merged.sigma.data[k] >= 0 &&
          std::isfinite(merged.sigma.data[k])))
      throw InputError(
          path.string(),
          fmt::format("holds {} with sigma {}", merged.radiance.data[k], merged.sigma.data[k]),
          "merge the pictures again");
  return merged;
}

void WriteMergedPicture(const std::filesystem::path& path, const MergedPicture& merged,
                        const std::map<std::string, std::string>& provenance) {
  const core::Image& radiance = merged.radiance;
  core::ExrPartView part;
  part.width = radiance.width;
  part.height = radiance.height;
  for (int channel = 0; channel < radiance.channels; ++channel) {
    const std::string name = ChannelName(radiance.channels, channel);
    part.channels.push_back({name, radiance.plane(channel)});
    part.channels.push_back({"sigma." + name, merged.sigma.plane(channel)});
    part.channels.push_back({"count." + name, merged.count.plane(channel)});
    part.channels.push_back(
        {"mask." + name,
         std::span(merged.mask).subspan(radiance.plane_size() * channel, radiance.plane_size())});
  }
  part.attributes = {{kKindAttribute, std::string(kKind)},
                     {"luxfield:unit", std::string("relative")}};
  std::string exposures;
  for (const double t : merged.exposures_s)
    exposures += fmt::format("{}{:.9g}", exposures.empty() ? "" : " ", t);
  part.attributes["luxfield:exposures_s"] = exposures;
  for (const auto& [key, value] : provenance) part.attributes["luxfield:" + key] = value;
  core::WriteExr(path, std::span(&part, 1));
}

}  // namespace luxfield::reconstruct
