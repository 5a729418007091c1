// A scene's triangles for rays, one interface for all devices: batches of rays in device memory go
// in, hits or visibilities come out. Where the device is a CPU, Embree traces them in place, in
// packets (scene/ray_caster.h), elsewhere a kernel does (kernels/scene/trace.cl); DeviceTuning says
// which. Answers are equal but for rays that pass an edge or start or end on a triangle within
// rounding: some 1e-6 of the coordinates. Embree gets no ray that is not finite: kernels that a driver
// compiles wrongly may make some, which are a DeviceError.
//
//   const auto scene = MakeRayScene(device, geometry);
//   scene->Intersect({.rays = rays, .group_count = count}, hits);
#pragma once

#include <cstddef>
#include <memory>

#include "luxfield/render/device/device.h"
#include "luxfield/scene/geometry.h"
#include "luxfield/scene/ray_types.clh"

namespace luxfield::render {

// Rays in groups of `group_size` slots. Of group g the rays of ranges[g] are traced, counted from
// slot g * group_size; all of them where `ranges` is null.
struct RayBuffers {
  const Buffer& rays;  // scene::PackedRay
  std::size_t group_count = 0, group_size = 1;
  const Buffer* ranges = nullptr;  // scene::RayRange
  bool coherent = false;           // neighbours start at one place and go nearly the same way
};

struct DeviceBvh;  // render/scene/device_bvh.h

class RayScene {
 public:
  virtual ~RayScene() = default;
  // `hits`: scene::PackedHit in the slot of each ray that is traced, of the nearest triangle.
  virtual void Intersect(const RayBuffers& batch, const Buffer& hits) const = 0;
  // `hidden`: cl_uchar in the slot of each ray that is traced, 1 where something lies on it, else 0.
  virtual void Occluded(const RayBuffers& batch, const Buffer& hidden) const = 0;
  // The hierarchy that kernels trace rays with; null where the host does.
  virtual const DeviceBvh* bvh() const { return nullptr; }
};

// Builds the hierarchy. InputError if there are too many triangles, DeviceError if the device cannot
// hold them.
std::unique_ptr<RayScene> MakeRayScene(const Device& device, const scene::Geometry& geometry);

}  // namespace luxfield::render
