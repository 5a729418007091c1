#include "render/estimators/windowed.h"

#include "render/estimators/window_sampler.h"

namespace luxfield::render {
namespace {

class Sampling : public Estimator {
 public:
  Sampling(const Device& device, const std::string& kernel, const EstimatorTraits& traits)
      : traits_(traits), sampler_(device, kernel) {}

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

const EstimatorTraits& WindowedTraits() {
  static const EstimatorTraits traits{.name = "windowed",
                                      .needs = {.sat = true},
                                      .needs_non_negative = true,
                                      .any_brdf = true,
                                      .map_shadows = true,
                                      .unbiased = true,
                                      .unbiased_with_shadows = true,
                                      .noise_free = false,
                                      .guarantee =
                                          "unbiased, with bounded contributions and one shadow ray "
                                          "per sample; the variance it reports takes "
                                          "samples as independent and so overstates the error"};
  return traits;
}

const EstimatorTraits& ThesisTraits() {
  static const EstimatorTraits traits{
      .name = "thesis",
      .needs = {.sat = true},
      .needs_non_negative = true,
      .any_brdf = true,
      .map_shadows = true,
      .unbiased = false,
      .unbiased_with_shadows = false,
      .noise_free = false,
      .guarantee =
          "the estimator as the thesis prints it, a baseline: biased by tens of per cent on "
          "structured "
          "images; the variance it reports does not contain the bias"};
  return traits;
}

std::unique_ptr<Estimator> MakeWindowed(const Device& device) {
  return std::make_unique<Sampling>(device, "Windowed", WindowedTraits());
}

std::unique_ptr<Estimator> MakeThesis(const Device& device) {
  return std::make_unique<Sampling>(device, "Thesis", ThesisTraits());
}

}  // namespace luxfield::render
