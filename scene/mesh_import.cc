#include "luxfield/scene/mesh_import.h"

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/DefaultIOSystem.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <optional>
#include <string_view>

#include "luxfield/core/apart.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/kept.h"

namespace luxfield::scene {
namespace {

constexpr char kRemedy[] = "repair the mesh or export it again";
constexpr double kMemoryPerByte = 64;
// Triangulation takes time by the square of a polygon's corners, a second for these.
constexpr unsigned kMostCorners = 10000;

// What a file refers to may be a pipe or a device, whose reading never ends.
class RegularFiles : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* file) const override {
    std::error_code error;
    return std::filesystem::is_regular_file(file, error);
  }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return Exists(file) ? Assimp::DefaultIOSystem::Open(file, mode) : nullptr;
  }
};

// A binary PLY file whose data begin with a byte that ends a line: behind a header whose lines end
// in \n alone, assimp takes that byte for the header's. All of it then, with a header of \r\n.
std::optional<std::string> PlyWithClearEnd(const std::filesystem::path& path) {
  constexpr std::size_t kLongestHeader = 1 << 20;
  constexpr std::string_view kEnd = "\nend_header\n";
  if (core::ReadStart(path, 4) != "ply\n") return {};
  const std::string start = core::ReadStart(path, kLongestHeader);
  const std::size_t end = start.find(kEnd), data = end + kEnd.size();
  if (end == start.npos || data >= start.size()) return {};
  if (start[data] != '\n' && start[data] != '\r') return {};
  if (start.substr(0, end).find("\nformat ascii") != start.npos) return {};
  std::string bytes;
  for (const char c : start.substr(0, data))
    bytes += c == '\n' ? std::string("\r\n") : std::string{c};
  return bytes += core::ReadFile(path).substr(data);
}

// Before assimp's own steps run: they assert, and end the process, on faces that make no sense.
void CheckFaces(const std::filesystem::path& path, const aiScene& source) {
  const auto fail = [&](const std::string& problem) {
    throw InputError(path.string(), problem, kRemedy);
  };
  for (unsigned m = 0; m < source.mNumMeshes; ++m) {
    const aiMesh& mesh = *source.mMeshes[m];
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices == 0) fail(fmt::format("face {} has no vertices, or is cut off", i));
      if (face.mNumIndices > kMostCorners)
        fail(fmt::format("face {} has {} corners; {} are read at most", i, face.mNumIndices,
                         kMostCorners));
      for (unsigned k = 0; k < face.mNumIndices; ++k)
        if (face.mIndices[k] >= mesh.mNumVertices)
          fail(fmt::format("face {} refers to vertex {} of {}", i, face.mIndices[k],
                           mesh.mNumVertices));
    }
  }
}

Transform FromAssimp(const aiMatrix4x4& m) {
  return {{{{m.a1, m.a2, m.a3}, {m.b1, m.b2, m.b3}, {m.c1, m.c2, m.c3}}}, {m.a4, m.b4, m.c4}};
}

std::vector<std::array<float, 3>> FromAssimp(const aiVector3D* values, unsigned count) {
  std::vector<std::array<float, 3>> out(values ? count : 0);
  for (unsigned i = 0; i < out.size(); ++i) out[i] = {values[i].x, values[i].y, values[i].z};
  return out;
}

ImportedMesh FromAssimp(const aiMesh& source) {
  ImportedMesh mesh;
  mesh.material = source.mMaterialIndex;
  if (!(source.mPrimitiveTypes & aiPrimitiveType_TRIANGLE)) return mesh;
  mesh.positions = FromAssimp(source.mVertices, source.mNumVertices);
  mesh.normals = FromAssimp(source.mNormals, source.mNumVertices);
  for (unsigned set = 0; set < ImportedMesh::kSets; ++set) {
    if (!source.HasTextureCoords(set)) continue;
    mesh.uv[set].resize(source.mNumVertices);
    for (unsigned i = 0; i < source.mNumVertices; ++i) {
      const aiVector3D& uv = source.mTextureCoords[set][i];
      mesh.uv[set][i] = {uv.x, uv.y};
    }
  }
  for (unsigned i = 0; i < source.mNumFaces; ++i)
    if (const aiFace& face = source.mFaces[i]; face.mNumIndices == 3)
      mesh.triangles.push_back({face.mIndices[0], face.mIndices[1], face.mIndices[2]});
  return mesh;
}

ImportedMaterial FromAssimp(const aiMaterial& source) {
  ImportedMaterial material;
  material.name = source.GetName().C_Str();
  aiColor4D colour(0.5f, 0.5f, 0.5f, 1);
  source.Get(AI_MATKEY_COLOR_DIFFUSE, colour);
  material.diffuse = {colour.r, colour.g, colour.b};
  if (aiString reference; source.GetTexture(aiTextureType_DIFFUSE, 0, &reference) == AI_SUCCESS)
    material.texture = reference.C_Str();
  return material;
}

void AppendNodes(const aiNode& source, std::int64_t parent, std::vector<ImportedNode>& nodes) {
  const auto own = static_cast<std::int64_t>(nodes.size());
  nodes.push_back({parent,
                   FromAssimp(source.mTransformation),
                   {source.mMeshes, source.mMeshes + source.mNumMeshes}});
  for (unsigned i = 0; i < source.mNumChildren; ++i) AppendNodes(*source.mChildren[i], own, nodes);
}

