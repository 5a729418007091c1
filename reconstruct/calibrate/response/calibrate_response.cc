#include "luxfield/reconstruct/calibrate/response/calibrate_response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/parallel.h"
#include "luxfield/reconstruct/calibrate/response/merge_stack.h"
#include "luxfield/reconstruct/calibrate/response/response_noise.h"

namespace luxfield::reconstruct {
namespace {

using core::Field;
using core::Json;

constexpr const char* kFormat = "luxfield response calibration";
constexpr int kVersion = 1;
constexpr int kNoisePixels = 20000, kNoiseBins = 16, kNoiseRounds = 4;

const std::pair<ResponseMethod, const char*> kMethods[] = {
    {ResponseMethod::kDebevecMalik, "debevec"},
    {ResponseMethod::kRobertson, "robertson"},
    {ResponseMethod::kPolynomial, "polynomial"},
    {ResponseMethod::kPublished, "debevec-1997"}};

// Noise of any pixels about their own merged radiance, from that of the fit's samples on.
void MeasurePixelNoise(const PictureStack& stack, int channel, ResponseCurve& curve) {
  const ResponseSamples pixels = PixelSamples(stack, channel, curve.saturation_code, kNoisePixels);
  std::vector<double> exposures_s;
  for (const StackPicture& picture : stack.pictures) exposures_s.push_back(picture.exposure_s);
  for (int round = 0; round < kNoiseRounds; ++round) {
    ResponseMerger merger(curve, stack.bits);
    std::vector<ExposureResidual> residuals;
    for (int i = 0; i < pixels.count(); ++i) {
      const std::size_t first = pixels.index(i, 0);
      const auto codes = std::span(pixels.code).subspan(first, pixels.exposures);
      const auto usable = std::span(pixels.usable).subspan(first, pixels.exposures);
      const PixelRadiance merged = merger.Merge(codes, usable, exposures_s);
      if (merged.mask || merger.samples().size() < 2) continue;
      double weights = 0;
      for (const StackSample& sample : merger.samples()) weights += 1 / sample.relative_variance;
      for (const StackSample& sample : merger.samples())
        residuals.push_back({curve.Code(std::log(merged.value * exposures_s[sample.exposure])),
                             sample.radiance / merged.value - 1,
                             1 / sample.relative_variance / weights});
    }
    ExposureNoise noise = EstimateExposureNoise(residuals, curve.saturation_code, kNoiseBins);
    if (noise.code.empty())
      throw InputError(fmt::format(
          "channel {}: too few pixels are usable in two pictures to tell their noise; choose "
          "exposures closer to one another",
          channel));
    curve.noise_code = std::move(noise.code);
    curve.noise = std::move(noise.sigma);
  }
}

Json ChannelJson(const FittedResponse& channel) {
  const ResponseCurve& curve = channel.curve;
  return {{"saturation_code", curve.saturation_code},
          {"reference_code", curve.reference_code},
          {"code", curve.code},
          {"log_exposure", curve.log_exposure},
          {"log_exposure_sigma", curve.sigma},
          {"noise_code", curve.noise_code},
          {"noise_relative", curve.noise},
          {"samples", channel.samples},
          {"order", channel.order},
          {"fit_chi_squared", channel.chi_squared},
          {"fit_degrees", channel.degrees}};
}

[[noreturn]] void Refuse(const std::string& file, const std::string& problem) {
  throw InputError(file, problem, "calibrate the response again");
}

std::vector<double> Numbers(const Json& json, const std::string& key, std::size_t size,
                            const std::string& file) {
  auto values = Field<std::vector<double>>(json, key, file);
  if (values.empty() || (size && values.size() != size))
    Refuse(file, fmt::format("{} has {} entries", key, values.size()));
  return values;
}

void RequireRising(const std::vector<double>& values, const char* key, const std::string& file) {
  for (std::size_t k = 1; k < values.size(); ++k)
    if (!(values[k] > values[k - 1])) Refuse(file, fmt::format("{} does not rise", key));
}

ResponseCurve ReadCurve(const Json& json, int bits, const std::string& file) {
  ResponseCurve curve;
  curve.saturation_code = Field<double>(json, "saturation_code", file);
  curve.reference_code = Field<double>(json, "reference_code", file);
  curve.code = Numbers(json, "code", 0, file);
  curve.log_exposure = Numbers(json, "log_exposure", curve.code.size(), file);
  curve.sigma = Numbers(json, "log_exposure_sigma", curve.code.size(), file);
  curve.noise_code = Numbers(json, "noise_code", 0, file);
  curve.noise = Numbers(json, "noise_relative", curve.noise_code.size(), file);
  RequireRising(curve.code, "code", file);
  RequireRising(curve.log_exposure, "log_exposure", file);
  RequireRising(curve.noise_code, "noise_code", file);
  if (curve.code.size() < 3) Refuse(file, "code has fewer than 3 entries");
  if (!(curve.saturation_code < std::ldexp(1.0, bits)) ||
      !(curve.code.back() < curve.saturation_code) ||
      !(curve.noise_code.back() < curve.saturation_code) || !(curve.code.front() >= 0.5) ||
      !(curve.noise_code.front() > 0))
    Refuse(file, fmt::format("codes are not between 0 and saturation_code = {} of {} bits",
                             curve.saturation_code, bits));
  for (const double value : curve.sigma)
    if (!(value >= 0)) Refuse(file, "log_exposure_sigma is below 0");
  for (const double value : curve.noise)
    if (!(value > 0)) Refuse(file, "noise_relative must be above 0");
  return curve;
}

}  // namespace

std::vector<ResponseCurve> ResponseCalibration::curves() const {
  std::vector<ResponseCurve> result;
  for (const FittedResponse& channel : channels) result.push_back(channel.curve);
  return result;
}

ResponseCalibration CalibrateResponse(const PictureStack& stack,
                                      const CalibrateResponseOptions& options) {
  const bool published = options.fit.method == ResponseMethod::kPublished;
  if (published && stack.bits != 8)
    throw InputError(
        fmt::format("method debevec-1997 takes histograms of 8-bit pictures, these have {} bits; "
                    "use another method",
                    stack.bits));
  ResponseCalibration result;
  result.bits = stack.bits;
  result.method = options.fit.method;
  for (const StackPicture& picture : stack.pictures)
    result.exposures_s.push_back(picture.exposure_s);
  result.channels.resize(stack.channels);
  const double saturation = FindSaturationCode(stack), reference = std::ceil(saturation / 2);
  core::ParallelFor(stack.channels, 1, [&](std::size_t begin, std::size_t end) {
    for (auto channel = static_cast<int>(begin); channel < static_cast<int>(end); ++channel) {
      const ResponseSamples samples =
          published ? HistogramSamples(stack, channel, options.samples)
                    : FlatSamples(stack, channel, saturation, options.samples);
      result.channels[channel] = FitResponse(samples, result.exposures_s, saturation, reference,
                                             options.fit, fmt::format("channel {}", channel));
      MeasurePixelNoise(stack, channel, result.channels[channel].curve);
    }
  });
  return result;
}

std::string ResponseMethodName(ResponseMethod method) {
  for (const auto& [known, name] : kMethods)
    if (known == method) return name;
  return {};
}

ResponseMethod ResponseMethodFromName(const std::string& name) {
  for (const auto& [method, known] : kMethods)
    if (known == name) return method;
  throw InputError(fmt::format(
      "response method '{}' is unknown; use debevec, robertson, polynomial or debevec-1997", name));
}

Json ToJson(const ResponseCalibration& calibration) {
  Json channels = Json::array();
  for (const FittedResponse& channel : calibration.channels)
    channels.push_back(ChannelJson(channel));
  return {{"format", kFormat},
          {"version", kVersion},
          {"bits", calibration.bits},
          {"method", ResponseMethodName(calibration.method)},
          {"exposures_s", calibration.exposures_s},
          {"channels", channels},
          {"provenance", calibration.provenance}};
}

void WriteResponseCalibration(const std::filesystem::path& path,
                              const ResponseCalibration& calibration) {
  core::WriteJson(path, ToJson(calibration));
}

StoredResponse ReadResponseCalibration(const std::filesystem::path& path) {
  const std::string file = path.string(), bytes = core::ReadFile(path);
  const Json json = core::ParseJson(bytes, file);
  if (Field<std::string>(json, "format", file) != kFormat)
    throw InputError(file, "is not a response calibration",
                     "write one with `luxfield calibrate response`");
  if (Field<int>(json, "version", file) != kVersion)
    Refuse(file, fmt::format("has version {}, this program reads {}",
                             Field<int>(json, "version", file), kVersion));
  StoredResponse result;
  result.bits = Field<int>(json, "bits", file);
  if (result.bits != 8 && result.bits != 16)
    Refuse(file, fmt::format("bits = {} is neither 8 nor 16", result.bits));
  for (const Json& channel : Field<std::vector<Json>>(json, "channels", file))
    result.curves.push_back(ReadCurve(channel, result.bits, file));
  result.sha256 = core::Sha256(bytes);
  return result;
}

}  // namespace luxfield::reconstruct
