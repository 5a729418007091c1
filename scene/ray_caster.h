// Ray queries on the CPU: the reference that device visibility is judged by, one ray at a time, and
// what traces batches of rays for renderers whose device is the CPU.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "luxfield/scene/geometry.h"
#include "luxfield/scene/ray_types.clh"

namespace luxfield::scene {

// origin + t * direction, t in (t_min, t_max); the direction need not have unit length.
struct Ray {
  Vec3 origin, direction;
  double t_min = 0, t_max = 1e30;
};

struct RayHit {
  double t = 0;
  std::uint32_t triangle = 0;
  double b = 0, c = 0;  // barycentric weights of the triangle's second and third vertex
};

// Rays in groups of `group_size` slots. Of group g the rays [ranges[g].begin, ranges[g].end) are
// traced, counted from slot g * group_size; all of them where `ranges` is empty.
struct RayBatch {
  std::span<const PackedRay> rays{};
  std::size_t group_size = 1;
  std::span<const RayRange> ranges{};
  bool coherent = false;  // neighbours start at one place and go nearly the same way
  std::string_view made_by = "luxfield";  // the device that made the rays, for the error
};

// Embree in robust mode, float32. Queries may run on several threads.
//
//   const RayCaster caster(geometry);
//   std::vector<std::uint8_t> hidden(rays.size());
//   caster.Occluded({.rays = rays}, hidden);
class RayCaster {
 public:
  explicit RayCaster(const Geometry& geometry);  // copies what it needs; DeviceError
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  std::optional<RayHit> Intersect(const Ray& ray) const;  // the nearest
  bool Occluded(const Ray& ray) const;

  // The same for batches, in packets as wide as the processor's vectors, on the threads of the
  // caller's execution. Results lie in their rays' slots; slots that are not traced keep what they
  // hold. `hidden` becomes 1 where something lies on the ray, else 0. DeviceError for a ray with a
  // NaN as an end, or with a coordinate that is not finite or above 1.8e18 between its ends.
  void Intersect(const RayBatch& batch, std::span<PackedHit> hits) const;
  void Occluded(const RayBatch& batch, std::span<std::uint8_t> hidden) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::scene
