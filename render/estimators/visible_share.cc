#include "luxfield/render/estimators/visible_share.h"

namespace luxfield::render {

VisibleShare::Shares VisibleShare::Trace(const std::string& estimator, const Receivers& receivers,
                                         const PosedLuminaire& luminaire,
                                         const EstimatorOptions& options, const Buffer& samples) {
  Shares shares;
  const GBuffer& gbuffer = receivers.gbuffer;
  if (!receivers.visibility.bvh) return shares;
  const std::size_t bytes = 2 * gbuffer.pixel_count() * sizeof(cl_float4);
  shares.irradiance = Buffer(device_, bytes);
  if (gbuffer.glossy()) shares.reflected = Buffer(device_, bytes);
  if (!sampler_)
    sampler_.emplace(device_, "kernels/luminaire/cells.cl", "VisibleShare", std::string(),
                     /*masses_are_seen=*/true, WindowsOf::kCells);
  sampler_->Run(estimator, receivers, luminaire, options, shares.irradiance, shares.reflected,
                samples);
  return shares;
}

}  // namespace luxfield::render
