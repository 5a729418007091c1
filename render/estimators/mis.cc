#include "luxfield/render/estimators/mis.h"

#include <fmt/format.h>

#include <algorithm>

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

// Of points with tasks of their own, or lit by one light.
std::string KindOptions(bool glossy, bool has_tasks) {
  return fmt::format("-D GLOSSY={} -D TASKS={}", int{glossy}, int{has_tasks});
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

const AreaLightSource& AreaLightOf(const LightSource& source) {
  return std::get<std::reference_wrapper<const AreaLightSource>>(source);
}

const ClassicalLightSource& ClassicalLightOf(const LightSource& source) {
  return std::get<std::reference_wrapper<const ClassicalLightSource>>(source);
}

// Those of points and lines, which only samples that follow them meet.
EstimatorOptions LightAlone(EstimatorOptions options) {
  Strategies& strategies = options.knobs.strategies.strategies;
  if (strategies == Strategies::kBrdf)
    throw InputError(
        "no sample that follows the BRDF meets a point or a linear light; choose strategies other "
        "than brdf");
  strategies = Strategies::kLight;
  return options;
}

}  // namespace

Kernel& MisEstimator::KernelFor(const std::string& light, bool glossy, bool has_tasks,
                                const EstimatorOptions& options) {
  const std::string build_options = KindOptions(glossy, has_tasks) + " " + BuildOptions(options);
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
  if (std::holds_alternative<PosedLuminaire>(tasks.lights.front()))
    LightByLuminaires(receivers, tasks, options, lighting);
  else if (std::holds_alternative<std::reference_wrapper<const AreaLightSource>>(
               tasks.lights.front()))
    LightByAreas(receivers, tasks, options, lighting);
  else
    LightByClassicalLights(receivers, tasks, options, lighting);
}

Buffer MisEstimator::OwnShares(const Receivers& receivers, const EstimatorOptions& options,
                               const Lighting& lighting) const {
  if (lighting.light_share || !HasPilot(options) || !receivers.visibility.rays) return {};
  return Buffer(device_, receivers.gbuffer.pixel_count() * sizeof(cl_float));
}

Kernel& MisEstimator::ChooseShares(bool glossy, bool has_tasks) {
  auto kernel = choose_shares_.find({glossy, has_tasks});
  if (kernel == choose_shares_.end())
    kernel = choose_shares_
                 .emplace(std::pair(glossy, has_tasks),
                          Kernel(Program::Build(device_, "kernels/mis/pilot_shares.cl",
                                                KindOptions(glossy, has_tasks)),
                                 "ChooseShares"))
                 .first;
  return kernel->second;
}

template <typename Launch>
void MisEstimator::LightBatch(const PixelBatch& batch, const ShadowRays& shadow, bool glossy,
                              const Buffer* tasks, const EstimatorOptions& options,
                              const Buffer& shares, Launch launch) {
  const int first_stage = HasPilot(options) ? 0 : 1;
  if (HasPilot(options) && shadow.traced()) {
    const Buffer none;
    launch(shares, 0, 1);
    shadow.Trace(batch.count);
    ChooseShares(glossy, tasks != nullptr)
        .Set(batch.sampling, tasks ? *tasks : none, shadow.rays(), shadow.ranges(), shadow.kept(),
             shadow.pending(), shadow.hidden(), shares)
        .Enqueue(batch.count);
    launch(shares, 1, 2);
  } else {
    launch(shares, first_stage, 2);
  }
  shadow.Trace(batch.count);
}

template <typename Launch>
void MisEstimator::LightBatches(const Receivers& receivers, const LightTasks& tasks,
                                const EstimatorOptions& options, Lighting& lighting,
                                Launch launch) {
  const GBuffer& gbuffer = receivers.gbuffer;
  const Buffer own = OwnShares(receivers, options, lighting);
  const Buffer& shares = lighting.light_share ? *lighting.light_share : own;
  SamplingParams sampling = MakeSamplingParams(options);
  shadow_.Start(receivers.visibility.rays, gbuffer.glossy(),
                static_cast<std::size_t>(options.samples_per_pixel), tasks.end - tasks.begin);
  sampling.shadow_rays = shadow_.per_pixel();
  for (std::size_t first = tasks.begin; first < tasks.end; first += shadow_.pixels_at_once()) {
    const std::size_t pixels = std::min(shadow_.pixels_at_once(), tasks.end - first);
    sampling.begin = static_cast<int>(first);
    sampling.end = static_cast<int>(first + pixels);
    const Buffer params = Buffer::From(device_, std::span<const SamplingParams>(&sampling, 1));
    LightBatch({first, pixels, params}, shadow_, gbuffer.glossy(), tasks.tasks, options, shares,
               [&](const Buffer& light_shares, cl_int first_stage, cl_int end_stage) {
                 launch(params, light_shares, first_stage, end_stage).Enqueue(pixels);
               });
    shadow_.AddVisibleLight(first, pixels, lighting);
  }
}

