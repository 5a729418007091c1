#include "luxfield/render/scene/ray_scene.h"

#include <fmt/format.h>

#include <string>

#include "luxfield/render/scene/device_bvh.h"
#include "luxfield/scene/ray_caster.h"

namespace luxfield::render {
namespace {

const Buffer& RangesOf(const RayBuffers& batch) {
  static const Buffer none;
  return batch.ranges ? *batch.ranges : none;
}

class HostRayScene : public RayScene {
 public:
  HostRayScene(const Device& device, const scene::Geometry& geometry)
      : device_name_(fmt::format("{} ({})", device.info().name, device.info().platform)),
        caster_(geometry) {}

  void Intersect(const RayBuffers& batch, const Buffer& hits) const override {
    const Mapped<scene::PackedHit> out(hits);
    OnHost(batch, [&](const scene::RayBatch& rays) { caster_.Intersect(rays, out.span()); });
  }
  void Occluded(const RayBuffers& batch, const Buffer& hidden) const override {
    const Mapped<cl_uchar> out(hidden);
    OnHost(batch, [&](const scene::RayBatch& rays) { caster_.Occluded(rays, out.span()); });
  }

 private:
  template <typename Trace>
  void OnHost(const RayBuffers& batch, Trace trace) const {
    const Mapped<const scene::PackedRay> rays(batch.rays);
    const Mapped<const scene::RayRange> ranges(RangesOf(batch));
    trace({.rays = rays.span().first(batch.group_count * batch.group_size),
           .group_size = batch.group_size,
           .ranges = ranges.span(),
           .coherent = batch.coherent,
           .made_by = device_name_});
  }

  std::string device_name_;
  scene::RayCaster caster_;
};

class KernelRayScene : public RayScene {
 public:
  KernelRayScene(const Device& device, const scene::Geometry& geometry)
      : bvh_(UploadBvh(device, geometry, scene::BuildBvh(geometry))),
        intersect_(BuildProgram(device), "IntersectRays"),
        occlude_(BuildProgram(device), "OccludeRays") {}

  void Intersect(const RayBuffers& batch, const Buffer& hits) const override {
    Run(intersect_, batch, hits);
  }
  void Occluded(const RayBuffers& batch, const Buffer& hidden) const override {
    Run(occlude_, batch, hidden);
  }
  const DeviceBvh* bvh() const override { return &bvh_; }

 private:
  static Program BuildProgram(const Device& device) {
    return Program::Build(device, "kernels/scene/trace.cl");
  }

  void Run(Kernel& kernel, const RayBuffers& batch, const Buffer& out) const {
    kernel
        .Set(bvh_.nodes, bvh_.triangles, batch.rays, RangesOf(batch),
             static_cast<cl_int>(batch.group_size), static_cast<cl_ulong>(batch.group_count), out)
        .Enqueue(batch.group_count * batch.group_size);
  }

  DeviceBvh bvh_;
  mutable Kernel intersect_, occlude_;  // their arguments are set anew for every launch
};

}  // namespace

std::unique_ptr<RayScene> MakeRayScene(const Device& device, const scene::Geometry& geometry) {
  if (device.tuning().host_rays) return std::make_unique<HostRayScene>(device, geometry);
  return std::make_unique<KernelRayScene>(device, geometry);
}

}  // namespace luxfield::render
