// Ray queries on the CPU: the reference that device visibility is judged by.
#pragma once

#include <memory>
#include <optional>

#include "luxfield/scene/geometry.h"

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

// Embree in robust mode, float32. Queries may run on several threads.
class RayCaster {
 public:
  explicit RayCaster(const Geometry& geometry);  // copies what it needs; DeviceError
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  std::optional<RayHit> Intersect(const Ray& ray) const;  // the nearest
  bool Occluded(const Ray& ray) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::scene
