#include "luxfield/render/estimators/mis.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/sampling_params.h"
#include "luxfield/render/kernels/area/area_light_types.clh"
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

void RequireGivenShares(const EstimatorOptions& options, const Lighting& lighting) {
  if (options.knobs.strategies.strategies == Strategies::kGiven && !lighting.light_share)
    throw InputError(
        "strategies=given takes the share of every pixel from the caller; choose others");
}

// A kernel's null pointer where it is not asked for.
const Buffer& ShareOf(const Lighting& lighting) {
  static const Buffer none;
  return lighting.light_share ? *lighting.light_share : none;
}

void RequireNoBound(const EstimatorOptions& options) {
  if (options.max_samples_per_image > 0)
    throw InputError("two strategies know no bound of the samples per image; leave it 0");
}

const AreaLightSource& AreaLightOf(const LightSource& source) {
  return std::get<std::reference_wrapper<const AreaLightSource>>(source);
}

}  // namespace

Kernel& MisEstimator::KernelFor(const std::string& light, bool glossy, bool has_tasks,
                                const EstimatorOptions& options) {
  const std::string build_options = fmt::format("-D GLOSSY={} -D TASKS={} {}", int{glossy},
                                                int{has_tasks}, BuildOptions(options));
  auto kernel = kernels_.find({light, build_options});
  if (kernel == kernels_.end())
    kernel = kernels_
                 .emplace(std::pair(light, build_options),
                          Kernel(Program::Build(device_, PathOf(light), build_options), kKernel))
                 .first;
  return kernel->second;
}

const EstimatorTraits& MisEstimator::traits() const {
  static const EstimatorTraits traits{
      .name = "two strategies",
      .any_brdf = true,
      .map_shadows = true,
      .unbiased = true,
      .unbiased_with_shadows = true,
      .takes_tasks = true,
      .guarantee =
          "any light, unbiased for any BRDF, with and without shadows: samples that follow "
          "the light and samples that follow the BRDF"};
  return traits;
}

void MisEstimator::Light(const Receivers& receivers, const LightSource& source,
                         const EstimatorOptions& options, Lighting& lighting) {
  RequireGivenShares(options, lighting);
  std::visit([&](const auto& light) { LightBy(light, receivers, options, lighting); }, source);
}

void MisEstimator::Light(const Receivers& receivers, const LightTasks& tasks,
                         const EstimatorOptions& options, Lighting& lighting) {
  RequireGivenShares(options, lighting);
  if (std::holds_alternative<PosedLuminaire>(tasks.lights.front())) {
    RequireNoBound(options);
    SamplerFor(options).Run(traits().name, receivers, tasks, options, lighting.irradiance,
                            lighting.reflected, lighting.variance, lighting.samples,
                            ShareOf(lighting));
    return;
  }
  std::vector<AreaLightParams> params;
  for (const LightSource& source : tasks.lights) params.push_back(AreaLightOf(source).params);
  LightByArea(AreaLightOf(tasks.lights.front()).kind, Buffer::From(device_, params), receivers,
              tasks, options, lighting);
}

void MisEstimator::LightBy(const AreaLightSource& light, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  const LightSource source = light;
  const Buffer none;
  LightByArea(light.kind, Buffer::From(device_, std::span(&light.params, 1)), receivers,
              {std::span(&source, 1), none, 0, receivers.gbuffer.pixel_count()}, options, lighting);
}

void MisEstimator::LightByArea(scene::AreaLightKind kind, const Buffer& params,
                               const Receivers& receivers, const LightTasks& tasks,
                               const EstimatorOptions& options, Lighting& lighting) {
  const GBuffer& gbuffer = receivers.gbuffer;
  const DeviceBvh* bvh = receivers.visibility.bvh;
  SamplingParams sampling = MakeSamplingParams(options);
  sampling.begin = static_cast<int>(tasks.begin);
  sampling.end = static_cast<int>(tasks.end);
  const Buffer sampling_params =
                   Buffer::From(device_, std::span<const SamplingParams>(&sampling, 1)),
               none;
  KernelFor(kind == scene::AreaLightKind::kRectangle ? "rectangle" : "sphere", gbuffer.glossy(),
            static_cast<bool>(tasks.tasks), options)
      .Set(params, sampling_params, gbuffer.position, gbuffer.normal, gbuffer.albedo, gbuffer.gloss,
           gbuffer.eye, bvh ? bvh->nodes : none, bvh ? bvh->triangles : none, tasks.tasks,
           lighting.irradiance, lighting.reflected, lighting.variance, lighting.samples,
           ShareOf(lighting))
      .Enqueue(tasks.end - tasks.begin);
}

void MisEstimator::LightBy(const EnvironmentLight& light, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  const GBuffer& gbuffer = receivers.gbuffer;
  const DeviceBvh* bvh = receivers.visibility.bvh;
  const EnvironmentKnobs& knobs = options.knobs.environment;
  SamplingParams sampling = MakeSamplingParams(options);
  sampling.end = static_cast<int>(gbuffer.pixel_count());
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
  KernelFor("environment", gbuffer.glossy(), /*has_tasks=*/false, options)
      .Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
           light.energies(), light.corners(), sampling_params, own_params, gbuffer.position,
           gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.eye, bvh ? bvh->nodes : none,
           bvh ? bvh->triangles : none, none, lighting.irradiance, lighting.reflected,
           lighting.variance, lighting.samples, ShareOf(lighting))
      .Enqueue(gbuffer.pixel_count());
}

void MisEstimator::LightBy(const PosedLuminaire& luminaire, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  RequireNoBound(options);
  SamplerFor(options).Run(traits().name, receivers, luminaire, options, lighting.irradiance,
                          lighting.reflected, lighting.variance, lighting.samples,
                          ShareOf(lighting));
}

WindowSampler& MisEstimator::SamplerFor(const EstimatorOptions& options) {
  const std::string build_options = BuildOptions(options);
  auto sampler = samplers_.find(build_options);
  if (sampler == samplers_.end())
    sampler =
        samplers_
            .emplace(build_options, WindowSampler(device_, PathOf("cells"), kKernel, build_options,
                                                  /*masses_are_seen=*/true, WindowsOf::kCells))
            .first;
  return sampler->second;
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
