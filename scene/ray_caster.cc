#include "luxfield/scene/ray_caster.h"

#include <algorithm>

#include "luxfield/scene/embree.h"

namespace luxfield::scene {
namespace {

RTCRay ToEmbree(const Ray& ray) {
  RTCRay out{};
  out.org_x = static_cast<float>(ray.origin.x);
  out.org_y = static_cast<float>(ray.origin.y);
  out.org_z = static_cast<float>(ray.origin.z);
  out.dir_x = static_cast<float>(ray.direction.x);
  out.dir_y = static_cast<float>(ray.direction.y);
  out.dir_z = static_cast<float>(ray.direction.z);
  out.tnear = static_cast<float>(ray.t_min);
  out.tfar = static_cast<float>(ray.t_max);
  out.mask = ~0u;
  return out;
}

}  // namespace

struct RayCaster::Impl {
  EmbreeDevice device;
  RTCScene scene;

  Impl() : scene(rtcNewScene(device.get())) {
    if (!scene) device.Fail("making a scene");
  }
  ~Impl() { rtcReleaseScene(scene); }
};

RayCaster::RayCaster(const Geometry& geometry) : impl_(std::make_unique<Impl>()) {
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  if (!geometry.triangles.empty()) {
    RTCGeometry mesh = rtcNewGeometry(impl_->device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* positions = static_cast<float*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), geometry.vertices.size()));
    auto* indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), geometry.triangles.size()));
    if (!positions || !indices) {
      rtcReleaseGeometry(mesh);
      impl_->device.Fail("reserving memory for the scene");
    }
    for (const Vertex& vertex : geometry.vertices)
      positions = std::copy_n(vertex.position.begin(), 3, positions);
    for (const Triangle& triangle : geometry.triangles)
      indices = std::copy_n(triangle.vertex.begin(), 3, indices);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(impl_->scene, mesh);
    rtcReleaseGeometry(mesh);
  }
  rtcCommitScene(impl_->scene);
  impl_->device.Check("building the reference scene");
}

RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

std::optional<RayHit> RayCaster::Intersect(const Ray& ray) const {
  RTCRayHit query{ToEmbree(ray), {}};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return RayHit{query.ray.tfar, query.hit.primID, query.hit.u, query.hit.v};
}

bool RayCaster::Occluded(const Ray& ray) const {
  RTCRay query = ToEmbree(ray);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->scene, &context, &query);
  return query.tfar < 0;  // Embree's mark
}

}  // namespace luxfield::scene
