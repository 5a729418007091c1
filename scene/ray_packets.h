// Embree's packets of 4, 8 and 16 rays under one name; for the .cc files of scene/.
#pragma once

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

#include "luxfield/core/error.h"
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
  // `made_by`: a device, for the error.
  RayPacket(RTCScene scene, bool coherent, std::string_view made_by)
      : scene_(scene), made_by_(made_by) {
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

  // store(slot, hit) for every ray; leaves the packet empty. DeviceError if one cannot be traced.
  template <typename Store>
  void Intersect(Store store) {
    Check();
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

  // store(slot, hidden) for every ray; leaves the packet empty. DeviceError if one cannot be traced.
  template <typename Store>
  void Occluded(Store store) {
    Check();
    PacketTypes<kLanes>::kOccluded(valid_.data(), scene_, &context_, &packet_.ray);
    for (int lane = 0; lane < count_; ++lane)
      store(slots_[lane], valid_[lane] && packet_.ray.tfar[lane] < 0);  // Embree's mark
    Clear();
  }

 private:
  // Embree's bound of coordinates. At others it ends the program, if it is built to check them.
  static constexpr float kMost = 1.844e18f;

  bool IsTraceable(int lane) const {
    const auto& rays = packet_.ray;
    const auto bounded = [](float x) { return std::abs(x) <= kMost; };
    const bool is_bounded = bounded(rays.org_x[lane]) & bounded(rays.org_y[lane]) &
                            bounded(rays.org_z[lane]) & bounded(rays.dir_x[lane]) &
                            bounded(rays.dir_y[lane]) & bounded(rays.dir_z[lane]);
    const bool is_empty = valid_[lane] == 0,
               has_ends = !std::isunordered(rays.tnear[lane], rays.tfar[lane]);
    return has_ends & (is_bounded | is_empty);
  }

  void Check() const {
    bool all = true;
    for (int lane = 0; lane < kLanes; ++lane) all &= IsTraceable(lane);
    if (all) return;
    int lane = 0;
    while (IsTraceable(lane)) ++lane;
    const auto& rays = packet_.ray;
    throw DeviceError(fmt::format(
        "{} made a ray that cannot be traced, from ({}, {}, {}) along ({}, {}, {}) between {} and "
        "{}: its driver compiles kernels wrongly; use another --device or version of the driver, "
        "or set LUXFIELD_TUNING=group=1",
        made_by_, rays.org_x[lane], rays.org_y[lane], rays.org_z[lane], rays.dir_x[lane],
        rays.dir_y[lane], rays.dir_z[lane], rays.tnear[lane], rays.tfar[lane]));
  }

  // The float so many steps further from 0; 0 itself stays.
  static float Step(float t, int steps) {
    return t > 0 ? std::bit_cast<float>(std::bit_cast<std::int32_t>(t) + steps) : t;
  }

  void Clear() {
    count_ = 0;
    valid_.fill(0);
  }

  RTCScene scene_;
  std::string_view made_by_;
  RTCIntersectContext context_;
  typename PacketTypes<kLanes>::RayHit packet_{};
  alignas(64) std::array<int, kLanes> valid_{};
  std::array<std::size_t, kLanes> slots_{};
  int count_ = 0;
};

}  // namespace luxfield::scene
