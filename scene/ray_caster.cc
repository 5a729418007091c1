#include "luxfield/scene/ray_caster.h"

#include <algorithm>

#include "luxfield/core/parallel.h"
#include "luxfield/scene/embree.h"
#include "luxfield/scene/ray_packets.h"

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

// Rays that a thread takes at once: enough to hide what starting it costs.
constexpr std::size_t kRaysAtOnce = 2048;

// Of which Embree traces packets without splitting them.
int NativeLanes(RTCDevice device) {
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) return 16;
  return rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8 : 4;
}

// trace(packet) for all packets of the batch's groups [begin, end); the last may not be full.
template <int kLanes, typename Trace>
void TraceGroups(RTCScene scene, const RayBatch& batch, std::size_t begin, std::size_t end,
                 Trace trace) {
  RayPacket<kLanes> packet(scene, batch.coherent, batch.made_by);
  const RayRange all{0, static_cast<int>(batch.group_size)};
  for (std::size_t group = begin; group < end; ++group) {
    const RayRange range = batch.ranges.empty() ? all : batch.ranges[group];
    for (int ray = range.begin; ray < range.end; ++ray) {
      const std::size_t slot = group * batch.group_size + ray;
      packet.Add(batch.rays[slot], slot);
      if (packet.full()) trace(packet);
    }
  }
  if (!packet.empty()) trace(packet);
}

template <typename Trace>
void TraceBatch(RTCScene scene, int lanes, const RayBatch& batch, Trace trace) {
  const std::size_t groups = batch.rays.size() / batch.group_size;
  core::ParallelFor(groups, std::max<std::size_t>(1, kRaysAtOnce / batch.group_size),
                    [&](std::size_t begin, std::size_t end) {
                      if (lanes == 16)
                        TraceGroups<16>(scene, batch, begin, end, trace);
                      else if (lanes == 8)
                        TraceGroups<8>(scene, batch, begin, end, trace);
                      else
                        TraceGroups<4>(scene, batch, begin, end, trace);
                    });
}

}  // namespace

struct RayCaster::Impl {
  EmbreeDevice device;
  RTCScene scene;
  int lanes;

  Impl() : scene(rtcNewScene(device.get())), lanes(NativeLanes(device.get())) {
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

void RayCaster::Intersect(const RayBatch& batch, std::span<PackedHit> hits) const {
  TraceBatch(impl_->scene, impl_->lanes, batch, [&](auto& packet) {
    packet.Intersect([&](std::size_t slot, const PackedHit& hit) { hits[slot] = hit; });
  });
}

void RayCaster::Occluded(const RayBatch& batch, std::span<std::uint8_t> hidden) const {
  TraceBatch(impl_->scene, impl_->lanes, batch, [&](auto& packet) {
    packet.Occluded([&](std::size_t slot, bool is_hidden) { hidden[slot] = is_hidden; });
  });
}

}  // namespace luxfield::scene
