// A scene of many triangles in all directions.
#pragma once

#include <cstdint>

#include "luxfield/core/random.h"
#include "luxfield/scene/geometry.h"

namespace luxfield::render {

// `count` quads around the origin, every fourth a thin one, above a wide floor at z = -5.75.
inline scene::Geometry TriangleSoup(int count, std::uint64_t seed) {
  core::Random random(seed, 1);
  scene::Geometry geometry;
  const auto normal = [&] {
    return scene::Vec3{random.Normal(), random.Normal(), random.Normal()};
  };
  for (int i = 0; i < count; ++i) {
    const scene::Vec3 corner = 3.0 * normal();
    scene::AppendQuad(corner, normal(), i % 4 ? normal() : 0.01 * normal(), 0, geometry);
  }
  scene::AppendBox(scene::Translation({0, 0, -6}) * scene::Scaling({20, 20, 0.5}), 0, geometry);
  return geometry;
}

}  // namespace luxfield::render
