// What assimp makes of a mesh file, as plain arrays. It reads the file in a process of its own
// (core/apart.h): there are files that bring it down or keep it busy for good.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/scene/transform.h"

namespace luxfield::scene {

struct ImportedMesh {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;  // empty: the file has none
  // Sets of texture coordinates, v upwards; each is empty or has one for each vertex.
  static constexpr std::size_t kSets = 8;
  std::array<std::vector<std::array<float, 2>>, kSets> uv;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::uint32_t material = 0;
};

struct ImportedNode {
  std::int64_t parent = -1;  // comes before it; -1: the root, which is the first
  Transform parent_from_node;
  std::vector<std::uint32_t> meshes;
};

struct ImportedMaterial {
  std::string name;
  std::array<float, 3> diffuse{};
  std::string texture;  // as the file names it; empty: none
};

struct ImportedScene {
  std::vector<ImportedMesh> meshes;
  std::vector<ImportedNode> nodes;  // one at least; children after their parents, in their order
  std::vector<ImportedMaterial> materials;
};

// Polygons of up to 10000 corners become triangles where `polygons`; where not, meshes stay as the
// file numbers them. `bytes` is the length of the file and of those that it refers to, by which
// time and memory are bounded. Every number of a vertex, mesh, material or node refers to one that
// is there. Throws InputError naming the file, DeviceError, Interrupted.
ImportedScene ImportMesh(const std::filesystem::path& path, bool polygons, std::uintmax_t bytes);

}  // namespace luxfield::scene
