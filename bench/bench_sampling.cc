#include "luxfield/bench/bench_sampling.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/lamp_tables.h"
#include "luxfield/render/estimators/sampling_estimators.h"

namespace luxfield::bench {
namespace {

struct Bench {
  const render::Device& device;
  const render::GBuffer& gbuffer;
  const render::LuminaireOnDevice& luminaire;
  int repeats;

  // The least of some times; the run before them compiles and touches memory.
  double Seconds(render::Estimator& estimator, const render::EstimatorOptions& options) const {
    render::Lighting lighting(device, gbuffer);
    double least = 0;
    for (int run = 0; run <= repeats; ++run) {
      device.Finish();
      const core::Stopwatch stopwatch;
      estimator.Light({gbuffer}, render::PosedLuminaire{luminaire}, options, lighting);
      device.Finish();
      const double seconds =
          device.info().is_cpu ? stopwatch.CoreSeconds() : stopwatch.WallSeconds();
      if (run == 1 || (run > 1 && seconds < least)) least = seconds;
    }
    return least;
  }
};

}  // namespace

nlohmann::json BenchSampling(const BenchSamplingOptions& options) {
  if (std::min({options.width, options.height, options.repeats, options.few}) < 1 ||
      options.many <= options.few)
    throw InputError(
        "bench sampling: width, height, repeats and samples must be at least 1, and the larger "
        "number of samples above the smaller");
  const auto device = render::Device::Open(options.device, options.threads);
  const auto field = render::SyntheticCar2(options.car2);
  const auto gbuffer = render::RoadGBuffer(device, options.width, options.height);
  const render::LampTables tables =
      render::BuildLampTables(field, gbuffer, {.sat = true, .cells = true});
  const render::LuminaireOnDevice luminaire(device, field, tables.view());
  double pixels = 0;
  for (const auto& position : gbuffer.position.Download<cl_float4>()) pixels += position.s[3] != 0;
  const Bench bench{device, gbuffer, luminaire, options.repeats};

  struct Case {
    std::string name, sampler;
    float basis_share;
  };
  const float mixed = render::Knobs{}.basis_share;
  nlohmann::json rows = nlohmann::json::array();
  for (const Case& c : {Case{"windowed", "windowed", 0}, Case{"windowed, mixed", "windowed", mixed},
                        Case{"cells", "cells", mixed}, Case{"uniform", "uniform", mixed},
                        Case{"basis", "basis", mixed}, Case{"precomputed", "precomputed", mixed}}) {
    if (!options.samplers.empty() && std::ranges::count(options.samplers, c.name) == 0) continue;
    render::EstimatorOptions few, many;
    few.knobs.basis_share = many.knobs.basis_share = c.basis_share;
    few.samples_per_pixel = options.few;
    many.samples_per_pixel = options.many;
    const double more_samples = (options.many - options.few) * pixels;
    const auto draws =
        render::MakeSamplingEstimator(c.sampler, device, render::SamplingKernel::kDrawsOnly);
    const auto estimator = render::MakeEstimator(c.sampler, device);
    const double draw = (bench.Seconds(*draws, many) - bench.Seconds(*draws, few)) / more_samples;
    const double few_s = bench.Seconds(*estimator, few);
    const double shaded = (bench.Seconds(*estimator, many) - few_s) / more_samples;
    rows.push_back({{"scene", "car2"},
                    {"sampler", c.name},
                    {"ns_per_sample", 1e9 * draw},
                    {"shaded_ns_per_sample", 1e9 * shaded},
                    {"set_up_ns_per_pixel", 1e9 * (few_s / pixels - options.few * shaded)},
                    {"threads", device.info().compute_units}});
  }
  return rows;
}

}  // namespace luxfield::bench
