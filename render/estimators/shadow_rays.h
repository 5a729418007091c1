// Shadow rays of sampling estimators, a batch of pixels at a time: a kernel draws samples and keeps
// what each would bring with its ray (kernels/sample/shadow_rays.clh), the rays are traced together
// (render/scene/ray_scene.h), and what arrives is added up in the order of the samples. Batches
// bound the memory. Internal to estimators/.
//
//   shadow.Start(scene, glossy, samples_per_pixel, pixel_count);
//   for (each batch of at most shadow.pixels_at_once() pixels) {
//     kernel.Set(..., shadow.rays(), shadow.ranges(), shadow.kept(), shadow.pending(), ...)
//         .Enqueue(pixels);
//     shadow.Trace(pixels);
//     shadow.AddVisibleLight(first_pixel, pixels, lighting);
//   }
#pragma once

#include <map>

#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/scene/ray_scene.h"

namespace luxfield::render {

class ShadowRays {
 public:
  explicit ShadowRays(const Device& device) : device_(device) {}

  // Makes room for at most `per_pixel` rays of each pixel. Null `scene`: nothing casts a shadow,
  // buffers are null, kernels add their light themselves, and Trace and AddVisibleLight do nothing.
  void Start(const RayScene* scene, bool glossy, std::size_t per_pixel, std::size_t pixel_count);

  bool traced() const { return scene_ != nullptr; }
  std::size_t pixels_at_once() const { return pixels_at_once_; }
  int per_pixel() const { return static_cast<int>(per_pixel_); }  // SamplingParams::shadow_rays

  // SHADOW_RAY_ARGUMENTS of kernels.
  const Buffer& rays() const { return rays_; }
  const Buffer& ranges() const { return ranges_; }
  const Buffer& kept() const { return kept_; }
  const Buffer& pending() const { return pending_; }
  // cl_uchar per slot, of rays traced: 1 where something lies on them.
  const Buffer& hidden() const { return hidden_; }

  // Traces the ranges that a kernel wrote for the first `pixels` of a batch. Throws Interrupted where
  // rays are traced.
  void Trace(std::size_t pixels) const;
  // Enqueues the sums over what arrives at a batch from `first_pixel` on.
  void AddVisibleLight(std::size_t first_pixel, std::size_t pixels, Lighting& lighting);

 private:
  Device device_;
  const RayScene* scene_ = nullptr;
  bool glossy_ = false;
  std::size_t per_pixel_ = 0, pixels_at_once_ = 0;
  Buffer rays_, ranges_, kept_, pending_, hidden_;
  std::map<bool, Kernel> add_visible_;  // by GLOSSY
};

}  // namespace luxfield::render
