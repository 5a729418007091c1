// Meshes from files: OBJ, PLY, glTF 2.0 (.gltf, .glb), through assimp.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/scene/geometry.h"

namespace luxfield::scene {

// Appends the file's triangles, transformed to the world, with its vertex normals and texture
// coordinates if it has them, as often as glTF's EXT_mesh_gpu_instancing places them. glTF's
// materials are read as scene/gltf_materials.h says. Those of OBJ and PLY become Lambertian: Kd,
// clamped to [0, 1], times its texture; their Ks and Ns are seldom meant as a reflectance and are
// left out. Textures are looked up beside the mesh or taken from inside it. `material` replaces all
// materials. Lines and points are left out; polygons are triangulated. Returns in words what the
// file (glTF) asks for beside that. Throws InputError naming the file: missing, not readable,
// truncated, of another type, without triangles or with more than 1e8, with coordinates that are
// not finite or above 1e6 m, with vertex numbers out of range, a missing texture, what
// scene/gltf.h and gltf_materials.h refuse.
std::vector<std::string> AppendMesh(const std::filesystem::path& path,
                                    const Transform& world_from_mesh,
                                    std::optional<std::uint32_t> material, Geometry& geometry);

}  // namespace luxfield::scene
