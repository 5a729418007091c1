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

}  // namespace

bool HasLayer(const render::Frame& frame, Layer layer, const core::Image* reference) {
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
      break;
  }
  return reference && reference->width == frame.width && reference->height == frame.height;
}

core::Image LayerOf(const render::Frame& frame, Layer layer, const core::Image* reference) {
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
      return core::LabDifference(frame.radiance, *reference);
  }
  return frame.radiance;
}

bool IsLinear(Layer layer) { return layer == Layer::kCoverage || layer == Layer::kLab; }

render::FalseColourScale AutomaticScaleOf(const core::Image& values, Layer layer) {
  if (layer == Layer::kCoverage) return {0, 1};
  if (layer == Layer::kLab) return {0, kLargestLab};
  return render::AutomaticScale(values);
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
  }
  return std::string(lumen ? "luminance" : "radiance") + " in " + render::RadianceUnitName(unit);
}

}  // namespace luxfield::view
