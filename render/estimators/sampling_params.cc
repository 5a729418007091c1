#include "luxfield/render/estimators/sampling_params.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/core/error.h"

namespace luxfield::render {
namespace {

constexpr int kMaxSamples = 1 << 20;  // expected counts stay exact to 1/16 sample in float32
constexpr int kNewtonSteps = 10;      // most take three or four

float LightShareOf(const StrategyKnobs& knobs) {
  switch (knobs.strategies) {
    case Strategies::kLight:
      return 1;
    case Strategies::kBrdf:
      return 0;
    case Strategies::kFixed:
      return knobs.light_share;
    default:
      return 0.5f;
  }
}

}  // namespace

SamplingParams MakeSamplingParams(const EstimatorOptions& options) {
  options.knobs.Validate();
  if (options.samples_per_pixel < 1 || options.samples_per_pixel > kMaxSamples)
    throw InputError(fmt::format("samples per pixel = {} must be 1 to {}",
                                 options.samples_per_pixel, kMaxSamples));
  const StrategyKnobs& knobs = options.knobs.strategies;
  SamplingParams params{};
  params.samples = options.samples_per_pixel;
  params.seed_lo = static_cast<std::uint32_t>(options.seed);
  params.seed_hi = static_cast<std::uint32_t>(options.seed >> 32);
  params.stream = options.stream;
  params.first_pixel = options.first_pixel;
  params.light_share = LightShareOf(knobs);
  if (IsAdaptive(knobs.strategies)) {
    params.pilot_samples = std::min(knobs.pilot, options.samples_per_pixel / 4 * 2);
    const bool newton = knobs.strategies == Strategies::kNewton;
    params.newton_steps = newton ? kNewtonSteps : 1;
    params.guard =
        newton && params.pilot_samples > 0 ? 1 / static_cast<float>(params.pilot_samples) : 0.0f;
  }
  return params;
}

}  // namespace luxfield::render
