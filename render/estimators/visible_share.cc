#include "luxfield/render/estimators/visible_share.h"

#include <fmt/format.h>

namespace luxfield::render {

VisibleShare::Shares VisibleShare::Trace(const std::string& estimator, const Receivers& receivers,
                                         const PosedLuminaire& luminaire,
                                         const EstimatorOptions& options, const Buffer& samples) {
  Shares shares;
  const GBuffer& gbuffer = receivers.gbuffer;
  if (!receivers.visibility.rays) return shares;
  const std::size_t bytes = 2 * gbuffer.pixel_count() * sizeof(cl_float4);
  shares.irradiance = Buffer(device_, bytes);
  if (gbuffer.glossy()) shares.reflected = Buffer(device_, bytes);
  if (!sampler_)
    sampler_.emplace(device_, "kernels/luminaire/cells.cl", "Cells", std::string(),
                     /*masses_are_seen=*/true, WindowsOf::kCells);
  Kernel& kernel = KernelFor(gbuffer.glossy());
  const Buffer none;
  const ShadowRays& shadow = sampler_->shadow_rays();
  const LightSource source = luminaire;
  sampler_->RunBatches(estimator, receivers, AllPoints(source, gbuffer), options,
                       options.samples_per_pixel, [&](const PixelBatch& batch, auto launch) {
                         launch(none, none, none, none);
                         shadow.Trace(batch.count);
                         kernel
                             .Set(static_cast<cl_int>(batch.first),
                                  static_cast<cl_int>(batch.count),
                                  static_cast<cl_int>(shadow.per_pixel()), shadow.rays(),
                                  shadow.ranges(), shadow.kept(), shadow.pending(), shadow.hidden(),
                                  shares.irradiance, shares.reflected, samples)
                             .Enqueue(batch.count);
                       });
  return shares;
}

Kernel& VisibleShare::KernelFor(bool glossy) {
  auto kernel = kernels_.find(glossy);
  if (kernel == kernels_.end())
    kernel =
        kernels_
            .emplace(glossy, Kernel(Program::Build(device_, "kernels/luminaire/visible_share.cl",
                                                   fmt::format("-D GLOSSY={}", int{glossy})),
                                    "VisibleShare"))
            .first;
  return kernel->second;
}

}  // namespace luxfield::render
