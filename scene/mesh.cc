#include "scene/mesh.h"

#include <assimp/GltfMaterial.h>
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
#include "scene/texture.h"

namespace luxfield::scene {
namespace {

constexpr float kLargest_m = 1e6f;  // float32 resolves 6 cm there
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

bool IsIdentity(const aiUVTransform& transform) {
  constexpr float kTolerance = 1e-6f;  // the reader moves the origin from corner to centre
  return std::abs(transform.mScaling.x - 1) < kTolerance &&
         std::abs(transform.mScaling.y - 1) < kTolerance &&
         std::abs(transform.mRotation) < kTolerance &&
         std::abs(transform.mTranslation.x) < kTolerance &&
         std::abs(transform.mTranslation.y) < kTolerance;
}

// Copies one assimp scene into a Geometry.
class MeshAppender {
 public:
  MeshAppender(const std::filesystem::path& path, const aiScene& source,
               std::optional<std::uint32_t> material, Geometry& geometry)
      : path_(path), source_(source), override_(material), geometry_(geometry) {}

  void AppendNode(const aiNode& node, const Transform& world_from_parent) {
    const Transform world_from_node = world_from_parent * FromAssimp(node.mTransformation);
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      if (node.mMeshes[i] >= source_.mNumMeshes) Fail("refers to a mesh that it does not contain");
      AppendMeshPart(*source_.mMeshes[node.mMeshes[i]], world_from_node);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i)
      AppendNode(*node.mChildren[i], world_from_node);
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) const {
    throw InputError(path_.string(), problem, kRemedy);
  }

