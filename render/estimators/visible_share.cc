#include "render/estimators/visible_share.h"

namespace luxfield::render {

VisibleShare::Shares VisibleShare::Trace(const std::string& estimator, const GBuffer& gbuffer,
                                         const Visibility& visibility,
                                         const LuminaireOnDevice& luminaire,
                                         const scene::Pose& world_from_luminaire,
                                         const EstimatorOptions& options, const Buffer& samples) {
  Shares shares;
  if (!visibility.bvh) return shares;
  shares.irradiance = Buffer(device_, gbuffer.pixel_count() * sizeof(cl_float4));
  if (gbuffer.glossy())
    shares.reflected = Buffer(device_, gbuffer.pixel_count() * sizeof(cl_float4));
  if (!sampler_)
    sampler_.emplace(device_, "kernels/cells.cl", "VisibleShare", std::string(),
                     /*masses_are_seen=*/true, WindowsOf::kCells);
  sampler_->Run(estimator, gbuffer, visibility, luminaire, world_from_luminaire, options,
                shares.irradiance, shares.reflected, samples);
  return shares;
}

}  // namespace luxfield::render
