#include "luxfield/render/estimators/pixel_list.h"

namespace luxfield::render {

PixelList::PixelList(const Device& device)
    : device_(device),
      gather_(Program::Build(device, "kernels/luminaire/volume.cl"), "GatherReceivers"),
      scatter_(Program::Build(device, "kernels/luminaire/volume.cl"), "ScatterIrradiance") {}

GBuffer PixelList::Gather(const GBuffer& gbuffer, const std::vector<cl_int>& pixels) {
  count_ = static_cast<cl_int>(pixels.size());
  pixels_ = Buffer::From(device_, pixels);
  GBuffer gathered(device_, count_, 1);
  gather_.Set(pixels_, count_, gbuffer.position, gbuffer.normal, gathered.position, gathered.normal)
      .Enqueue(pixels.size());
  return gathered;
}

void PixelList::Scatter(const Buffer& irradiance, const SeenShares& shares, Lighting& lighting) {
  scatter_
      .Set(pixels_, count_, irradiance, shares.traced, lighting.irradiance, lighting.variance,
           shares.soft)
      .Enqueue(static_cast<std::size_t>(count_));
}

}  // namespace luxfield::render
