// Soft shadows without noise at frame rate: a luminaire's filter plane in 4 x 4 patches, a shadow
// map seen from each (docs/theory.md 7.5).
//
//   v(p) = sum_k V_k(p) w_k(p) / sum_k w_k(p),   w_k = B_k(a, tau) (n.(u_k - p))+
//
// is the share of the light that reaches p, with u_k the patch's point and B_k its light
// (preprocess/patch_light.h), V_k how much of p's four texels in the map of patch k is seen,
// weighed bilinearly. v lies in [0, 1]; light times v has no noise, and is off by what 16 points
// and texels make of the lamp's area and of edges. A map spans the directions in which light of its
// patch reaches receivers at least delta away; outside of it nothing is hidden.
//
// A texel has the width f = z texel at the distance z, texel the tangents that the map spans over
// its size. It is compared with the receiver's tangent plane along the texel's ray, so that planes
// do not shade themselves at any angle; the plane is lifted by 0.3 f for normals that are
// interpolated. Edges are blurred by f and true to f; where what throws them is near, rays to four of
// the patches decide. What is thinner than f may be missed.
//
// Maps are drawn by rasterising the scene's triangles: anew for every place of the lamp, in some
// milliseconds.
//
//   const PatchShadows shadows(device, luminaire, world_from_luminaire, scene.bvh());
//   const Buffer share = shadows.Shares(gbuffer);
#pragma once

#include "luxfield/render/device/device.h"
#include "luxfield/render/lights/luminaire_on_device.h"
#include "luxfield/render/scene/device_bvh.h"
#include "luxfield/render/scene/gbuffer.h"
#include "luxfield/scene/transform.h"

namespace luxfield::render {

class PatchShadows {
 public:
  static constexpr int kMinSize = 16, kMaxSize = 4096;  // texels, a multiple of 16

  // Refers to the luminaire and to the scene, which have to outlive it.
  // Draws the maps of the luminaire's lit patches, of size^2 texels, size rounded up to a multiple
  // of 16. The luminaire must have its patches' light (LuminaireOnDevice::has_patches). Throws
  // InputError for a size outside of [kMinSize, kMaxSize] and for maps that the device cannot hold;
  // DeviceError.
  PatchShadows(const Device& device, const LuminaireOnDevice& luminaire,
               const scene::Pose& world_from_luminaire, const DeviceBvh& bvh, int size = 384);

  // The same for the luminaire elsewhere, or another scene. Enqueues and returns.
  void Draw(const scene::Pose& world_from_luminaire, const DeviceBvh& bvh);

  // float v[pixel], 0 where no light of the luminaire arrives; until the next call. Enqueues and
  // returns.
  const Buffer& Shares(const GBuffer& gbuffer) const;

  int size() const { return size_; }
  // The size that maps of `size` texels get.
  static int RoundUp(int size);

 private:
  Device device_;
  const LuminaireOnDevice* luminaire_;
  const DeviceBvh* bvh_ = nullptr;
  int size_ = 0;
  Buffer params_, patches_, triangles_, found_, maps_;
  Kernel gather_, draw_;
  mutable Kernel share_;   // its arguments are set anew for every launch
  mutable Buffer shares_;  // of the last G-buffer
};

}  // namespace luxfield::render
