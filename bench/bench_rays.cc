#include "luxfield/bench/bench_rays.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "luxfield/bench/hill_mesh.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/scene/ray_scene.h"
#include "luxfield/scene/embree.h"
#include "luxfield/scene/scene.h"

namespace luxfield::bench {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Normalized;
using scene::PackedHit;
using scene::PackedRay;
using scene::Vec3;

PackedRay MakeQuery(Vec3 origin, Vec3 direction, float t_max) {
  return {
      {static_cast<float>(origin.x), static_cast<float>(origin.y), static_cast<float>(origin.z)},
      0,
      {static_cast<float>(direction.x), static_cast<float>(direction.y),
       static_cast<float>(direction.z)},
      t_max};
}

struct RaySet {
  std::string name;
  bool closest = false, coherent = false;
  std::vector<PackedRay> queries;
};

// Embree over the same triangles.
class Peer {
 public:
  explicit Peer(const scene::Geometry& geometry) : scene_(rtcNewScene(device_.get())) {
    if (!scene_) device_.Fail("making a scene");
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry mesh = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               geometry.vertices.data(), 0, sizeof(scene::Vertex),
                               geometry.vertices.size());
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               geometry.triangles.data(), 0, sizeof(scene::Triangle),
                               geometry.triangles.size());
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene_, mesh);
    rtcReleaseGeometry(mesh);
    rtcCommitScene(scene_);
    device_.Check("building the scene of the peer");
  }
  ~Peer() { rtcReleaseScene(scene_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // Distances of the nearest hits; infinite where there are none.
  std::vector<float> Distances(const std::vector<PackedRay>& queries) const {
    std::vector<float> distances(queries.size());
    core::ParallelFor(queries.size(), kPiece, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) distances[k] = Nearest(queries[k]).ray.tfar;
    });
    return distances;
  }

  std::size_t TraceSingle(const RaySet& rays) const {
    return Count(rays, [&](std::size_t begin, std::size_t end) {
      std::size_t hits = 0;
      for (std::size_t k = begin; k < end; ++k) {
        if (rays.closest) {
          hits += Nearest(rays.queries[k]).hit.geomID != RTC_INVALID_GEOMETRY_ID;
          continue;
        }
        RTCRay ray = Single(rays.queries[k]).ray;
        RTCIntersectContext context = Context(false);
        rtcOccluded1(scene_, &context, &ray);
        hits += ray.tfar < 0;
      }
      return hits;
    });
  }

  std::size_t TracePackets(const RaySet& rays) const {
    return Count(rays, [&](std::size_t begin, std::size_t end) {
      std::size_t hits = 0;
      for (std::size_t k = begin; k < end; k += kPacket)
        hits += TracePacket(rays, k, std::min(end - k, kPacket));
      return hits;
    });
  }

 private:
  static constexpr std::size_t kPiece = 1 << 12, kPacket = 16;

  template <typename Trace>
  static std::size_t Count(const RaySet& rays, Trace trace) {
    std::atomic<std::size_t> hits{0};
    core::ParallelFor(rays.queries.size(), kPiece,
                      [&](std::size_t begin, std::size_t end) { hits += trace(begin, end); });
    return hits;
  }

  static RTCIntersectContext Context(bool coherent) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    return context;
  }

  static RTCRayHit Single(const PackedRay& query) {
    RTCRayHit single{};
    single.ray.org_x = query.origin[0], single.ray.org_y = query.origin[1];
    single.ray.org_z = query.origin[2];
    single.ray.dir_x = query.direction[0], single.ray.dir_y = query.direction[1];
    single.ray.dir_z = query.direction[2];
    single.ray.tfar = query.t_max;
    single.ray.mask = ~0u;
    single.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    return single;
  }

  RTCRayHit Nearest(const PackedRay& query) const {
    RTCRayHit single = Single(query);
    RTCIntersectContext context = Context(false);
    rtcIntersect1(scene_, &context, &single);
    return single;
  }

  std::size_t TracePacket(const RaySet& rays, std::size_t first, std::size_t count) const {
    RTCRayHit16 packet{};
    alignas(64) std::array<int, kPacket> valid{};
    for (std::size_t k = 0; k < count; ++k) {
      const PackedRay& query = rays.queries[first + k];
      valid[k] = -1;
      packet.ray.org_x[k] = query.origin[0], packet.ray.org_y[k] = query.origin[1];
      packet.ray.org_z[k] = query.origin[2];
      packet.ray.dir_x[k] = query.direction[0], packet.ray.dir_y[k] = query.direction[1];
      packet.ray.dir_z[k] = query.direction[2];
      packet.ray.tfar[k] = query.t_max;
      packet.ray.mask[k] = ~0u;
      packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context = Context(rays.coherent);
    if (rays.closest)
      rtcIntersect16(valid.data(), scene_, &context, &packet);
    else
      rtcOccluded16(valid.data(), scene_, &context, &packet.ray);
    std::size_t hits = 0;
    for (std::size_t k = 0; k < count; ++k)
      hits +=
          rays.closest ? packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID : packet.ray.tfar[k] < 0;
    return hits;
  }

  scene::EmbreeDevice device_;
  RTCScene scene_;
};

RaySet PixelRays(const scene::Camera& camera) {
  RaySet rays{"closest", true, true, {}};
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column)
      rays.queries.push_back(MakeQuery(camera.position,
                                       Normalized(camera.Direction(column + 0.5, row + 0.5)),
                                       std::numeric_limits<float>::max()));
  return rays;
}

