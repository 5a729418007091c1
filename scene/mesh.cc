#include "luxfield/scene/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/input_file.h"
#include "luxfield/scene/gltf.h"
#include "luxfield/scene/gltf_materials.h"
#include "luxfield/scene/mesh_import.h"
#include "luxfield/scene/texture.h"

namespace luxfield::scene {
namespace {

constexpr float kLargest_m = 1e6f;  // float32 resolves 6 cm there
constexpr std::size_t kMostTriangles = 100000000;
constexpr char kRemedy[] = "repair the mesh or export it again";

Vec3 ToVec3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

std::array<float, 3> ToFloat(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

bool IsNear(const std::array<float, 3>& v) {
  return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}) <= kLargest_m;
}

bool IsFinite(const std::array<float, 3>& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

// Copies what was imported into a Geometry. Of a glTF file the tree of nodes, the instances and the
// materials are the file's own: the imported meshes are its primitives in order.
class MeshAppender {
 public:
  MeshAppender(const std::filesystem::path& path, const ImportedScene& source, const Gltf* gltf,
               std::optional<std::uint32_t> material, Geometry& geometry)
      : path_(path), source_(source), gltf_(gltf), override_(material), geometry_(geometry) {
    if (gltf) gltf_materials_.emplace(*gltf, geometry);
  }

  void Append(const Transform& world_from_mesh) {
    if (!gltf_) return AppendNodes(world_from_mesh);
    children_.resize(source_.nodes.size());
    for (std::size_t i = 1; i < source_.nodes.size(); ++i)
      children_[static_cast<std::size_t>(source_.nodes[i].parent)].push_back(i);
    const std::vector<std::size_t> roots = gltf_->RootNodes();
    if (roots.size() == 1) return AppendGltfNode(0, roots[0], world_from_mesh);
    Match(children_[0].size(), roots.size(), "root nodes");
    for (std::size_t i = 0; i < roots.size(); ++i)
      AppendGltfNode(children_[0][i], roots[i], world_from_mesh);
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

  void AppendNodes(const Transform& world_from_mesh) {
    std::vector<Transform> world_from_node;
    for (const ImportedNode& node : source_.nodes) {
      const Transform& world_from_parent =
          node.parent < 0 ? world_from_mesh
                          : world_from_node[static_cast<std::size_t>(node.parent)];
      world_from_node.push_back(world_from_parent * node.parent_from_node);
      for (const std::uint32_t m : node.meshes)
        if (const ImportedMesh& mesh = source_.meshes[m]; !mesh.triangles.empty())
          AppendTriangles(mesh, world_from_node.back(), MaterialOf(mesh), {0, 1});
    }
  }

  void AppendGltfNode(std::size_t imported, std::size_t number,
                      const Transform& world_from_parent) {
    const ImportedNode& node = source_.nodes[imported];
    const core::Json& own = gltf_->Element("nodes", number);
    const Transform world_from_node = world_from_parent * node.parent_from_node;
    if (own.contains("mesh")) {
      const auto mesh = core::Field<std::size_t>(own, "mesh", gltf_->file());
      const auto primitives = core::Field<std::vector<core::Json>>(gltf_->Element("meshes", mesh),
                                                                   "primitives", gltf_->file());
      Match(node.meshes.size(), primitives.size(), "primitives in a mesh");
      const std::vector<Transform> instances = gltf_->Instances(own);
      for (std::size_t i = 0; i < node.meshes.size(); ++i)
        AppendPrimitive(source_.meshes[node.meshes[i]], primitives[i], world_from_node, instances);
    }
    const auto children = Gltf::Children(own, gltf_->file());
    Match(children_[imported].size(), children.size(), "nodes below one");
    for (std::size_t i = 0; i < children.size(); ++i)
      AppendGltfNode(children_[imported][i], children[i], world_from_node);
  }

  void AppendPrimitive(const ImportedMesh& mesh, const core::Json& primitive,
                       const Transform& world_from_node, const std::vector<Transform>& instances) {
    if (mesh.triangles.empty()) return;
    GltfMaterial material;
    if (override_) {
      material.material = *override_;
    } else {
      std::optional<std::size_t> number;
      if (primitive.contains("material"))
        number = core::Field<std::size_t>(primitive, "material", gltf_->file());
      material = gltf_materials_->Get(number);
    }
    if (instances.size() > kMostTriangles / mesh.triangles.size())
      Fail(fmt::format("places {} triangles {} times; {} are read at most", mesh.triangles.size(),
                       instances.size(), kMostTriangles));
    const TextureCoordinates uv{IntegerCoordinates(mesh, primitive, material.sets[0]),
                                IntegerCoordinates(mesh, primitive, material.sets[1])};
    for (const Transform& node_from_instance : instances)
      AppendTriangles(mesh, world_from_node * node_from_instance, material.material, material.sets,
                      uv);
  }

  // Set `set` of a primitive's texture coordinates, v upwards, where they are integers, which
  // assimp takes for floats; empty where they are not.
  std::vector<std::array<float, 2>> IntegerCoordinates(const ImportedMesh& mesh,
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
    Match(mesh.positions.size(), uv.size(), "texture coordinates");
    return uv;
  }

  // For so many more: at once where they are most of all, by doubling where many meshes follow.
  template <typename T>
  static void MakeRoom(std::size_t more, std::vector<T>& values) {
    if (more > values.size()) values.reserve(values.size() + more);
  }

  // `sets` of the mesh's texture coordinates become a vertex's uv and uv1, or those that are given.
  void AppendTriangles(const ImportedMesh& mesh, const Transform& world_from_mesh,
                       std::uint32_t material, const std::array<std::size_t, 2>& sets,
                       const TextureCoordinates& given = {}) {
    if (geometry_.triangles.size() + mesh.triangles.size() > kMostTriangles)
      Fail(fmt::format("brings the scene to more than {} triangles", kMostTriangles));
    const auto first = static_cast<std::uint32_t>(geometry_.vertices.size());
    MakeRoom(mesh.positions.size(), geometry_.vertices);
    MakeRoom(mesh.triangles.size(), geometry_.triangles);
    const bool normals_transform = std::abs(world_from_mesh.Determinant()) > 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      Vertex vertex;
      vertex.position = ToFloat(world_from_mesh.Point(ToVec3(mesh.positions[i])));
      if (!IsFinite(vertex.position))
        Fail(fmt::format("vertex {} has a coordinate that is not finite", i));
      if (!IsNear(vertex.position))
        Fail(fmt::format("vertex {} lies more than {} m from the origin", i, kLargest_m));
      if (!mesh.normals.empty() && normals_transform) {
        const auto normal = ToFloat(world_from_mesh.Normal(ToVec3(mesh.normals[i])));
        if (IsFinite(normal)) vertex.normal = normal;  // else (zero in the file) the triangle's own
      }
      vertex.uv = given[0].empty() ? TextureCoordinate(mesh, sets[0], i) : given[0][i];
      vertex.uv1 = given[1].empty() ? TextureCoordinate(mesh, sets[1], i) : given[1][i];
      geometry_.vertices.push_back(vertex);
    }
    for (const auto& [a, b, c] : mesh.triangles)
      geometry_.triangles.push_back({{first + a, first + b, first + c}, material});
  }

  // Zeros if the mesh has no such set.
  std::array<float, 2> TextureCoordinate(const ImportedMesh& mesh, std::size_t set,
                                         std::size_t vertex) const {
    if (set >= ImportedMesh::kSets || mesh.uv[set].empty()) return {};
    const auto& uv = mesh.uv[set][vertex];
    if (!std::isfinite(uv[0]) || !std::isfinite(uv[1]))
      Fail(fmt::format("texture coordinate of vertex {} is not finite", vertex));
    return uv;
  }

  std::uint32_t MaterialOf(const ImportedMesh& mesh) {
    if (override_) return *override_;
    const auto [entry, is_new] = materials_.try_emplace(mesh.material, 0);
    if (is_new) {
      Material material = ConvertMaterial(source_.materials[mesh.material]);
      entry->second = static_cast<std::uint32_t>(geometry_.materials.size());
      geometry_.materials.push_back(std::move(material));
    }
    return entry->second;
  }

  Material ConvertMaterial(const ImportedMaterial& source) {
    Material material;
    material.name = source.name;
    for (int c = 0; c < 3; ++c) {
      if (!std::isfinite(source.diffuse[c]))
        Fail(fmt::format("the colour of material '{}' is not finite", material.name));
      material.albedo[c] = std::clamp(source.diffuse[c], 0.0f, 1.0f);
    }
    if (!source.texture.empty()) material.texture = TextureIndex(source.texture);
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
  const ImportedScene& source_;
  const Gltf* gltf_;                                // null: no glTF file
  std::vector<std::vector<std::size_t>> children_;  // of the imported nodes; glTF only
  std::optional<std::uint32_t> override_;
  Geometry& geometry_;
  std::map<std::uint32_t, std::uint32_t> materials_;  // of the file -> of the geometry
  std::map<std::string, int> textures_;
  std::optional<GltfMaterials> gltf_materials_;
};

// assimp looks for the end of a PLY file's header for ever.
void CheckPlyHeader(const std::filesystem::path& path) {
  constexpr std::size_t kLongestHeader = 1 << 20;
  if (core::ReadStart(path, kLongestHeader).find("end_header") == std::string::npos)
    throw InputError(path.string(), "is a PLY file whose header has no end", kRemedy);
}

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
  if (extension == ".ply") CheckPlyHeader(path);
}

}  // namespace

std::vector<std::string> AppendMesh(const std::filesystem::path& path,
                                    const Transform& world_from_mesh,
                                    std::optional<std::uint32_t> material, Geometry& geometry) {
  CheckReadable(path);
  std::optional<Gltf> gltf;
  if (Gltf::Is(path)) gltf.emplace(path);
  // glTF has no polygons, and its primitives must stay as they are numbered.
  const ImportedScene source =
      ImportMesh(path, !gltf, gltf ? gltf->Bytes() : std::filesystem::file_size(path));
  const std::size_t before = geometry.triangles.size();
  MeshAppender(path, source, gltf ? &*gltf : nullptr, material, geometry).Append(world_from_mesh);
  if (geometry.triangles.size() == before)
    throw InputError(path.string(), "the mesh holds no triangle", kRemedy);
  return gltf ? gltf->LeftOut(!material) : std::vector<std::string>();
}

}  // namespace luxfield::scene