  void AppendMeshPart(const aiMesh& mesh, const Transform& world_from_mesh) {
    if (!(mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE)) return;
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
      if (mesh.HasTextureCoords(0)) {
        const aiVector3D& uv = mesh.mTextureCoords[0][i];
        if (!std::isfinite(uv.x) || !std::isfinite(uv.y))
          Fail(fmt::format("texture coordinate of vertex {} is not finite", i));
        vertex.uv = {uv.x, uv.y};
      }
      geometry_.vertices.push_back(vertex);
    }
    const std::uint32_t material = MaterialOf(mesh);
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;
      geometry_.triangles.push_back(
          {{first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]},
           material});
    }
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
    if (source.Get(AI_MATKEY_BASE_COLOR, colour) != AI_SUCCESS)
      source.Get(AI_MATKEY_COLOR_DIFFUSE, colour);
    for (int c = 0; c < 3; ++c)
      material.albedo[c] = Reflectance(colour[c], "colour", material.name);
    material.texture = TextureOf(source, material.name, aiTextureType_BASE_COLOR);
    if (material.texture < 0)
      material.texture = TextureOf(source, material.name, aiTextureType_DIFFUSE);
    // Only the glTF reader sets it, for every material.
    float metallic = 0;
    if (source.Get(AI_MATKEY_METALLIC_FACTOR, metallic) != AI_SUCCESS) return material;
    float unused = 0;
    if (source.Get(AI_MATKEY_GLOSSINESS_FACTOR, unused) == AI_SUCCESS)
      Fail(
          fmt::format("material '{}' uses KHR_materials_pbrSpecularGlossiness, which is not read; "
                      "only metallic-roughness is",
                      material.name));
    material.kind = MaterialKind::kGgx;
    source.Get(AI_MATKEY_ROUGHNESS_FACTOR, material.roughness);
    material.metallic = Reflectance(metallic, "metallicFactor", material.name);
    material.roughness = Reflectance(material.roughness, "roughnessFactor", material.name);
    material.metallic_roughness_texture =
        TextureOf(source, material.name, aiTextureType_DIFFUSE_ROUGHNESS);
    material.normal_texture = TextureOf(source, material.name, aiTextureType_NORMALS);
    source.Get(AI_MATKEY_GLTF_TEXTURE_SCALE(aiTextureType_NORMALS, 0), material.normal_scale);
    if (!std::isfinite(material.normal_scale))
      Fail(fmt::format("the normal scale of material '{}' is not finite", material.name));
    return material;
  }

  float Reflectance(float value, const char* what, const std::string& material) const {
    if (!std::isfinite(value))
      Fail(fmt::format("the {} of material '{}' is not finite", what, material));
    return std::clamp(value, 0.0f, 1.0f);
  }

  // Its number in the geometry, -1 if the material has none of that type.
  int TextureOf(const aiMaterial& source, const std::string& material, aiTextureType type) {
    aiString reference;
    if (source.GetTexture(type, 0, &reference) != AI_SUCCESS) return -1;
    int coordinates = 0;
    source.Get(AI_MATKEY_UVWSRC(type, 0), coordinates);
    if (coordinates != 0)
      Fail(fmt::format("a texture of material '{}' uses TEXCOORD_{}; only TEXCOORD_0 is read",
                       material, coordinates));
    aiUVTransform transform;
    if (source.Get(AI_MATKEY_UVTRANSFORM(type, 0), transform) == AI_SUCCESS &&
        !IsIdentity(transform))
      Fail(
          fmt::format("a texture of material '{}' is transformed (KHR_texture_transform), which is "
                      "not read; bake the transform into the texture coordinates",
                      material));
    return TextureIndex(reference.C_Str());
  }

  int TextureIndex(const std::string& reference) {
    const auto [entry, is_new] =
        textures_.try_emplace(reference, static_cast<int>(geometry_.textures.size()));
    if (is_new) geometry_.textures.push_back(LoadTexture(reference));
    return entry->second;
  }

  Texture LoadTexture(const std::string& reference) const {
    const aiTexture* embedded = source_.GetEmbeddedTexture(reference.c_str());
    if (!embedded) {
      std::string relative = reference;
      std::replace(relative.begin(), relative.end(), '\\', '/');
      return ReadTexture(path_.parent_path() / relative);
    }
    const std::string name = fmt::format("{}, texture {}", path_.string(), reference);
    const auto* bytes = reinterpret_cast<const unsigned char*>(embedded->pcData);
    if (embedded->mHeight == 0) return DecodeTexture({bytes, embedded->mWidth}, name);
    Texture texture{
        name, static_cast<int>(embedded->mWidth), static_cast<int>(embedded->mHeight), {}};
    const std::size_t count = static_cast<std::size_t>(embedded->mWidth) * embedded->mHeight;
    texture.rgba.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const aiTexel& texel = embedded->pcData[i];
      texture.rgba.push_back(0xFF000000u | (std::uint32_t{texel.b} << 16) |
                             (std::uint32_t{texel.g} << 8) | texel.r);
    }
    return texture;
  }

  const std::filesystem::path& path_;
  const aiScene& source_;
  std::optional<std::uint32_t> override_;
  Geometry& geometry_;
  std::map<unsigned, std::uint32_t> materials_;  // of the file -> of the geometry
  std::map<std::string, int> textures_;
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

void AppendMesh(const std::filesystem::path& path, const Transform& world_from_mesh,
                std::optional<std::uint32_t> material, Geometry& geometry) {
  CheckReadable(path);
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* source = nullptr;
  std::string reason;
  try {
    source = importer.ReadFile(path.string(), 0);
    if (source) {
      CheckFaces(path, *source);
      source = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType);
    }
    if (!source) reason = importer.GetErrorString();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (!source || !source->mRootNode)
    throw InputError(path.string(), fmt::format("the mesh cannot be read ({})", reason), kRemedy);
  const std::size_t before = geometry.triangles.size();
  MeshAppender(path, *source, material, geometry).AppendNode(*source->mRootNode, world_from_mesh);
  if (geometry.triangles.size() == before)
    throw InputError(path.string(), "the mesh holds no triangle", kRemedy);
}

}  // namespace luxfield::scene
