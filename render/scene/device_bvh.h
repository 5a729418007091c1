// The hierarchy of a scene's triangles in device memory, for kernels that trace rays themselves
// (kernels/scene/bvh.clh: Shadowed, Occluded, Intersect).
#pragma once

#include "luxfield/render/device/device.h"
#include "luxfield/scene/bvh.h"

namespace luxfield::render {

struct DeviceBvh {
  Buffer nodes;      // BvhNode, kernels/scene/bvh_types.clh
  Buffer triangles;  // BvhTriangle
};

DeviceBvh UploadBvh(const Device& device, const scene::Geometry& geometry, const scene::Bvh& bvh);

}  // namespace luxfield::render
