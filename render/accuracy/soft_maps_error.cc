#include "luxfield/render/accuracy/soft_maps_error.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/measures.h"

namespace luxfield::render {
namespace {

constexpr double kPixels = 3072;
constexpr int kSamples = 256;  // of each half of the reference

}  // namespace

SoftMapsError MeasureSoftMaps(LitScene& scene, const RenderOptions& options) {
  RenderOptions small = options;
  if (small.width == 0) small.width = scene.camera().width;
  if (small.height == 0) small.height = scene.camera().height;
  const double shrink =
      std::min(1.0, std::sqrt(kPixels / (static_cast<double>(small.width) * small.height)));
  small.width = std::max(1, static_cast<int>(std::lround(shrink * small.width)));
  small.height = std::max(1, static_cast<int>(std::lround(shrink * small.height)));
  small.antialias = 1;
  small.relight = false;
  small.sample_density = {};
  // Other lights are in all pictures alike.
  const std::size_t luminaires = scene.luminaires().size(), lights = scene.Lights().size();
  small.light_samples.assign(lights, 0);
  std::fill_n(small.light_samples.begin(), luminaires, kSamples);
  const core::Image soft = core::LuminanceImage(Renderer(scene, small).Render().radiance);
  small.shadows = Shadows::kTraced;
  core::Image half[2];
  for (int k = 0; k < 2; ++k) {
    small.seed = options.seed + static_cast<std::uint64_t>(k);
    half[k] = core::LuminanceImage(Renderer(scene, small).Render().radiance);
  }
  core::Image truth = half[0];
  double square = 0, noise = 0, sum = 0;
  for (std::size_t i = 0; i < truth.data.size(); ++i) {
    const double a = half[0].data[i], b = half[1].data[i], mean = 0.5 * (a + b);
    truth.data[i] = static_cast<float>(mean);
    square += (soft.data[i] - mean) * (soft.data[i] - mean);
    noise += 0.25 * (a - b) * (a - b);
    sum += mean;
  }
  SoftMapsError error;
  if (sum == 0) return error;
  const auto pixels = static_cast<double>(truth.data.size());
  error.rel_error = std::sqrt(std::max(0.0, square - noise) * pixels) / std::abs(sum);
  error.mean_lab = core::Compare(soft, truth).mean_lab;
  return error;
}

}  // namespace luxfield::render
