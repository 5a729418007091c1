// Embree's packets of 4, 8 and 16 rays under one name; for the .cc files of scene/.
#pragma once

#include <embree3/rtcore.h>

#include <array>
#include <bit>
#include <cstdint>
#include <limits>

#include "luxfield/scene/ray_types.clh"

namespace luxfield::scene {

template <int kLanes>
struct PacketTypes;
template <>
struct PacketTypes<4> {
  using RayHit = RTCRayHit4;
  static constexpr auto kIntersect = rtcIntersect4;
  static constexpr auto kOccluded = rtcOccluded4;
};
template <>
struct PacketTypes<8> {
  using RayHit = RTCRayHit8;
  static constexpr auto kIntersect = rtcIntersect8;
  static constexpr auto kOccluded = rtcOccluded8;
};
template <>
struct PacketTypes<16> {
  using RayHit = RTCRayHit16;
  static constexpr auto kIntersect = rtcIntersect16;
  static constexpr auto kOccluded = rtcOccluded16;
};

// Gathers rays until a packet is full, traces them and hands out what became of each.
template <int kLanes>
class RayPacket {
 public:
  RayPacket(RTCScene scene, bool coherent) : scene_(scene) {
    rtcInitIntersectContext(&context_);
    if (coherent) context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (int lane = 0; lane < kLanes; ++lane) packet_.ray.mask[lane] = ~0u;
  }

  bool empty() const { return count_ == 0; }
  bool full() const { return count_ == kLanes; }

  void Add(const PackedRay& ray, std::size_t slot) {
    auto& rays = packet_.ray;
    const int lane = count_++;
    rays.org_x[lane] = ray.origin[0];
    rays.org_y[lane] = ray.origin[1];
    rays.org_z[lane] = ray.origin[2];
    rays.dir_x[lane] = ray.direction[0];
    rays.dir_y[lane] = ray.direction[1];
    rays.dir_z[lane] = ray.direction[2];
    // Embree counts hits at the ends of a ray.
    rays.tnear[lane] = Step(ray.t_min, 1);
    rays.tfar[lane] = Step(ray.t_max, -1);
    valid_[lane] = ray.t_max > ray.t_min ? -1 : 0;
    slots_[lane] = slot;
  }

  // store(slot, hit) for every ray; leaves the packet empty.
  template <typename Store>
  void Intersect(Store store) {
    for (int lane = 0; lane < count_; ++lane) packet_.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    PacketTypes<kLanes>::kIntersect(valid_.data(), scene_, &context_, &packet_);
    for (int lane = 0; lane < count_; ++lane) {
      const auto& hit = packet_.hit;
      if (hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID)
        store(slots_[lane], PackedHit{std::numeric_limits<float>::infinity(), -1, 0, 0});
      else
        store(slots_[lane], PackedHit{packet_.ray.tfar[lane], static_cast<int>(hit.primID[lane]),
                                      hit.u[lane], hit.v[lane]});
    }
    Clear();
  }

  // store(slot, hidden) for every ray; leaves the packet empty.
  template <typename Store>
  void Occluded(Store store) {
    PacketTypes<kLanes>::kOccluded(valid_.data(), scene_, &context_, &packet_.ray);
    for (int lane = 0; lane < count_; ++lane)
      store(slots_[lane], valid_[lane] && packet_.ray.tfar[lane] < 0);  // Embree's mark
    Clear();
  }

 private:
  // The float so many steps further from 0; 0 itself stays.
  static float Step(float t, int steps) {
    return t > 0 ? std::bit_cast<float>(std::bit_cast<std::int32_t>(t) + steps) : t;
  }

  void Clear() {
    count_ = 0;
    valid_.fill(0);
  }

  RTCScene scene_;
  RTCIntersectContext context_;
  typename PacketTypes<kLanes>::RayHit packet_{};
  alignas(64) std::array<int, kLanes> valid_{};
  std::array<std::size_t, kLanes> slots_{};
  int count_ = 0;
};

}  // namespace luxfield::scene
