#include "luxfield/bench/ball_scene.h"

#include <cmath>
#include <numbers>

namespace luxfield::bench {
namespace {

using scene::Vec3;

// Triangles between meridians and parallels, with the sphere's normals.
void AppendBall(Vec3 centre, double radius, std::uint32_t material, scene::Geometry& geometry) {
  constexpr int kMeridians = 64, kParallels = 32;
  const auto first = static_cast<std::uint32_t>(geometry.vertices.size());
  for (int row = 0; row <= kParallels; ++row)
    for (int column = 0; column <= kMeridians; ++column) {
      const double theta = std::numbers::pi * row / kParallels,
                   phi = 2 * std::numbers::pi * column / kMeridians;
      const Vec3 n{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                   std::cos(theta)};
      const Vec3 p = centre + radius * n;
      geometry.vertices.push_back(
          {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)},
           {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)},
           {}});
    }
  for (std::uint32_t row = 0; row < kParallels; ++row)
    for (std::uint32_t column = 0; column < kMeridians; ++column) {
      const std::uint32_t a = first + row * (kMeridians + 1) + column, b = a + kMeridians + 1;
      geometry.triangles.push_back({{a, b, b + 1}, material});
      geometry.triangles.push_back({{a, b + 1, a + 1}, material});
    }
}

}  // namespace

scene::Scene BallScene(int width, int height) {
  scene::Scene scene;
  scene::Material floor, diffuse, gold, plastic;
  floor.albedo = {0.4f, 0.4f, 0.4f};
  diffuse.albedo = {0.7f, 0.65f, 0.6f};
  gold.kind = scene::MaterialKind::kGgx;
  gold.albedo = {1.0f, 0.77f, 0.34f};
  gold.metallic = 1;
  gold.roughness = 0.3f;
  plastic.kind = scene::MaterialKind::kPhong;
  plastic.albedo = {0.5f, 0.08f, 0.06f};
  plastic.specular = {0.3f, 0.3f, 0.3f};
  plastic.exponent = 100;
  scene.geometry.materials = {floor, diffuse, gold, plastic};
  scene::AppendQuad({-6, -6, 0}, {12, 0, 0}, {0, 12, 0}, 0, scene.geometry);
  AppendBall({-1.2, 0, 0.5}, 0.5, 1, scene.geometry);
  AppendBall({0, 0, 0.5}, 0.5, 2, scene.geometry);
  AppendBall({1.2, 0, 0.5}, 0.5, 3, scene.geometry);
  scene.camera = scene::Camera::LookAt({0, -4.5, 1.6}, {0, 0, 0.5}, {0, 0, 1}, 34, width, height);
  return scene;
}

}  // namespace luxfield::bench
