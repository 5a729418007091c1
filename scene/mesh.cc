#include "scene/mesh.h"

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/file.h"
#include "scene/gltf.h"
#include "scene/gltf_materials.h"
#include "scene/texture.h"

namespace luxfield::scene {
namespace {

constexpr float kLargest_m = 1e6f;  // float32 resolves 6 cm there
constexpr std::size_t kMostTriangles = 100000000;
constexpr char kRemedy[] = "repair the mesh or export it again";

Transform FromAssimp(const aiMatrix4x4& m) {
  return {{{{m.a1, m.a2, m.a3}, {m.b1, m.b2, m.b3}, {m.c1, m.c2, m.c3}}}, {m.a4, m.b4, m.c4}};
}

std::array<float, 3> ToFloat(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

bool IsNear(const std::array<float, 3>& v) {
  return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}) <= kLargest_m;
}

bool IsFinite(const std::array<float, 3>& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

Vec3 FromAssimp(const aiVector3D& v) { return {v.x, v.y, v.z}; }

// Before assimp's own steps run: they assert, and end the process, on faces that make no sense.
void CheckFaces(const std::filesystem::path& path, const aiScene& source) {
  for (unsigned m = 0; m < source.mNumMeshes; ++m) {
    const aiMesh& mesh = *source.mMeshes[m];
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices == 0)
        throw InputError(path.string(), fmt::format("face {} has no vertices, or is cut off", i),
                         kRemedy);
      for (unsigned k = 0; k < face.mNumIndices; ++k)
        if (face.mIndices[k] >= mesh.mNumVertices)
          throw InputError(path.string(),
                           fmt::format("face {} refers to vertex {} of {}", i, face.mIndices[k],
                                       mesh.mNumVertices),
                           kRemedy);
    }
  }
}

// Copies one assimp scene into a Geometry. Of a glTF file the tree of nodes, the instances and the
// materials are the file's own: assimp's meshes are its primitives in order.
class MeshAppender {
 public:
  MeshAppender(const std::filesystem::path& path, const aiScene& source, const Gltf* gltf,
               std::optional<std::uint32_t> material, Geometry& geometry)
      : path_(path), source_(source), gltf_(gltf), override_(material), geometry_(geometry) {
    if (gltf) gltf_materials_.emplace(*gltf, geometry);
  }

  void Append(const Transform& world_from_mesh) {
    const aiNode& root = *source_.mRootNode;
    if (!gltf_) return AppendNode(root, world_from_mesh);
    const std::vector<std::size_t> roots = gltf_->RootNodes();
    if (roots.size() == 1) return AppendGltfNode(root, roots[0], world_from_mesh);
    Match(root.mNumChildren, roots.size(), "root nodes");
    for (unsigned i = 0; i < root.mNumChildren; ++i)
      AppendGltfNode(*root.mChildren[i], roots[i], world_from_mesh);
  }

 private:
  // Of a vertex's two sets; one may be empty.
  using TextureCoordinates = std::array<std::vector<std::array<float, 2>>, 2>;

  [[noreturn]] void Fail(const std::string& problem) const {
    throw InputError(path_.string(), problem, kRemedy);
  }

  void Match(std::size_t read, std::size_t own, const char* what) const {
    if (read != own) Fail(fmt::format("has {} {}, of which {} can be read", own, what, read));
  }

  const aiMesh& MeshOf(const aiNode& node, unsigned i) const {
    if (node.mMeshes[i] >= source_.mNumMeshes) Fail("refers to a mesh that it does not contain");
    return *source_.mMeshes[node.mMeshes[i]];
  }

