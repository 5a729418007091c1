// What light falls on: triangles in world space, materials, textures.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "luxfield/lightfield/geometry.h"
#include "luxfield/scene/transform.h"

namespace luxfield::scene {

// 8 bits per channel, red in the lowest byte, alpha in the highest; row 0 on top. Repeats in both
// directions. Colours are sRGB encoded; metal, roughness, glossiness and normals are linear
// (Material says which is which).
struct Texture {
  std::string name;
  int width = 0, height = 0;
  std::vector<std::uint32_t> rgba;
};

// lambert: albedo / pi. phong: besides it a lobe about the mirrored direction that reflects at most
// `specular` (Lafortune and Willems 1994). ggx: metallic-roughness as glTF 2.0, appendix B, defines
// it. specular-glossiness: the same lobe and diffuse part, with the reflectances of glTF's
// extension KHR_materials_pbrSpecularGlossiness. The formulas are in render/kernels/brdf/brdf.clh.
enum class MaterialKind { kLambert, kPhong, kGgx, kSpecularGlossiness };

// Which of a vertex's texture coordinates a texture is looked up with, and where:
//   (row 0) . (u, v, 1), (row 1) . (u, v, 1)
struct TexturePlacement {
  int set = 0;  // 0: Vertex::uv, 1: Vertex::uv1
  std::array<std::array<float, 3>, 2> rows{{{1, 0, 0}, {0, 1, 0}}};
};

// Colours are linear Rec. 709 in [0, 1]. Textures are indices into Geometry::textures, -1: none.
struct Material {
  std::string name;
  // Base colour of ggx; of specular-glossiness the diffuse colour, of which 1 - max(specular) is
  // reflected.
  std::array<float, 3> albedo{0.5f, 0.5f, 0.5f};
  int texture = -1;  // multiplies albedo; sRGB
  MaterialKind kind = MaterialKind::kLambert;
  // phong: albedo + specular <= 1 in each channel. specular-glossiness: reflectance at normal
  // incidence.
  std::array<float, 3> specular{};
  float exponent = 0;                    // phong, of cosines; >= 0
  float metallic = 0, roughness = 1;     // ggx, in [0, 1]; alpha = roughness^2
  float glossiness = 1;                  // specular-glossiness, in [0, 1]; alpha = (1 - it)^2
  int metallic_roughness_texture = -1;   // ggx: blue multiplies metallic, green roughness; linear
  int specular_glossiness_texture = -1;  // its colour multiplies specular, sRGB, alpha glossiness
  int normal_texture = -1;               // tangent space, linear: x along u, y along v, z outwards
  float normal_scale = 1;                // multiplies x and y of the normal texture
  // Radiance that the surface sends out by itself on both sides, in the luminaires' unit per sr and
  // m^2; >= 0. The camera sees it; it lights nothing.
  std::array<float, 3> emission{};
  int emission_texture = -1;  // multiplies emission; sRGB
  TexturePlacement texture_placement{}, gloss_placement{}, normal_placement{}, emission_placement{};
};

inline bool IsEmissive(const Material& material) {
  return material.emission != std::array<float, 3>{};
}

// True if what the surface shows depends on where it is seen from.
inline bool IsGlossy(const Material& material) { return material.kind != MaterialKind::kLambert; }

// World space, metres. A zero normal means that the triangle's own is used. uv = (0, 0) is the
// lower left of a texture; uv1 is a second set of coordinates, for textures that are placed by it.
struct Vertex {
  std::array<float, 3> position{};
  std::array<float, 3> normal{};
  std::array<float, 2> uv{};
  std::array<float, 2> uv1{};
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

// Every material becomes Lambertian with its base colour and texture, and keeps its emission: what
// estimators for Lambertian surfaces alone, and comparisons with them, are shown.
void MakeLambertian(Geometry& geometry);

// The parallelogram corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v; two
// triangles.
void AppendQuad(Vec3 corner, Vec3 edge_u, Vec3 edge_v, std::uint32_t material, Geometry& geometry);

// The axis-parallel cube [-1/2, 1/2]^3, transformed; 12 triangles.
void AppendBox(const Transform& world_from_cube, std::uint32_t material, Geometry& geometry);

}  // namespace luxfield::scene
