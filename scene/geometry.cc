#include "luxfield/scene/geometry.h"

namespace luxfield::scene {
namespace {

std::array<float, 3> ToFloat(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

}  // namespace

void MakeLambertian(Geometry& geometry) {
  for (Material& material : geometry.materials) {
    Material diffuse;
    diffuse.name = material.name;
    diffuse.albedo = material.albedo;
    diffuse.texture = material.texture;
    diffuse.texture_placement = material.texture_placement;
    diffuse.emission = material.emission;
    diffuse.emission_texture = material.emission_texture;
    diffuse.emission_placement = material.emission_placement;
    material = diffuse;
  }
}

void AppendQuad(Vec3 corner, Vec3 edge_u, Vec3 edge_v, std::uint32_t material, Geometry& geometry) {
  const auto first = static_cast<std::uint32_t>(geometry.vertices.size());
  const auto normal = ToFloat(lightfield::Normalized(lightfield::Cross(edge_u, edge_v)));
  geometry.vertices.push_back({ToFloat(corner), normal, {0, 0}});
  geometry.vertices.push_back({ToFloat(corner + edge_u), normal, {1, 0}});
  geometry.vertices.push_back({ToFloat(corner + edge_u + edge_v), normal, {1, 1}});
  geometry.vertices.push_back({ToFloat(corner + edge_v), normal, {0, 1}});
  geometry.triangles.push_back({{first, first + 1, first + 2}, material});
  geometry.triangles.push_back({{first, first + 2, first + 3}, material});
}

void AppendBox(const Transform& world_from_cube, std::uint32_t material, Geometry& geometry) {
  const auto face = [&](Vec3 corner, Vec3 edge_u, Vec3 edge_v) {
    AppendQuad(world_from_cube.Point(corner), world_from_cube.Vector(edge_u),
               world_from_cube.Vector(edge_v), material, geometry);
  };
  constexpr double h = 0.5;
  face({h, -h, -h}, {0, 1, 0}, {0, 0, 1});
  face({-h, h, -h}, {0, -1, 0}, {0, 0, 1});
  face({h, h, -h}, {-1, 0, 0}, {0, 0, 1});
  face({-h, -h, -h}, {1, 0, 0}, {0, 0, 1});
  face({-h, -h, h}, {1, 0, 0}, {0, 1, 0});
  face({-h, h, -h}, {1, 0, 0}, {0, -1, 0});
}

}  // namespace luxfield::scene
