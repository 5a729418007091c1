#include "luxfield/bench/occluder_scene.h"

namespace luxfield::bench {

using scene::Vec3;

scene::Geometry OccluderScene() {
  scene::Geometry geometry;
  geometry.materials.emplace_back();
  const auto box = [&](Vec3 at, Vec3 size, Vec3 rotate_deg = {}) {
    AppendBox(scene::Translation(at) * scene::RotationXyz(rotate_deg) * scene::Scaling(size), 0,
              geometry);
  };
  AppendQuad({-5, -0.65, -3}, {0, 0, 11}, {10, 0, 0}, 0, geometry);
  AppendQuad({5, -0.65, 6}, {0, 4, 0}, {-10, 0, 0}, 0, geometry);
  box({0.15, -0.25, 0.45}, {0.03, 0.8, 0.03}, {0, 20, 0});
  for (int k = 0; k < 5; ++k) box({-0.55 + 0.15 * k, -0.3, 1.2}, {0.04, 0.7, 0.02});
  box({1.0, -0.3, 2.0}, {0.4, 0.7, 0.2}, {30, 50, 10});
  box({-0.6, -0.4, 2.5}, {0.5, 0.5, 0.5}, {0, 30, 0});
  box({0.5, -0.2, 3.5}, {0.08, 0.9, 0.08});
  box({-0.3, -0.35, 4.8}, {0.8, 0.6, 0.04}, {0, 10, 0});
  return geometry;
}

scene::Camera OccluderCamera(int width, int height, int step) {
  const Vec3 along{-0.008, 0, 0.006};  // m
  return scene::Camera::LookAt(Vec3{0.7, 0.9, -1.2} + step * along, {0, -0.35, 2.6}, {0, 1, 0}, 42,
                               width, height);
}

}  // namespace luxfield::bench
