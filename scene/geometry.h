// What light falls on: triangles in world space, Lambertian materials, textures.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "lightfield/geometry.h"
#include "scene/transform.h"

namespace luxfield::scene {

// 8 bits per channel, sRGB encoded, red in the lowest byte; row 0 on top. Repeats in both
// directions.
struct Texture {
  std::string name;
  int width = 0, height = 0;
  std::vector<std::uint32_t> rgba;
};

// Reflects albedo / pi * irradiance. Linear Rec. 709 in [0, 1]; a texture multiplies it.
struct Material {
  std::string name;
  std::array<float, 3> albedo{0.5f, 0.5f, 0.5f};
  int texture = -1;  // index into Geometry::textures, -1: none
};

// World space, metres. A zero normal means that the triangle's own is used. uv = (0, 0) is the
// lower left of a texture.
struct Vertex {
  std::array<float, 3> position{};
  std::array<float, 3> normal{};
  std::array<float, 2> uv{};
};

struct Triangle {
  std::array<std::uint32_t, 3> vertex{};
  std::uint32_t material = 0;
};

struct Geometry {
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<Material> materials;
  std::vector<Texture> textures;

  const std::array<float, 3>& corner(std::size_t triangle, int k) const {
    return vertices[triangles[triangle].vertex[k]].position;
  }
};

// The parallelogram corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v; two
// triangles.
void AppendQuad(Vec3 corner, Vec3 edge_u, Vec3 edge_v, std::uint32_t material, Geometry& geometry);

// The axis-parallel cube [-1/2, 1/2]^3, transformed; 12 triangles.
void AppendBox(const Transform& world_from_cube, std::uint32_t material, Geometry& geometry);

}  // namespace luxfield::scene