  void AppendNode(const aiNode& node, const Transform& world_from_parent) {
    const Transform world_from_node = world_from_parent * FromAssimp(node.mTransformation);
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = MeshOf(node, i);
      if (HasTriangles(mesh)) AppendTriangles(mesh, world_from_node, MaterialOf(mesh), {0, 1});
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i)
      AppendNode(*node.mChildren[i], world_from_node);
  }

  void AppendGltfNode(const aiNode& node, std::size_t number, const Transform& world_from_parent) {
    const core::Json& own = gltf_->Element("nodes", number);
    const Transform world_from_node = world_from_parent * FromAssimp(node.mTransformation);
    if (own.contains("mesh")) {
      const auto mesh = core::Field<std::size_t>(own, "mesh", gltf_->file());
      const auto primitives = core::Field<std::vector<core::Json>>(gltf_->Element("meshes", mesh),
                                                                   "primitives", gltf_->file());
      Match(node.mNumMeshes, primitives.size(), "primitives in a mesh");
      const std::vector<Transform> instances = gltf_->Instances(own);
      for (unsigned i = 0; i < node.mNumMeshes; ++i)
        AppendPrimitive(MeshOf(node, i), primitives[i], world_from_node, instances);
    }
    const auto children = Gltf::Children(own, gltf_->file());
    Match(node.mNumChildren, children.size(), "nodes below one");
    for (unsigned i = 0; i < node.mNumChildren; ++i)
      AppendGltfNode(*node.mChildren[i], children[i], world_from_node);
  }

  void AppendPrimitive(const aiMesh& mesh, const core::Json& primitive,
                       const Transform& world_from_node, const std::vector<Transform>& instances) {
    if (!HasTriangles(mesh)) return;
    GltfMaterial material;
    if (override_) {
      material.material = *override_;
    } else {
      std::optional<std::size_t> number;
      if (primitive.contains("material"))
        number = core::Field<std::size_t>(primitive, "material", gltf_->file());
      material = gltf_materials_->Get(number);
    }
    if (instances.size() > kMostTriangles / mesh.mNumFaces)
      Fail(fmt::format("places {} triangles {} times; {} are read at most", mesh.mNumFaces,
                       instances.size(), kMostTriangles));
    const TextureCoordinates uv{IntegerCoordinates(mesh, primitive, material.sets[0]),
                                IntegerCoordinates(mesh, primitive, material.sets[1])};
    for (const Transform& node_from_instance : instances)
      AppendTriangles(mesh, world_from_node * node_from_instance, material.material, material.sets,
                      uv);
  }

  // Set `set` of a primitive's texture coordinates, v upwards, where they are integers, which
  // assimp takes for floats; empty where they are not.
  std::vector<std::array<float, 2>> IntegerCoordinates(const aiMesh& mesh,
                                                       const core::Json& primitive,
                                                       std::size_t set) const {
    constexpr int kFloat = 5126;
    const core::Json attributes =
        FieldOr<core::Json>(primitive, "attributes", core::Json::object(), gltf_->file());
    const std::string name = fmt::format("TEXCOORD_{}", set);
    if (!attributes.contains(name) || Extension(primitive, "KHR_draco_mesh_compression")) return {};
    const auto accessor = core::Field<std::size_t>(attributes, name, gltf_->file());
    if (core::Field<int>(gltf_->Element("accessors", accessor), "componentType", gltf_->file()) ==
        kFloat)
      return {};
    std::vector<std::array<float, 2>> uv;
    for (const auto& value : gltf_->Values(accessor, 2))
      uv.push_back({static_cast<float>(value[0]), static_cast<float>(1 - value[1])});
    Match(mesh.mNumVertices, uv.size(), "texture coordinates");
    return uv;
  }

  static bool HasTriangles(const aiMesh& mesh) {
    return (mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) && mesh.mNumFaces > 0;
  }

  // `sets` of the mesh's texture coordinates become a vertex's uv and uv1, or those that are given.
  void AppendTriangles(const aiMesh& mesh, const Transform& world_from_mesh, std::uint32_t material,
                       const std::array<std::size_t, 2>& sets,
                       const TextureCoordinates& given = {}) {
    if (geometry_.triangles.size() + mesh.mNumFaces > kMostTriangles)
      Fail(fmt::format("brings the scene to more than {} triangles", kMostTriangles));
    const auto first = static_cast<std::uint32_t>(geometry_.vertices.size());
    const bool normals_transform = std::abs(world_from_mesh.Determinant()) > 0;
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      Vertex vertex;
      vertex.position = ToFloat(world_from_mesh.Point(FromAssimp(mesh.mVertices[i])));
      if (!IsFinite(vertex.position))
        Fail(fmt::format("vertex {} has a coordinate that is not finite", i));
      if (!IsNear(vertex.position))
        Fail(fmt::format("vertex {} lies more than {} m from the origin", i, kLargest_m));
      if (mesh.HasNormals() && normals_transform) {
        const auto normal = ToFloat(world_from_mesh.Normal(FromAssimp(mesh.mNormals[i])));
        if (IsFinite(normal)) vertex.normal = normal;  // else (zero in the file) the triangle's own
      }
      vertex.uv = given[0].empty() ? TextureCoordinate(mesh, sets[0], i) : given[0][i];
      vertex.uv1 = given[1].empty() ? TextureCoordinate(mesh, sets[1], i) : given[1][i];
      geometry_.vertices.push_back(vertex);
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;
      geometry_.triangles.push_back(
          {{first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]},
           material});
    }
  }

  // Zeros if the mesh has no such set.
  std::array<float, 2> TextureCoordinate(const aiMesh& mesh, std::size_t set,
                                         unsigned vertex) const {
    if (set >= AI_MAX_NUMBER_OF_TEXTURECOORDS || !mesh.HasTextureCoords(static_cast<unsigned>(set)))
      return {};
    const aiVector3D& uv = mesh.mTextureCoords[set][vertex];
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y))
      Fail(fmt::format("texture coordinate of vertex {} is not finite", vertex));
    return {uv.x, uv.y};
  }

  std::uint32_t MaterialOf(const aiMesh& mesh) {
    if (override_) return *override_;
    if (mesh.mMaterialIndex >= source_.mNumMaterials)
      Fail("refers to a material that it does not contain");
    const auto [entry, is_new] = materials_.try_emplace(mesh.mMaterialIndex, 0);
    if (is_new) {
      Material material = ConvertMaterial(*source_.mMaterials[mesh.mMaterialIndex]);
      entry->second = static_cast<std::uint32_t>(geometry_.materials.size());
      geometry_.materials.push_back(std::move(material));
    }
    return entry->second;
  }

  Material ConvertMaterial(const aiMaterial& source) {
    Material material;
    material.name = source.GetName().C_Str();
    aiColor4D colour(0.5f, 0.5f, 0.5f, 1);
    source.Get(AI_MATKEY_COLOR_DIFFUSE, colour);
    for (int c = 0; c < 3; ++c) {
      if (!std::isfinite(colour[c]))
        Fail(fmt::format("the colour of material '{}' is not finite", material.name));
      material.albedo[c] = std::clamp(colour[c], 0.0f, 1.0f);
    }
    aiString reference;
    if (source.GetTexture(aiTextureType_DIFFUSE, 0, &reference) == AI_SUCCESS)
      material.texture = TextureIndex(reference.C_Str());
    return material;
  }

  int TextureIndex(const std::string& reference) {
    const auto [entry, is_new] =
        textures_.try_emplace(reference, static_cast<int>(geometry_.textures.size()));
    if (is_new) geometry_.textures.push_back(LoadTexture(reference));
    return entry->second;
  }

  Texture LoadTexture(std::string reference) const {
    std::replace(reference.begin(), reference.end(), '\\', '/');
    return ReadTexture(path_.parent_path() / reference);
  }

  const std::filesystem::path& path_;
  const aiScene& source_;
  const Gltf* gltf_;  // null: no glTF file
  std::optional<std::uint32_t> override_;
  Geometry& geometry_;
  std::map<unsigned, std::uint32_t> materials_;  // of the file -> of the geometry
  std::map<std::string, int> textures_;
  std::optional<GltfMaterials> gltf_materials_;
};

