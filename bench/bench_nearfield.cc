#include "luxfield/bench/bench_nearfield.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/render/accuracy/lamp_tables.h"
#include "luxfield/render/estimators/estimator.h"

namespace luxfield::bench {
namespace {

constexpr std::uint64_t kSeed = 11;

struct Pixels {
  std::vector<cl_float4> position, normal;
};

// Light of the pixels `chosen` of the reference, 3 channels, in double rounded to float32.
core::Image Reference(const lightfield::LightField& field, const Pixels& pixels,
                      const std::vector<std::size_t>& chosen) {
  core::Image image(static_cast<int>(chosen.size()), 1, 3);
  core::ParallelFor(chosen.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto& p = pixels.position[chosen[k]];
      const auto& n = pixels.normal[chosen[k]];
      const auto e =
          lightfield::ExactIrradiance(field, {p.s[0], p.s[1], p.s[2]}, {n.s[0], n.s[1], n.s[2]});
      for (int channel = 0; channel < 3; ++channel)
        image.at(channel, 0, static_cast<int>(k)) = static_cast<float>(e[channel]);
    }
  });
  return image;
}

core::Image Chosen(const std::vector<cl_float4>& irradiance,
                   const std::vector<std::size_t>& chosen) {
  core::Image image(static_cast<int>(chosen.size()), 1, 3);
  for (std::size_t k = 0; k < chosen.size(); ++k)
    for (int channel = 0; channel < 3; ++channel)
      image.at(channel, 0, static_cast<int>(k)) = irradiance[chosen[k]].s[channel];
  return image;
}

struct Timing {
  double wall_s = 0, core_s = 0, device_s = 0;
  std::vector<render::KernelTime> kernels;  // of the last run
  std::vector<cl_float4> irradiance;
  double samples = 0;  // light samples of all pixels
};

Timing Time(const render::Device& device, render::Estimator& estimator,
            const render::GBuffer& gbuffer, const render::LuminaireOnDevice& luminaire,
            int samples_per_pixel, int repeats) {
  render::Lighting lighting(device, gbuffer);
  render::EstimatorOptions options;
  options.samples_per_pixel = samples_per_pixel;
  std::vector<double> wall_s, core_s, device_s;
  Timing timing;
  const auto light = [&] {
    lighting.Clear();
    device.Finish();
    device.TakeKernelTimes();
    const core::Stopwatch stopwatch;
    estimator.Light({gbuffer}, render::PosedLuminaire{luminaire}, options, lighting);
    device.Finish();
    return stopwatch;
  };
  light();  // compiles and touches memory
  for (int run = 0; run < repeats; ++run) {
    const core::Stopwatch stopwatch = light();
    wall_s.push_back(stopwatch.WallSeconds());
    core_s.push_back(stopwatch.CoreSeconds());
    timing.kernels = device.TakeKernelTimes();
    device_s.push_back(0);
    for (const auto& kernel : timing.kernels) device_s.back() += kernel.device_s;
  }
  timing.wall_s = core::Median(wall_s);
  timing.core_s = core::Median(core_s);
  timing.device_s = core::Median(device_s);
  timing.irradiance = lighting.irradiance.Download<cl_float4>();
  for (const cl_uint n : lighting.samples.Download<cl_uint>()) timing.samples += n;
  return timing;
}

}  // namespace

nlohmann::json BenchNearfield(const BenchNearfieldOptions& options) {
  if (std::min({options.width, options.height, options.repeats}) < 1 ||
      options.reference_pixels < 0)
    throw InputError(
        "bench nearfield: width, height and repeats must be at least 1, reference pixels at least "
        "0");
  const auto device = render::Device::Open(options.device, options.threads);
  for (const auto& name : options.estimators)
    render::MakeEstimator(name, device);  // refuses unknown names
  const auto field = render::SyntheticCar2(options.car2);
  const auto gbuffer = render::RoadGBuffer(device, options.width, options.height);

  const Pixels pixels{gbuffer.position.Download<cl_float4>(), gbuffer.normal.Download<cl_float4>()};
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < pixels.position.size(); ++k)
    if (pixels.position[k].s[3] != 0) chosen.push_back(k);
  if (options.reference_pixels > 0 &&
      chosen.size() > static_cast<std::size_t>(options.reference_pixels)) {
    core::Random random(kSeed, ~std::uint64_t{0});
    std::shuffle(chosen.begin(), chosen.end(), random);
    chosen.resize(options.reference_pixels);
  }
  const core::Image reference = Reference(field, pixels, chosen);

  nlohmann::json rows = nlohmann::json::array();
  for (const auto& traits : render::EstimatorList()) {
    if (!options.estimators.empty() &&
        std::find(options.estimators.begin(), options.estimators.end(), traits.name) ==
            options.estimators.end())
      continue;
    const auto estimator = render::MakeEstimator(traits.name, device);
    const render::LampTables tables = render::BuildLampTables(field, gbuffer, traits.needs);
    const render::LuminaireOnDevice luminaire(device, field, tables.view());
    for (const int samples : traits.noise_free ? std::vector<int>{0} : options.samples_per_pixel) {
      const Timing timing =
          Time(device, *estimator, gbuffer, luminaire, std::max(samples, 1), options.repeats);
      const auto difference = core::Compare(Chosen(timing.irradiance, chosen), reference);
      rows.push_back({{"scene", "car2"},
                      {"estimator", traits.name},
                      {"spp", samples},
                      {"width", options.width},
                      {"height", options.height},
                      {"images", field.geometry.grid.count()},
                      {"channels", field.geometry.channels},
                      {"threads", device.info().compute_units},
                      {"build_core_s", tables.core_s},
                      {"fps", 1 / timing.wall_s},
                      {"core_s", timing.core_s},
                      {"device_s", timing.device_s},
                      {"samples_per_s", timing.samples / timing.wall_s},
                      {"kernels", timing.kernels},
                      {"rel_rmse", difference.rel_rmse},
                      {"mean_lab", difference.mean_lab},
                      {"bias", difference.bias}});
    }
  }
  return rows;
}

}  // namespace luxfield::bench