// One order of the fields for both ends of the pipe, and for the cache.
template <typename Stream, typename Mesh>
void MeshFields(Stream& stream, Mesh& mesh) {
  stream(mesh.positions, mesh.normals, mesh.triangles, mesh.material);
  for (auto& set : mesh.uv) stream(set);
}
template <typename Stream, typename Node>
void NodeFields(Stream& stream, Node& node) {
  stream(node.parent, node.parent_from_node, node.meshes);
}
template <typename Stream, typename Material>
void MaterialFields(Stream& stream, Material& material) {
  stream(material.name, material.diffuse, material.texture);
}

void Read(const std::filesystem::path& path, bool polygons, core::ApartWriter& writer) {
  Assimp::Importer importer;
  importer.SetIOHandler(new RegularFiles);  // the importer's from now on
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* source = nullptr;
  std::string reason;
  try {
    const auto ply = PlyWithClearEnd(path);
    source = ply ? importer.ReadFileFromMemory(ply->data(), ply->size(), 0, "ply")
                 : importer.ReadFile(path.string(), 0);
    if (source) CheckFaces(path, *source);
    if (source && polygons)
      source = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType);
    if (!source) reason = importer.GetErrorString();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (!source || !source->mRootNode)
    throw InputError(path.string(), fmt::format("the mesh cannot be read ({})", reason), kRemedy);

  writer(std::uint64_t{source->mNumMeshes});
  for (unsigned m = 0; m < source->mNumMeshes; ++m) {
    const ImportedMesh mesh = FromAssimp(*source->mMeshes[m]);
    MeshFields(writer, mesh);
  }
  std::vector<ImportedNode> nodes;
  AppendNodes(*source->mRootNode, -1, nodes);
  writer(std::uint64_t{nodes.size()});
  for (const ImportedNode& node : nodes) NodeFields(writer, node);
  writer(std::uint64_t{source->mNumMaterials});
  for (unsigned m = 0; m < source->mNumMaterials; ++m) {
    const ImportedMaterial material = FromAssimp(*source->mMaterials[m]);
    MaterialFields(writer, material);
  }
}

// Of a process that may have been damaged before it answered.
void Check(const ImportedScene& scene, const std::string& file) {
  const auto require = [&](bool holds, const char* problem) {
    if (!holds) throw InputError(file, problem, kRemedy);
  };
  for (const ImportedMesh& mesh : scene.meshes) {
    const std::size_t vertices = mesh.positions.size();
    require(mesh.normals.empty() || mesh.normals.size() == vertices,
            "has more normals than vertices, or fewer");
    for (const auto& set : mesh.uv)
      require(set.empty() || set.size() == vertices,
              "has more texture coordinates than vertices, or fewer");
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t corner : triangle)
        require(corner < vertices, "refers to a vertex that it does not contain");
    require(mesh.triangles.empty() || mesh.material < scene.materials.size(),
            "refers to a material that it does not contain");
  }
  require(!scene.nodes.empty(), "has no node");
  for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
    const std::int64_t parent = scene.nodes[i].parent;
    require(i == 0 ? parent == -1 : parent >= 0 && parent < static_cast<std::int64_t>(i),
            "has a node that is not within its tree");
    for (const std::uint32_t mesh : scene.nodes[i].meshes)
      require(mesh < scene.meshes.size(), "refers to a mesh that it does not contain");
  }
}

}  // namespace

namespace {

ImportedScene Import(const std::filesystem::path& path, bool polygons, std::uintmax_t bytes) {
  ImportedScene scene;
  const auto take = [&](core::ApartReader& reader) {
    for (auto count = reader.Value<std::uint64_t>(); count > 0; --count)
      MeshFields(reader, scene.meshes.emplace_back());
    for (auto count = reader.Value<std::uint64_t>(); count > 0; --count)
      NodeFields(reader, scene.nodes.emplace_back());
    for (auto count = reader.Value<std::uint64_t>(); count > 0; --count)
      MaterialFields(reader, scene.materials.emplace_back());
  };
  core::ReadApart(
      path.string(), kRemedy, core::ApartLimitsOf(bytes, kMemoryPerByte),
      [&](core::ApartWriter& writer) { Read(path, polygons, writer); }, take);
  return scene;
}

// A number of elements, and the elements; the same for writers and readers.
template <typename Stream, typename Element, typename Fields>
void ListFields(Stream& stream, std::vector<Element>& list, const Fields& fields) {
  std::uint64_t count = list.size();
  stream(count);
  list.resize(count);
  for (Element& element : list) fields(element);
}

// The file is known by its bytes where it stands alone.
bool StandsAlone(const std::filesystem::path& path, std::uintmax_t bytes) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending != ".obj" && bytes == std::filesystem::file_size(path);
}

}  // namespace

ImportedScene ImportMesh(const std::filesystem::path& path, bool polygons, std::uintmax_t bytes) {
  std::optional<core::CacheKey> key;
  if (StandsAlone(path, bytes))
    key = core::KeyOfThisBuild("mesh", fmt::format("{}\n{}\n{}", path.extension().string(),
                                                   core::Sha256OfFile(path), polygons));
  const auto transfer = [](auto& pass, auto& scene) {
    ListFields(pass, scene.meshes, [&](auto& mesh) { MeshFields(pass, mesh); });
    ListFields(pass, scene.nodes, [&](auto& node) { NodeFields(pass, node); });
    ListFields(pass, scene.materials, [&](auto& material) { MaterialFields(pass, material); });
  };
  ImportedScene scene =
      core::Kept(key, transfer, ImportedScene(), [&] { return Import(path, polygons, bytes); });
  Check(scene, path.string());
  return scene;
}

}  // namespace luxfield::scene
