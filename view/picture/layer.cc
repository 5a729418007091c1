#include "luxfield/view/picture/layer.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/measures.h"

namespace luxfield::view {
namespace {

constexpr double kLargestLab = 10;

core::Image RelativeNoise(const render::Frame& frame) {
  core::Image noise = frame.variance;
  double sum = 0;
  const core::Image luminance = core::LuminanceImage(frame.radiance);
  for (const float value : luminance.data) sum += value;
  const double mean = sum / static_cast<double>(luminance.data.size());
  for (float& value : noise.data)
    value = mean > 0 ? static_cast<float>(std::sqrt(std::max(0.0f, value)) / mean) : 0;
  return noise;
}

const core::Image& FeedbackOf(Layer layer, const render::Feedback& feedback) {
  return layer == Layer::kLightShare ? feedback.light_share : feedback.image_share;
}

// Of one channel, by its nearest pixels.
core::Image Stretched(const core::Image& image, int width, int height) {
  core::Image stretched(width, height, 1);
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      stretched.at(0, row, column) =
          image.at(0, static_cast<int>((row + 0.5) * image.height / height),
                   static_cast<int>((column + 0.5) * image.width / width));
  return stretched;
}

}  // namespace

bool HasLayer(const render::Frame& frame, Layer layer, const LayerSources& sources) {
  switch (layer) {
    case Layer::kRadiance:
      return true;
    case Layer::kIrradiance:
      return !frame.irradiance.data.empty();
    case Layer::kCoverage:
      return !frame.coverage.data.empty();
    case Layer::kSamples:
      return !frame.samples.data.empty();
    case Layer::kNoise:
      return !frame.variance.data.empty();
    case Layer::kLab:
      return sources.reference && sources.reference->width == frame.width &&
             sources.reference->height == frame.height;
    case Layer::kLightShare:
    case Layer::kImageShare:
      break;
  }
  return sources.feedback && !FeedbackOf(layer, *sources.feedback).data.empty();
}

core::Image LayerOf(const render::Frame& frame, Layer layer, const LayerSources& sources) {
  switch (layer) {
    case Layer::kRadiance:
      break;
    case Layer::kIrradiance:
      return frame.irradiance;
    case Layer::kCoverage:
      return frame.coverage;
    case Layer::kSamples:
      return frame.samples;
    case Layer::kNoise:
      return RelativeNoise(frame);
    case Layer::kLab:
      return core::LabDifference(frame.radiance, *sources.reference);
    case Layer::kLightShare:
    case Layer::kImageShare:
      return Stretched(FeedbackOf(layer, *sources.feedback), frame.width, frame.height);
  }
  return frame.radiance;
}

bool IsFeedback(Layer layer) { return layer == Layer::kLightShare || layer == Layer::kImageShare; }

bool IsLinear(Layer layer) {
  return layer == Layer::kCoverage || layer == Layer::kLab || IsFeedback(layer);
}

render::FalseColourScale AutomaticScaleOf(const core::Image& values, Layer layer) {
  if (layer == Layer::kCoverage || IsFeedback(layer)) return {0, 1};
  if (layer == Layer::kLab) return {0, kLargestLab};
  render::FalseColourScale scale = render::AutomaticScale(values);
  if (layer == Layer::kSamples && scale.max > 1) scale.min = std::max(scale.min, 1.0);
  return scale;
}

std::optional<double> PositionOn(const render::FalseColourScale& scale, Layer layer, double value) {
  if (IsLinear(layer)) return (value - scale.min) / (scale.max - scale.min);
  if (!(value > 0)) return {};
  return std::log(value / scale.min) / std::log(scale.max / scale.min);
}

std::string QuantityOf(Layer layer, lightfield::FluxUnit unit) {
  const bool lumen = unit == lightfield::FluxUnit::kLumen;
  switch (layer) {
    case Layer::kRadiance:
      break;
    case Layer::kIrradiance:
      return std::string(lumen ? "illuminance" : "irradiance") + " in " +
             render::IrradianceUnitName(unit) + ", direct light only";
    case Layer::kCoverage:
      return "share of the pixel that hits something";
    case Layer::kSamples:
      return "light samples a pixel";
    case Layer::kNoise:
      return "sigma of the luminance over the mean";
    case Layer::kLab:
      return "Lab difference to the reference";
    case Layer::kLightShare:
      return "alpha: share of samples that follow the light, the others follow the BRDF";
    case Layer::kImageShare:
      return "share of a lamp's images that light the point";
  }
  return std::string(lumen ? "luminance" : "radiance") + " in " + render::RadianceUnitName(unit);
}

}  // namespace luxfield::view
