#include "luxfield/render/estimators/sampling_estimator.h"

namespace luxfield::render {
namespace {

class SamplingEstimator : public Estimator {
 public:
  SamplingEstimator(const Device& device, const EstimatorTraits& traits, const std::string& path,
                    const std::string& kernel, const std::string& build_options)
      : traits_(traits),
        sampler_(device, path, kernel, build_options, /*masses_are_seen=*/true,
                 traits.needs.cells ? WindowsOf::kCells : WindowsOf::kImages) {}

  const EstimatorTraits& traits() const override { return traits_; }

  void Light(const GBuffer& gbuffer, const Visibility& visibility,
             const LuminaireOnDevice& luminaire, const scene::Pose& world_from_luminaire,
             const EstimatorOptions& options, Lighting& lighting) override {
    RequireShadows(traits_, visibility);
    sampler_.Run(traits_.name, gbuffer, visibility, luminaire, world_from_luminaire, options,
                 lighting.irradiance, lighting.reflected, lighting.variance, lighting.samples);
  }

 private:
  const EstimatorTraits& traits_;
  WindowSampler sampler_;
};

}  // namespace

EstimatorTraits SamplingTraits(const std::string& name, const std::string& guarantee,
                               const TableNeeds& needs) {
  return {.name = name,
          .needs = needs,
          .any_brdf = true,
          .map_shadows = true,
          .unbiased = true,
          .unbiased_with_shadows = true,
          .guarantee = guarantee};
}

std::unique_ptr<Estimator> MakeSamplingEstimator(const Device& device,
                                                 const EstimatorTraits& traits,
                                                 const std::string& path, const std::string& kernel,
                                                 const std::string& build_options) {
  return std::make_unique<SamplingEstimator>(device, traits, path, kernel, build_options);
}

}  // namespace luxfield::render
