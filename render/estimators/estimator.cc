#include "luxfield/render/estimators/estimator.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/exact.h"
#include "luxfield/render/estimators/gloss.h"
#include "luxfield/render/estimators/sampling_estimators.h"
#include "luxfield/render/estimators/thesis.h"
#include "luxfield/render/estimators/volume.h"

namespace luxfield::render {

Lighting::Lighting(const Device& device, const GBuffer& gbuffer)
    : irradiance(device, gbuffer.pixel_count() * sizeof(cl_float4)),
      variance(device, gbuffer.pixel_count() * sizeof(cl_float)),
      samples(device, gbuffer.pixel_count() * sizeof(cl_uint)) {
  if (gbuffer.glossy()) reflected = Buffer(device, gbuffer.pixel_count() * sizeof(cl_float4));
  Clear();
}

void Lighting::Clear() {
  irradiance.FillZero();
  if (reflected) reflected.FillZero();
  variance.FillZero();
  samples.FillZero();
}

void Estimator::Light(const Receivers& /*receivers*/, const LightTasks& /*tasks*/,
                      const EstimatorOptions& /*options*/, Lighting& /*lighting*/) {
  throw InputError(fmt::format(
      "estimator '{}' lights all points with one light at a time; give it the lights one by one",
      traits().name));
}

void RequireLambertian(const EstimatorTraits& traits, const GBuffer& gbuffer) {
  if (gbuffer.glossy())
    throw InputError(fmt::format(
        "estimator '{}' lights Lambertian surfaces only and the scene has glossy ones; use one "
        "that takes any BRDF, such as windowed or gloss",
        traits.name));
}

namespace {

bool Takes(const EstimatorTraits& traits, Shadows shadows) {
  switch (shadows) {
    case Shadows::kNone:
      return true;
    case Shadows::kTraced:
      return traits.traced_shadows;
    case Shadows::kSoftMaps:
      return traits.soft_map_shadows;
    case Shadows::kMaps:
    case Shadows::kThesisMaps:
      break;
  }
  return traits.map_shadows;
}

const char* SourceOf(Shadows shadows) {
  if (shadows == Shadows::kTraced) return "traced rays";
  return shadows == Shadows::kSoftMaps ? "soft shadow maps" : "shadow maps";
}

}  // namespace

void RequireShadows(const EstimatorTraits& traits, Shadows shadows) {
  if (Takes(traits, shadows)) return;
  std::string names;
  for (const auto& other : EstimatorList())
    if (Takes(other, shadows)) names += (names.empty() ? "" : ", ") + other.name;
  throw InputError(fmt::format("estimator '{}' takes no shadows from {}; use one of {}",
                               traits.name, SourceOf(shadows), names));
}

void RequireShadows(const EstimatorTraits& traits, const Visibility& visibility) {
  if (visibility.rays) RequireShadows(traits, Shadows::kTraced);
  if (visibility.maps) RequireShadows(traits, Shadows::kMaps);
  if (visibility.patches) RequireShadows(traits, Shadows::kSoftMaps);
}

const PosedLuminaire& RequireLuminaire(const EstimatorTraits& traits, const LightSource& source) {
  if (const auto* luminaire = std::get_if<PosedLuminaire>(&source)) return *luminaire;
  throw InputError(fmt::format(
      "estimator '{}' lights with luminaires and was given another light; use one that takes it",
      traits.name));
}

const EnvironmentLight& RequireEnvironmentLight(const EstimatorTraits& traits,
                                                const LightSource& source) {
  using Reference = std::reference_wrapper<const EnvironmentLight>;
  if (const auto* light = std::get_if<Reference>(&source)) return *light;
  throw InputError(fmt::format(
      "estimator '{}' lights with environment maps and was given another light; use one that "
      "takes it",
      traits.name));
}

std::string ShadowsName(Shadows shadows) {
  switch (shadows) {
    case Shadows::kNone:
      return "none";
    case Shadows::kTraced:
      return "traced";
    case Shadows::kMaps:
      return "maps";
    case Shadows::kSoftMaps:
      return "soft-maps";
    case Shadows::kThesisMaps:
      break;
  }
  return "thesis-maps";
}

Shadows ShadowsFromName(const std::string& name) {
  for (const auto shadows :
       {Shadows::kNone, Shadows::kTraced, Shadows::kMaps, Shadows::kThesisMaps, Shadows::kSoftMaps})
    if (ShadowsName(shadows) == name) return shadows;
  throw InputError(
      fmt::format("unknown shadows '{}'; use none, traced, maps, thesis-maps or soft-maps", name));
}

std::unique_ptr<Estimator> MakeEstimator(const std::string& name, const Device& device) {
  if (name == ExactTraits().name) return MakeExact(device);
  if (name == VolumeTraits().name) return MakeVolume(device);
  if (name == GlossTraits().name) return MakeGloss(device);
  if (name == ThesisTraits().name) return MakeThesis(device);
  if (auto sampler = MakeSamplingEstimator(name, device)) return sampler;
  std::string names;
  for (const auto& traits : EstimatorList()) names += (names.empty() ? "" : ", ") + traits.name;
  throw InputError(fmt::format("unknown estimator '{}'; use one of {}", name, names));
}

std::vector<EstimatorTraits> EstimatorList() {
  std::vector<EstimatorTraits> list = {ExactTraits(), VolumeTraits(), GlossTraits()};
  const auto& samplers = SamplingEstimators();
  list.insert(list.end(), samplers.begin(), samplers.end());
  list.push_back(ThesisTraits());
  return list;
}

}  // namespace luxfield::render