void MisEstimator::LightBy(const AreaLightSource& light, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  const LightSource source = light;
  LightByAreas(receivers, AllPoints(source, receivers.gbuffer), options, lighting);
}

void MisEstimator::LightBy(const ClassicalLightSource& light, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  const LightSource source = light;
  LightByClassicalLights(receivers, AllPoints(source, receivers.gbuffer), options, lighting);
}

template <typename... LightArguments>
void MisEstimator::LightWith(Kernel& kernel, const Receivers& receivers, const LightTasks& tasks,
                             const EstimatorOptions& options, Lighting& lighting,
                             const LightArguments&... light) {
  const GBuffer& gbuffer = receivers.gbuffer;
  const Buffer none;
  LightBatches(receivers, tasks, options, lighting,
               [&](const Buffer& sampling, const auto&... outputs) -> Kernel& {
                 return kernel.Set(
                     light..., sampling, gbuffer.position, gbuffer.normal, gbuffer.albedo,
                     gbuffer.gloss, gbuffer.eye, shadow_.rays(), shadow_.ranges(), shadow_.kept(),
                     shadow_.pending(), tasks.tasks ? *tasks.tasks : none, lighting.irradiance,
                     lighting.reflected, lighting.variance, lighting.samples, outputs...);
               });
}

void MisEstimator::LightByAreas(const Receivers& receivers, const LightTasks& tasks,
                                const EstimatorOptions& options, Lighting& lighting) {
  const AreaLightSource& first = AreaLightOf(tasks.lights.front());
  std::vector<AreaLightParams> params;
  for (const LightSource& source : tasks.lights) params.push_back(AreaLightOf(source).params);
  LightWith(KernelFor(first.kind == scene::AreaLightKind::kRectangle ? "rectangle" : "sphere",
                      receivers.gbuffer.glossy(), tasks.tasks != nullptr, options),
            receivers, tasks, options, lighting, Buffer::From(device_, params));
}

void MisEstimator::LightByClassicalLights(const Receivers& receivers, const LightTasks& tasks,
                                          const EstimatorOptions& options, Lighting& lighting) {
  const ClassicalLightSource& first = ClassicalLightOf(tasks.lights.front());
  std::vector<ClassicalLightParams> params;
  for (const LightSource& source : tasks.lights) params.push_back(ClassicalLightOf(source).params);
  const EstimatorOptions own = IsArea(first) ? options : LightAlone(options);
  LightWith(KernelFor(IsArea(first) ? "classical_area" : "classical_line",
                      receivers.gbuffer.glossy(), tasks.tasks != nullptr, own),
            receivers, tasks, own, lighting, Buffer::From(device_, params),
            first.distribution->table);
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
  const Buffer none,
      own_params = Buffer::From(device_, std::span<const EnvironmentSampling>(&own, 1));
  Kernel& kernel = KernelFor("environment", gbuffer.glossy(), /*has_tasks=*/false, options);
  const LightSource source = light;
  LightBatches(receivers, AllPoints(source, gbuffer), options, lighting,
               [&](const Buffer& sampling, const auto&... outputs) -> Kernel& {
                 return kernel.Set(
                     light.params(), light.texels(), light.row_starts(), light.column_starts(),
                     light.energies(), light.corners(), sampling, own_params, gbuffer.position,
                     gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.eye, shadow_.rays(),
                     shadow_.ranges(), shadow_.kept(), shadow_.pending(), none, lighting.irradiance,
                     lighting.reflected, lighting.variance, lighting.samples, outputs...);
               });
}

void MisEstimator::LightBy(const PosedLuminaire& luminaire, const Receivers& receivers,
                           const EstimatorOptions& options, Lighting& lighting) {
  const LightSource source = luminaire;
  LightByLuminaires(receivers, AllPoints(source, receivers.gbuffer), options, lighting);
}

void MisEstimator::LightByLuminaires(const Receivers& receivers, const LightTasks& tasks,
                                     const EstimatorOptions& options, Lighting& lighting) {
  if (options.max_samples_per_image > 0)
    throw InputError("two strategies know no bound of the samples per image; leave it 0");
  WindowSampler& sampler = SamplerFor(options);
  const Buffer own = OwnShares(receivers, options, lighting);
  const Buffer& shares = lighting.light_share ? *lighting.light_share : own;
  ShadowRays& shadow = sampler.shadow_rays();
  sampler.RunBatches(traits().name, receivers, tasks, options, options.samples_per_pixel,
                     [&](const PixelBatch& batch, auto launch) {
                       LightBatch(
                           batch, shadow, receivers.gbuffer.glossy(), tasks.tasks, options, shares,
                           [&](const Buffer& light_shares, cl_int first_stage, cl_int end_stage) {
                             launch(lighting.irradiance, lighting.reflected, lighting.variance,
                                    lighting.samples, light_shares, first_stage, end_stage);
                           });
                       shadow.AddVisibleLight(batch.first, batch.count, lighting);
                     });
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