// About +z, where the hills' normals point to in the mean.
Vec3 CosineDirection(core::Random& random) {
  const double r = std::sqrt(random.Uniform()), phi = 2 * std::numbers::pi * random.Uniform();
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(1e-6, 1 - r * r))};
}

// From the hits of `primary`, a little before them.
void AddShadowRays(const RaySet& primary, const std::vector<float>& distances, RaySet& sky,
                   RaySet& area) {
  constexpr Vec3 kCorner{6, 6, 2};
  constexpr double kEdge_m = 2, kBefore = 1e-4;
  core::Random random(5, 0);
  for (std::size_t k = 0; k < distances.size(); ++k) {
    const PackedRay& query = primary.queries[k];
    if (!(distances[k] < std::numeric_limits<float>::max())) continue;
    const Vec3 from{query.origin[0], query.origin[1], query.origin[2]},
        along{query.direction[0], query.direction[1], query.direction[2]};
    const Vec3 origin = from + (distances[k] * (1 - kBefore)) * along;
    sky.queries.push_back(
        MakeQuery(origin, CosineDirection(random), std::numeric_limits<float>::max()));
    const Vec3 light = kCorner + Vec3{kEdge_m * random.Uniform(), kEdge_m * random.Uniform(), 0};
    area.queries.push_back(MakeQuery(origin, light - origin, 1));
  }
}

// A set in device memory, traced in batches as primary and shadow rays are
// (render/scene/ray_scene.h); what becomes of them stays there.
class DeviceRays {
 public:
  DeviceRays(const render::Device& device, const render::RayScene& scene, const RaySet& rays)
      : device_(device), scene_(scene), closest_(rays.closest), coherent_(rays.coherent) {
    const std::span all(rays.queries);
    for (std::size_t first = 0; first < all.size(); first += kBatch) {
      const auto batch = all.subspan(first, std::min(kBatch, all.size() - first));
      rays_.push_back(render::Buffer::From(device, batch));
      answers_.emplace_back(device,
                            batch.size() * (closest_ ? sizeof(PackedHit) : sizeof(cl_uchar)));
    }
    Trace();  // touches the memory
  }
  void Trace() const {
    for (std::size_t b = 0; b < rays_.size(); ++b) {
      const render::RayBuffers batch{.rays = rays_[b],
                                     .group_count = rays_[b].bytes() / sizeof(PackedRay),
                                     .coherent = closest_ && coherent_};
      if (closest_)
        scene_.Intersect(batch, answers_[b]);
      else
        scene_.Occluded(batch, answers_[b]);
    }
    device_.Finish();
  }
  double HitShare() const {
    std::ptrdiff_t hits = 0;
    std::size_t all = 0;
    for (const render::Buffer& answers : answers_) {
      if (closest_) {
        const auto of_batch = answers.Download<PackedHit>();
        hits += std::ranges::count_if(of_batch, [](const auto& hit) { return hit.triangle >= 0; });
        all += of_batch.size();
      } else {
        const auto of_batch = answers.Download<cl_uchar>();
        hits += std::ranges::count(of_batch, cl_uchar{1});
        all += of_batch.size();
      }
    }
    return static_cast<double>(hits) / static_cast<double>(all);
  }

 private:
  static constexpr std::size_t kBatch = std::size_t{1} << 17;

  render::Device device_;
  const render::RayScene& scene_;
  bool closest_, coherent_;
  std::vector<render::Buffer> rays_, answers_;
};

}  // namespace

std::vector<RaySpeed> BenchRays(const BenchRaysOptions& options) {
  if (std::min({options.triangles, options.width, options.height, options.runs}) < 1)
    throw InputError("bench rays: triangles, width, height and runs must be at least 1");
  const auto device = render::Device::Open(options.device, options.threads);
  const scene::Geometry geometry = HillMesh(options.triangles);
  const Peer peer(geometry);
  std::vector<RaySet> sets{PixelRays(HillCamera(options.width, options.height)),
                           {"occlusion, sky", false, false, {}},
                           {"occlusion, area light", false, true, {}}};
  AddShadowRays(sets[0], peer.Distances(sets[0].queries), sets[1], sets[2]);
  const auto scene = render::MakeRayScene(device, geometry);
  std::vector<RaySpeed> speeds;
  for (const RaySet& rays : sets) {
    const auto count = static_cast<double>(rays.queries.size());
    const DeviceRays on_device(device, *scene, rays);
    RaySpeed speed{rays.name, {}, {}, {}, 0, 0};
    for (int run = 0; run < options.runs; ++run) {
      core::Stopwatch ours;
      on_device.Trace();
      const double ours_s = device.info().is_cpu ? ours.CoreSeconds() : ours.WallSeconds();
      speed.device.push_back(1e-6 * count / ours_s);
      const core::Stopwatch single;
      peer.TraceSingle(rays);
      speed.embree_single.push_back(1e-6 * count / single.CoreSeconds());
      const core::Stopwatch packets;
      speed.embree_hits = static_cast<double>(peer.TracePackets(rays)) / count;
      speed.embree_packets.push_back(1e-6 * count / packets.CoreSeconds());
    }
    speed.device_hits = on_device.HitShare();
    speeds.push_back(speed);
  }
  return speeds;
}

}  // namespace luxfield::bench
