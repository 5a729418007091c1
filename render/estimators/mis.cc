#include "luxfield/render/estimators/mis.h"

#include <fmt/format.h>

#include <algorithm>

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

void RequireGivenShares(const EstimatorOptions& options, const Lighting& lighting) {
  if (options.knobs.strategies.strategies == Strategies::kGiven && !lighting.light_share)
    throw InputError(
        "strategies=given takes the share of every pixel from the caller; choose others");
}

// True if a pilot's shadow rays choose the shares of the rest.
bool HasPilot(const EstimatorOptions& options) {
  return SharesOf(options.knobs.strategies.strategies) == 1;
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

const EstimatorTraits& MisEstimator::traits() const {
  static const EstimatorTraits traits{
      .name = "two strategies",
      .any_brdf = true,
      .map_shadows = true,
      .unbiased = true,
      .unbiased_with_shadows = true,
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

Buffer MisEstimator::OwnShares(const Receivers& receivers, const EstimatorOptions& options,
                               const Lighting& lighting) const {
  if (lighting.light_share || !HasPilot(options) || !receivers.visibility.rays) return {};
  return Buffer(device_, receivers.gbuffer.pixel_count() * sizeof(cl_float));
}

Kernel& MisEstimator::ChooseShares(bool glossy) {
  auto kernel = choose_shares_.find(glossy);
  if (kernel == choose_shares_.end())
    kernel = choose_shares_
                 .emplace(glossy, Kernel(Program::Build(device_, "kernels/mis/pilot_shares.cl",
                                                        fmt::format("-D GLOSSY={}", int{glossy})),
                                         "ChooseShares"))
                 .first;
  return kernel->second;
}

template <typename Launch>
void MisEstimator::LightBatch(const PixelBatch& batch, const ShadowRays& shadow, bool glossy,
                              const EstimatorOptions& options, const Buffer& shares,
                              Launch launch) {
  const int first_stage = HasPilot(options) ? 0 : 1;
  if (HasPilot(options) && shadow.traced()) {
    launch(shares, 0, 1);
    shadow.Trace(batch.count);
    ChooseShares(glossy)
        .Set(batch.sampling, shadow.rays(), shadow.ranges(), shadow.kept(), shadow.pending(),
             shadow.hidden(), shares)
        .Enqueue(batch.count);
    launch(shares, 1, 2);
  } else {
    launch(shares, first_stage, 2);
  }
  shadow.Trace(batch.count);
}

template <typename Launch>
void MisEstimator::LightBatches(const Receivers& receivers, const EstimatorOptions& options,
                                Lighting& lighting, Launch launch) {
  const GBuffer& gbuffer = receivers.gbuffer;
  const Buffer own = OwnShares(receivers, options, lighting);
  const Buffer& shares = lighting.light_share ? *lighting.light_share : own;
  SamplingParams sampling = MakeSamplingParams(options);
  shadow_.Start(receivers.visibility.rays, gbuffer.glossy(),
                static_cast<std::size_t>(options.samples_per_pixel), gbuffer.pixel_count());
  sampling.shadow_rays = shadow_.per_pixel();
  for (std::size_t first = 0; first < gbuffer.pixel_count(); first += shadow_.pixels_at_once()) {
    const std::size_t pixels = std::min(shadow_.pixels_at_once(), gbuffer.pixel_count() - first);
    sampling.begin = static_cast<int>(first);
    sampling.end = static_cast<int>(first + pixels);
    const Buffer params = Buffer::From(device_, std::span<const SamplingParams>(&sampling, 1));
    LightBatch({first, pixels, params}, shadow_, gbuffer.glossy(), options, shares,
               [&](const Buffer& light_shares, cl_int first_stage, cl_int end_stage) {
                 launch(params, light_shares, first_stage, end_stage).Enqueue(pixels);
               });
    shadow_.AddVisibleLight(first, pixels, lighting);
  }
}

void MisEstimator::LightBy(const AreaLightOnDevice& light, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  const GBuffer& gbuffer = receivers.gbuffer;
  Kernel& kernel =
      KernelFor(light.kind == scene::AreaLightKind::kRectangle ? "rectangle" : "sphere",
                gbuffer.glossy(), options);
  LightBatches(
      receivers, options, lighting, [&](const Buffer& sampling, const auto&... outputs) -> Kernel& {
        return kernel.Set(light.params, sampling, gbuffer.position, gbuffer.normal, gbuffer.albedo,
                          gbuffer.gloss, gbuffer.eye, shadow_.rays(), shadow_.ranges(),
                          shadow_.kept(), shadow_.pending(), lighting.irradiance,
                          lighting.reflected, lighting.variance, lighting.samples, outputs...);
      });
}

void MisEstimator::LightBy(const EnvironmentLight& light, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  const GBuffer& gbuffer = receivers.gbuffer;
  const EnvironmentKnobs& knobs = options.knobs.environment;
  if (knobs.sets != SampleSets::kScrambled)
    throw InputError(
        "environment map: two strategies draw samples for every pixel; set "
        "environment-sets=scrambled");
  if (light.options().compensation > 0 && MakeSamplingParams(options).light_share == 1)
    throw InputError(
        "environment map: MIS compensation leaves light to samples that follow the BRDF, and there "
        "are none; choose other strategies or set environment-compensation to 0");
  EnvironmentSampling own{};
  own.balance = static_cast<int>(knobs.balance);
  const Buffer own_params = Buffer::From(device_, std::span<const EnvironmentSampling>(&own, 1));
  Kernel& kernel = KernelFor("environment", gbuffer.glossy(), options);
  LightBatches(
      receivers, options, lighting, [&](const Buffer& sampling, const auto&... outputs) -> Kernel& {
        return kernel.Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
                          light.energies(), light.corners(), sampling, own_params, gbuffer.position,
                          gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.eye,
                          shadow_.rays(), shadow_.ranges(), shadow_.kept(), shadow_.pending(),
                          lighting.irradiance, lighting.reflected, lighting.variance,
                          lighting.samples, outputs...);
      });
}

void MisEstimator::LightBy(const PosedLuminaire& luminaire, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  if (options.max_samples_per_image > 0)
    throw InputError("two strategies know no bound of the samples per image; leave it 0");
  const std::string build_options = BuildOptions(options);
  auto sampler = samplers_.find(build_options);
  if (sampler == samplers_.end())
    sampler =
        samplers_
            .emplace(build_options, WindowSampler(device_, PathOf("cells"), kKernel, build_options,
                                                  /*masses_are_seen=*/true, WindowsOf::kCells))
            .first;
  const Buffer own = OwnShares(receivers, options, lighting);
  const Buffer& shares = lighting.light_share ? *lighting.light_share : own;
  ShadowRays& shadow = sampler->second.shadow_rays();
  sampler->second.RunBatches(
      traits().name, receivers, luminaire, options, options.samples_per_pixel,
      [&](const PixelBatch& batch, auto launch) {
        LightBatch(batch, shadow, receivers.gbuffer.glossy(), options, shares,
                   [&](const Buffer& light_shares, cl_int first_stage, cl_int end_stage) {
                     launch(lighting.irradiance, lighting.reflected, lighting.variance,
                            lighting.samples, light_shares, first_stage, end_stage);
                   });
        shadow.AddVisibleLight(batch.first, batch.count, lighting);
      });
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