void CheckReadable(const std::filesystem::path& path) {
  static constexpr const char* kExtensions[] = {".obj", ".ply", ".gltf", ".glb"};
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (std::find(std::begin(kExtensions), std::end(kExtensions), extension) == std::end(kExtensions))
    throw InputError(path.string(), fmt::format("meshes of type '{}' are not read", extension),
                     "use .obj, .ply, .gltf or .glb");
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw InputError(path.string(), "there is no such mesh file", "correct the path");
}

}  // namespace

std::vector<std::string> AppendMesh(const std::filesystem::path& path,
                                    const Transform& world_from_mesh,
                                    std::optional<std::uint32_t> material, Geometry& geometry) {
  CheckReadable(path);
  std::optional<Gltf> gltf;
  if (Gltf::Is(path)) gltf.emplace(path);
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* source = nullptr;
  std::string reason;
  try {
    source = importer.ReadFile(path.string(), 0);
    if (source) CheckFaces(path, *source);
    // glTF has no polygons, and its primitives must stay as they are numbered.
    if (source && !gltf)
      source = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType);
    if (!source) reason = importer.GetErrorString();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (!source || !source->mRootNode)
    throw InputError(path.string(), fmt::format("the mesh cannot be read ({})", reason), kRemedy);
  const std::size_t before = geometry.triangles.size();
  MeshAppender(path, *source, gltf ? &*gltf : nullptr, material, geometry).Append(world_from_mesh);
  if (geometry.triangles.size() == before)
    throw InputError(path.string(), "the mesh holds no triangle", kRemedy);
  return gltf ? gltf->LeftOut(!material) : std::vector<std::string>();
}

}  // namespace luxfield::scene
