// Meshes from files: OBJ, PLY, glTF 2.0 (.gltf, .glb), through assimp.
#pragma once

#include <filesystem>
#include <optional>

#include "scene/geometry.h"

namespace luxfield::scene {

// Appends the file's triangles, transformed to the world, with its vertex normals and texture
// coordinates if it has them. Its materials become Lambertian: base colour (glTF) or Kd (OBJ),
// clamped to [0, 1], times the base colour texture, which is looked up beside the mesh or taken
// from inside it. `material` replaces them all. Lines and points are left out; polygons are
// triangulated. Throws InputError naming the file: missing, not readable, truncated, of another
// type, without triangles, with coordinates that are not finite or above 1e6 m, with vertex numbers
// out of range, a missing texture.
void AppendMesh(const std::filesystem::path& path, const Transform& world_from_mesh,
                std::optional<std::uint32_t> material, Geometry& geometry);

}  // namespace luxfield::scene
