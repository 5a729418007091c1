#include "render/estimators/exact.h"

#include <optional>

#include "render/estimators/luminaire_params.h"
#include "render/estimators/window_sampler.h"

namespace luxfield::render {
namespace {

class Exact : public Estimator {
 public:
  explicit Exact(const Device& device)
      : device_(device),
        program_(Program::Build(device, "kernels/exact.cl")),
        whole_(program_, "ExactIrradiance"),
        cut_(program_, "ExactCutIrradiance") {}

  const EstimatorTraits& traits() const override { return ExactTraits(); }

  void Light(const GBuffer& gbuffer, const Visibility& visibility,
             const LuminaireOnDevice& luminaire, const scene::Pose& world_from_luminaire,
             const EstimatorOptions& options, Lighting& lighting) override {
    RequireLambertian(traits(), gbuffer);
    RequireShadows(traits(), visibility);
    const LuminaireParams params =
        MakeLuminaireParams(luminaire.geometry(), luminaire.row_stride(), world_from_luminaire);
    const Buffer device_params =
        Buffer::From(device_, std::span<const LuminaireParams>(&params, 1));
    Buffer share;  // null: everything is visible
    if (visibility.bvh) {
      share = Buffer(device_, gbuffer.pixel_count() * sizeof(cl_float4));
      if (!sampler_) sampler_.emplace(device_, "VisibleShare");
      sampler_->Run(traits().name, gbuffer, visibility, luminaire, world_from_luminaire, options,
                    share, lighting.samples);
    }
    const auto count = static_cast<cl_int>(gbuffer.pixel_count());
    const std::size_t pixels = device_.tuning().pixels_per_item;
    whole_
        .Set(device_params, luminaire.images(), gbuffer.position, gbuffer.normal, count, share,
             lighting.irradiance, lighting.variance)
        .Enqueue((gbuffer.pixel_count() + pixels - 1) / pixels);
    cut_.Set(device_params, luminaire.images(), gbuffer.position, gbuffer.normal, count, share,
             lighting.irradiance, lighting.variance)
        .Enqueue(gbuffer.pixel_count());
  }

 private:
  Device device_;
  Program program_;
  Kernel whole_, cut_;
  std::optional<WindowSampler> sampler_;  // built when shadows are first asked for
};

}  // namespace

const EstimatorTraits& ExactTraits() {
  static const EstimatorTraits traits{
      .name = "exact",
      .needs_for_shadows = {.sat = true},
      .unbiased = true,
      .noise_free = true,
      .rel_error = 1e-5,
      .guarantee =
          "irradiance in closed form, error below 1e-5 of |J| from 0.05 to 100 m; shadows scale it "
          "by the share "
          "of light samples that see the receiver, a ratio that is consistent but not unbiased"};
  return traits;
}

std::unique_ptr<Estimator> MakeExact(const Device& device) {
  return std::make_unique<Exact>(device);
}

}  // namespace luxfield::render
