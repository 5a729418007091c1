#include "luxfield/render/estimators/gloss.h"

#include <fmt/format.h>

#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/exact.h"
#include "luxfield/render/estimators/visible_share.h"
#include "luxfield/render/lights/luminaire_params.h"

namespace luxfield::render {
namespace {

class Gloss : public Estimator {
 public:
  explicit Gloss(const Device& device) : device_(device), share_(device) {}

  const EstimatorTraits& traits() const override { return GlossTraits(); }

  void Light(const Receivers& receivers, const LightSource& source, const EstimatorOptions& options,
             Lighting& lighting) override {
    const PosedLuminaire& posed = RequireLuminaire(traits(), source);
    const auto& [luminaire, world_from_luminaire] = posed;
    const auto& [gbuffer, visibility] = receivers;
    RequireShadows(traits(), visibility);
    if (!(options.max_error >= 1e-6f && options.max_error <= 1))
      throw InputError(fmt::format("the error asked of estimator '{}' = {} must be 1e-6 to 1",
                                   traits().name, options.max_error));
    if (!gbuffer.glossy()) {
      // Everything is Lambertian, where the closed form is the same number for less work.
      if (!exact_) exact_ = MakeExact(device_);
      exact_->Light(receivers, source, options, lighting);
      return;
    }
    if (!kernel_)
      kernel_.emplace(Program::Build(device_, "kernels/luminaire/gloss.cl", "-D GLOSSY=1"),
                      "Gloss");
    const auto share = share_.Trace(traits().name, receivers, posed, options, lighting.samples);
    const LuminaireParams params =
        MakeLuminaireParams(luminaire.geometry(), luminaire.row_stride(), world_from_luminaire);
    const Buffer device_params =
        Buffer::From(device_, std::span<const LuminaireParams>(&params, 1));
    kernel_
        ->Set(device_params, luminaire.images(), gbuffer.position, gbuffer.normal, gbuffer.albedo,
              gbuffer.gloss, gbuffer.eye, static_cast<cl_int>(gbuffer.pixel_count()),
              options.max_error, share.irradiance, share.reflected, lighting.irradiance,
              lighting.reflected, lighting.variance)
        .Enqueue({gbuffer.pixel_count()}, {kGroup});
  }

 private:
  static constexpr std::size_t kGroup = 16;

  Device device_;
  std::unique_ptr<Estimator> exact_;
  std::optional<Kernel> kernel_;
  VisibleShare share_;
};

}  // namespace

const EstimatorTraits& GlossTraits() {
  static const EstimatorTraits traits{
      .name = "gloss",
      .needs_for_shadows = {.cells = true},
      .any_brdf = true,
      .noise_free = true,
      .rel_error = EstimatorOptions().max_error,
      .error_is_asked = true,
      .guarantee =
          "irradiance and the Lambertian parts of Lambert and Phong in closed form; lobes to the "
          "error asked for, relative to what is shown or to 1 % of the lobe's peak, as long as 32 "
          "parts of a knot cell along each axis resolve the lobe; shadows scale it by the share of "
          "the reflected light samples that see the receiver, a ratio that is consistent but not "
          "unbiased"};
  return traits;
}

std::unique_ptr<Estimator> MakeGloss(const Device& device) {
  return std::make_unique<Gloss>(device);
}

}  // namespace luxfield::render
