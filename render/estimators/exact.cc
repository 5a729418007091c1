#include "render/estimators/exact.h"

#include <fmt/format.h>

#include "render/estimators/luminaire_params.h"

namespace luxfield::render {
namespace {

class Exact : public Estimator {
 public:
  explicit Exact(const Device& device)
      : device_(device),
        // On a CPU neighbouring pixels share the loads of texels; elsewhere registers are dearer
        // than loads.
        pixels_(device.info().is_cpu ? 4 : 1),
        program_(Program::Build(device, "kernels/exact.cl", fmt::format("-D PIXELS={}", pixels_))),
        whole_(program_, "ExactIrradiance"),
        cut_(program_, "ExactCutIrradiance") {}

  const EstimatorTraits& traits() const override { return ExactTraits(); }

  void Light(const GBuffer& gbuffer, const DeviceBvh* bvh, const LuminaireOnDevice& luminaire,
             const scene::Pose& world_from_luminaire, const EstimatorOptions& options,
             Buffer& irradiance, Buffer& variance, Buffer& samples) override {
    (void)options;
    (void)samples;
    (void)bvh;
    const LuminaireParams params =
        MakeLuminaireParams(luminaire.geometry(), luminaire.row_stride(), world_from_luminaire);
    const Buffer device_params =
        Buffer::From(device_, std::span<const LuminaireParams>(&params, 1));
    const Buffer ratio;
    const auto count = static_cast<cl_int>(gbuffer.pixel_count());
    whole_
        .Set(device_params, luminaire.images(), gbuffer.position, gbuffer.normal, count, ratio,
             irradiance, variance)
        .Enqueue({(gbuffer.pixel_count() + pixels_ - 1) / pixels_}, {32});
    cut_.Set(device_params, luminaire.images(), gbuffer.position, gbuffer.normal, count, ratio,
             irradiance, variance)
        .Enqueue({gbuffer.pixel_count()}, {32});
    device_.Finish();
  }

 private:
  Device device_;
  int pixels_;
  Program program_;
  Kernel whole_, cut_;
};

}  // namespace

const EstimatorTraits& ExactTraits() {
  static const EstimatorTraits traits{
      .name = "exact",
      .needs_tables = false,
      .needs_tables_for_shadows = true,
      .needs_non_negative = false,
      .unbiased = true,
      .unbiased_with_shadows = false,
      .noise_free = true,
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
