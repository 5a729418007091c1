#include "luxfield/render/estimators/mis.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/sampling_params.h"
#include "luxfield/render/kernels/environment/environment_types.clh"

namespace luxfield::render {
namespace {

constexpr char kKernel[] = "MisEstimator";

// COMBINE of kernels/mis/mis.clh.
int CombinationOf(Strategies strategies) {
  switch (strategies) {
    case Strategies::kPower:
    case Strategies::kLobe:
      return 1;
    case Strategies::kMaximum:
      return 2;
    case Strategies::kLight:
      return 3;
    case Strategies::kBrdf:
      return 4;
    default:
      return 0;
  }
}

// SHARES of kernels/mis/mis.clh.
int SharesOf(Strategies strategies) {
  switch (strategies) {
    case Strategies::kSecondOrder:
    case Strategies::kNewton:
      return 1;
    case Strategies::kLobe:
      return 2;
    case Strategies::kGiven:
      return 3;
    default:
      return 0;
  }
}

std::string PathOf(const std::string& light) { return "kernels/mis/mis_" + light + ".cl"; }

std::string BuildOptions(const EstimatorOptions& options) {
  const Strategies strategies = options.knobs.strategies.strategies;
  return fmt::format("-D COMBINE={} -D SHARES={}", CombinationOf(strategies), SharesOf(strategies));
}

void RequireGivenShares(const EstimatorOptions& options, const Buffer& light_share) {
  if (options.knobs.strategies.strategies == Strategies::kGiven && light_share.bytes() == 0)
    throw InputError(
        "strategies=given takes the share of every pixel from the caller; choose others");
}

SamplingParams ParamsFor(const GBuffer& gbuffer, const EstimatorOptions& options) {
  SamplingParams params = MakeSamplingParams(options);
  params.end = static_cast<int>(gbuffer.pixel_count());
  return params;
}

}  // namespace

Kernel& MisEstimator::KernelFor(const std::string& light, bool glossy,
                                const EstimatorOptions& options) {
  const std::string build_options =
      fmt::format("-D GLOSSY={} {}", int{glossy}, BuildOptions(options));
  auto kernel = kernels_.find({light, build_options});
  if (kernel == kernels_.end())
    kernel = kernels_
                 .emplace(std::pair(light, build_options),
                          Kernel(Program::Build(device_, PathOf(light), build_options), kKernel))
                 .first;
  return kernel->second;
}

void MisEstimator::Light(const GBuffer& gbuffer, const DeviceBvh* bvh,
                         const AreaLightOnDevice& light, const EstimatorOptions& options,
                         Lighting& lighting, const Buffer& light_share) {
  RequireGivenShares(options, light_share);
  const SamplingParams sampling = ParamsFor(gbuffer, options);
  const Buffer sampling_params =
                   Buffer::From(device_, std::span<const SamplingParams>(&sampling, 1)),
               none;
  KernelFor(light.kind == scene::AreaLightKind::kRectangle ? "rectangle" : "sphere",
            gbuffer.glossy(), options)
      .Set(light.params, sampling_params, gbuffer.position, gbuffer.normal, gbuffer.albedo,
           gbuffer.gloss, gbuffer.eye, bvh ? bvh->nodes : none, bvh ? bvh->triangles : none,
           lighting.irradiance, lighting.reflected, lighting.variance, lighting.samples,
           light_share)
      .Enqueue(gbuffer.pixel_count());
}

void MisEstimator::Light(const GBuffer& gbuffer, const DeviceBvh* bvh,
                         const EnvironmentLight& light, const EstimatorOptions& options,
                         Lighting& lighting, const Buffer& light_share) {
  RequireGivenShares(options, light_share);
  const EnvironmentKnobs& knobs = options.knobs.environment;
  const SamplingParams sampling = ParamsFor(gbuffer, options);
  if (knobs.sets != SampleSets::kScrambled)
    throw InputError(
        "environment map: two strategies draw samples for every pixel; set "
        "environment-sets=scrambled");
  if (light.options().compensation > 0 && sampling.light_share == 1)
    throw InputError(
        "environment map: MIS compensation leaves light to samples that follow the BRDF, and there "
        "are none; choose other strategies or set environment-compensation to 0");
  EnvironmentSampling own{};
  own.balance = static_cast<int>(knobs.balance);
  const Buffer sampling_params =
                   Buffer::From(device_, std::span<const SamplingParams>(&sampling, 1)),
               own_params = Buffer::From(device_, std::span<const EnvironmentSampling>(&own, 1)),
               none;
  KernelFor("environment", gbuffer.glossy(), options)
      .Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
           light.energies(), light.corners(), sampling_params, own_params, gbuffer.position,
           gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.eye, bvh ? bvh->nodes : none,
           bvh ? bvh->triangles : none, lighting.irradiance, lighting.reflected, lighting.variance,
           lighting.samples, light_share)
      .Enqueue(gbuffer.pixel_count());
}

void MisEstimator::Light(const GBuffer& gbuffer, const Visibility& visibility,
                         const LuminaireOnDevice& luminaire,
                         const scene::Pose& world_from_luminaire, const EstimatorOptions& options,
                         Lighting& lighting, const Buffer& light_share) {
  if (options.max_samples_per_image > 0)
    throw InputError("two strategies know no bound of the samples per image; leave it 0");
  RequireGivenShares(options, light_share);
  const std::string build_options = BuildOptions(options);
  auto sampler = samplers_.find(build_options);
  if (sampler == samplers_.end())
    sampler =
        samplers_
            .emplace(build_options, WindowSampler(device_, PathOf("cells"), kKernel, build_options,
                                                  /*masses_are_seen=*/true, WindowsOf::kCells))
            .first;
  sampler->second.Run("two strategies", gbuffer, visibility, luminaire, world_from_luminaire,
                      options, lighting.irradiance, lighting.reflected, lighting.variance,
                      lighting.samples, light_share);
}

std::vector<float> EnvironmentFaceShares(const Device& device, const GBuffer& gbuffer,
                                         const EnvironmentLight& light) {
  const SamplingParams sampling{};
  EnvironmentSampling own{};
  own.balance = static_cast<int>(TileBalance::kCosine);
  const Buffer sampling_params =
                   Buffer::From(device, std::span<const SamplingParams>(&sampling, 1)),
               own_params = Buffer::From(device, std::span<const EnvironmentSampling>(&own, 1)),
               shares(device, 6 * gbuffer.pixel_count() * sizeof(float));
  Kernel(Program::Build(device, "kernels/mis/environment_shares.cl"), "FaceShares")
      .Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
           light.energies(), light.corners(), sampling_params, own_params, gbuffer.position,
           gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.eye,
           static_cast<cl_int>(gbuffer.pixel_count()), shares)
      .Enqueue(gbuffer.pixel_count());
  return shares.Download<float>();
}

}  // namespace luxfield::render
