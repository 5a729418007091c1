#include "luxfield/render/estimators/shadow_rays.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/core/progress.h"
#include "luxfield/render/kernels/sample/sampling_types.clh"

namespace luxfield::render {
namespace {

// Memory of a batch: on a CPU it should stay in the cache, elsewhere fill the device.
constexpr std::size_t kCpuBytes = std::size_t{8} << 20, kBytes = std::size_t{128} << 20;

}  // namespace

void ShadowRays::Start(const RayScene* scene, bool glossy, std::size_t per_pixel,
                       std::size_t pixel_count) {
  scene_ = scene;
  glossy_ = glossy;
  per_pixel_ = per_pixel;
  pixels_at_once_ = pixel_count;
  if (!scene) {
    for (Buffer* buffer : {&rays_, &ranges_, &kept_, &pending_, &hidden_}) *buffer = Buffer();
    return;
  }
  const std::size_t kept_bytes = (glossy ? 2 : 1) * sizeof(cl_float4);
  const std::size_t bytes = per_pixel * (sizeof(scene::PackedRay) + kept_bytes + 1);
  pixels_at_once_ = std::clamp((device_.info().is_cpu ? kCpuBytes : kBytes) / bytes, std::size_t{1},
                               std::max<std::size_t>(pixel_count, 1));
  const std::size_t slots = pixels_at_once_ * per_pixel;
  const auto ensure = [&](Buffer& buffer, std::size_t size) {
    if (buffer.bytes() != size) buffer = Buffer(device_, size);
  };
  ensure(rays_, slots * sizeof(scene::PackedRay));
  ensure(kept_, slots * kept_bytes);
  ensure(hidden_, slots);
  ensure(ranges_, pixels_at_once_ * sizeof(scene::RayRange));
  ensure(pending_, pixels_at_once_ * sizeof(PendingPixel));
}

void ShadowRays::Trace(std::size_t pixels) const {
  if (!scene_) return;
  core::ThrowIfInterrupted();
  scene_->Occluded(
      {.rays = rays_, .group_count = pixels, .group_size = per_pixel_, .ranges = &ranges_},
      hidden_);
}

void ShadowRays::AddVisibleLight(std::size_t first_pixel, std::size_t pixels, Lighting& lighting) {
  if (!scene_) return;
  auto kernel = add_visible_.find(glossy_);
  if (kernel == add_visible_.end())
    kernel = add_visible_
                 .emplace(glossy_, Kernel(Program::Build(device_, "kernels/sample/visible_light.cl",
                                                         fmt::format("-D GLOSSY={}", int{glossy_})),
                                          "AddVisibleLight"))
                 .first;
  kernel->second
      .Set(static_cast<cl_int>(first_pixel), static_cast<cl_int>(pixels),
           static_cast<cl_int>(per_pixel_), rays_, ranges_, kept_, pending_, hidden_,
           lighting.irradiance, lighting.reflected, lighting.variance, lighting.samples)
      .Enqueue(pixels);
}

}  // namespace luxfield::render
