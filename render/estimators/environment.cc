#include "luxfield/render/estimators/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/sampling_params.h"
#include "luxfield/render/kernels/environment/environment_types.clh"

namespace luxfield::render {
namespace {

constexpr char kPath[] = "kernels/environment/environment.cl";
constexpr int kInterleaved = 4;  // sets along each axis
constexpr std::size_t kDrawGroup = 16;
constexpr std::size_t kMaxSetBytes = std::size_t{256} << 20;

EnvironmentSampling MakeEnvironmentSampling(const EstimatorOptions& options, int width) {
  const EnvironmentKnobs& knobs = options.knobs.environment;
  EnvironmentSampling params{};
  params.balance = static_cast<int>(knobs.balance);
  params.brdf_samples = static_cast<int>(
      std::ceil(double{knobs.brdf_share} * static_cast<double>(options.samples_per_pixel)));
  const int light_samples = options.samples_per_pixel - params.brdf_samples;
  params.light_samples = static_cast<float>(light_samples);
  params.capacity = light_samples;
  params.sets_per_side = knobs.sets == SampleSets::kInterleaved ? kInterleaved : 1;
  params.width = width;
  return params;
}

// A tile of less than one sample costs one, and expected numbers are off by their rounding.
std::size_t MostSamples(const EstimatorOptions& options, std::size_t tiles) {
  const auto samples = static_cast<std::size_t>(options.samples_per_pixel);
  return samples + samples / 1024 + tiles + 1;
}

}  // namespace

EnvironmentEstimator::EnvironmentEstimator(const Device& device, const std::string& build_options)
    : device_(device),
      build_options_(build_options),
      shadow_(device),
      draw_sets_(Program::Build(device, kPath, "-D GLOSSY=0 " + build_options), "DrawSets") {}

Kernel& EnvironmentEstimator::KernelFor(bool glossy) {
  auto kernel = kernels_.find(glossy);
  if (kernel == kernels_.end())
    kernel = kernels_
                 .emplace(glossy, Kernel(Program::Build(device_, kPath,
                                                        fmt::format("-D GLOSSY={} {}", int{glossy},
                                                                    build_options_)),
                                         "LightEnvironment"))
                 .first;
  return kernel->second;
}

void EnvironmentEstimator::Light(const Receivers& receivers, const LightSource& source,
                                 const EstimatorOptions& options, Lighting& lighting) {
  const EnvironmentLight& light = RequireEnvironmentLight(traits(), source);
  RequireShadows(traits(), receivers.visibility);
  const GBuffer& gbuffer = receivers.gbuffer;
  SamplingParams sampling = MakeSamplingParams(options);
  const EnvironmentSampling own = MakeEnvironmentSampling(options, gbuffer.width);
  if (light.options().compensation > 0 && own.brdf_samples == 0)
    throw InputError(
        "environment map: MIS compensation leaves light to samples that follow the BRDF, and there "
        "are none; raise environment-brdf-share or set environment-compensation to 0");
  const Buffer sampling_params =
      Buffer::From(device_, std::span<const SamplingParams>(&sampling, 1));
  const Buffer own_params = Buffer::From(device_, std::span<const EnvironmentSampling>(&own, 1));

  Buffer draws;
  if (options.knobs.environment.sets != SampleSets::kScrambled && own.capacity > 0) {
    const std::size_t ranges = own.balance == kBalanceNone ? 1 : light.tile_count();
    const std::size_t sets =
        static_cast<std::size_t>(own.sets_per_side) * own.sets_per_side * ranges;
    const std::size_t bytes = sets * own.capacity * sizeof(EnvironmentDraw);
    if (bytes > kMaxSetBytes)
      throw InputError(fmt::format(
          "environment map: sample sets of {} samples for {} tiles take {:.0f} MiB, more than {}; "
          "use fewer samples or tiles, or environment-sets=scrambled",
          own.capacity, light.tile_count(), static_cast<double>(bytes) / 0x1p20,
          kMaxSetBytes >> 20));
    draws = Buffer(device_, bytes);
    draw_sets_
        .Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
             light.energies(), light.corners(), sampling_params, own_params, draws)
        .Enqueue({static_cast<std::size_t>(own.capacity), sets}, {kDrawGroup});
  }
  shadow_.Start(receivers.visibility.rays, gbuffer.glossy(),
                MostSamples(options, own.balance == kBalanceNone ? 1 : light.tile_count()),
                gbuffer.pixel_count());
  Kernel& kernel = KernelFor(gbuffer.glossy());
  sampling.shadow_rays = shadow_.per_pixel();
  for (std::size_t first = 0; first < gbuffer.pixel_count(); first += shadow_.pixels_at_once()) {
    const std::size_t pixels = std::min(shadow_.pixels_at_once(), gbuffer.pixel_count() - first);
    sampling.begin = static_cast<int>(first);
    sampling.end = static_cast<int>(first + pixels);
    const Buffer batch_params =
        Buffer::From(device_, std::span<const SamplingParams>(&sampling, 1));
    kernel
        .Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
             light.energies(), light.corners(), gbuffer.position, gbuffer.normal, gbuffer.albedo,
             gbuffer.gloss, gbuffer.eye, shadow_.rays(), shadow_.ranges(), shadow_.kept(),
             shadow_.pending(), batch_params, own_params, draws, lighting.irradiance,
             lighting.reflected, lighting.variance, lighting.samples)
        .Enqueue(pixels);
    shadow_.Trace(pixels);
    shadow_.AddVisibleLight(first, pixels, lighting);
  }
}

const EstimatorTraits& EnvironmentEstimator::Traits() {
  static const EstimatorTraits traits{
      .name = "environment",
      .any_brdf = true,
      .unbiased = true,
      .unbiased_with_shadows = true,
      .guarantee =
          "the environment's light, unbiased for any BRDF, with and without shadows; half of the "
          "samples follow the map and half the BRDF"};
  return traits;
}

}  // namespace luxfield::render
