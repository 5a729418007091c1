// Materials of a glTF 2.0 file.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/scene/geometry.h"
#include "luxfield/scene/gltf.h"

namespace luxfield::scene {

// A material, and which of the mesh's sets of texture coordinates (TEXCOORD_n) are set 0 and 1 of
// its textures' placements.
struct GltfMaterial {
  std::uint32_t material = 0;  // of the geometry
  std::array<std::size_t, 2> sets{0, 1};
};

// Appends the materials that are asked for, and their textures, to a geometry: metallic-roughness
// (glTF 2.0, 3.9), KHR_materials_pbrSpecularGlossiness instead of it where a material has both,
// KHR_texture_transform, and emission times KHR_materials_emissive_strength, which is in cd / m^2.
class GltfMaterials {
 public:
  GltfMaterials(const Gltf& gltf, Geometry& geometry) : gltf_(gltf), geometry_(geometry) {}

  // Without a number: glTF's default. Throws InputError naming file and material: factors that are
  // not finite, missing textures, three sets of texture coordinates.
  const GltfMaterial& Get(const std::optional<std::size_t>& index);

 private:
  struct Reading;  // of one material
  Material Read(const core::Json& source, Reading& reading);
  void ReadMetallicRoughness(const core::Json& source, Reading& reading);
  void ReadSpecularGlossiness(const core::Json& source, Reading& reading);
  void ReadTexture(const core::Json& owner, const std::string& key, Alpha alpha, Reading& reading,
                   int& texture, TexturePlacement& placement);
  int TextureIndex(std::size_t texture, Alpha alpha, const std::string& material);

  const Gltf& gltf_;
  Geometry& geometry_;
  std::map<std::optional<std::size_t>, GltfMaterial> materials_;
  std::map<std::pair<std::size_t, Alpha>, int> images_;
};

}  // namespace luxfield::scene
