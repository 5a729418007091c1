#include "luxfield/scene/scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "luxfield/core/config.h"
#include "luxfield/core/error.h"
#include "luxfield/core/warning.h"
#include "luxfield/scene/mesh.h"
#include "luxfield/scene/named_view.h"
#include "luxfield/scene/texture.h"

namespace luxfield::scene {
namespace {

using core::Config;
using lightfield::Cross;
using lightfield::Length;
using lightfield::Normalized;

constexpr double kLargest_m = 1e6;  // float32 resolves 6 cm there
constexpr double kUsual_m = 1000;   // what is farther is given in millimetres, it seems
constexpr double kSmallestLight_m = 1e-6;
constexpr double kBrightest = 1e12;
constexpr int kMostCopies = 1000000;  // in the arrays of one thing
constexpr int kMaxPixels = 16384;
constexpr int kMaxFaceSize = 8192;
constexpr double kLargestExponent = 1e6;  // a lobe of 0.06 degrees; float32 directions resolve it

Vec3 ToVec3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

Vec3 GetVec3(const Config& table, std::string_view key) { return ToVec3(table.Numbers(key, 3)); }

Vec3 GetVec3(const Config& table, std::string_view key, const std::vector<double>& fallback) {
  return ToVec3(table.Numbers(key, 3, fallback));
}

Vec3 GetPoint(const Config& table, std::string_view key, std::optional<Vec3> fallback = {}) {
  const Vec3 p =
      fallback ? GetVec3(table, key, {fallback->x, fallback->y, fallback->z}) : GetVec3(table, key);
  if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > kLargest_m)
    table.Fail(
        key,
        fmt::format("[{}, {}, {}] is farther than {} m from the origin", p.x, p.y, p.z, kLargest_m),
        "give metres, and move the scene to the origin");
  for (const double coordinate : {p.x, p.y, p.z})
    core::SuspectLength(table.file(), table.Name(key), coordinate, kUsual_m);
  return p;
}

// position + (look_at, up), checked.
struct View {
  Vec3 position, target, up;
};

View GetView(const Config& table) {
  View view{GetPoint(table, "position"), GetPoint(table, "look_at"),
            GetVec3(table, "up", {0, 0, 1})};
  const Vec3 line = view.target - view.position;
  if (Length(line) <= 1e-9 * (1 + Length(view.position)))
    table.Fail("look_at", "is the same point as position", "move one of them");
  if (Length(view.up) == 0 || Length(Cross(Normalized(view.up), Normalized(line))) < 1e-6)
    table.Fail("up", "is zero or parallel to the line from position to look_at",
               "choose another direction");
  return view;
}

Pose GetPose(const Config& table) {
  if (table.Has("look_at")) {
    if (table.Has("rotate_deg"))
      table.Fail("rotate_deg", "contradicts look_at", "give one of them");
    const View view = GetView(table);
    return LookAt(view.position, view.target, view.up);
  }
  return Translation(GetPoint(table, "position")) *
         RotationXyz(GetVec3(table, "rotate_deg", {0, 0, 0}));
}

// position and rotate_deg of something scaled by `factors` first.
Transform GetTransform(const Config& table, std::string_view factors_key, Vec3 factors) {
  if (factors.x == 0 || factors.y == 0 || factors.z == 0)
    table.Fail(factors_key, "holds a zero", "give numbers other than 0");
  return Translation(GetPoint(table, "position", Vec3{})) *
         RotationXyz(GetVec3(table, "rotate_deg", {0, 0, 0})) * Scaling(factors);
}

std::array<float, 3> GetReflectance(const Config& table, std::string_view key) {
  const auto values = table.Numbers(key, 3);
  std::array<float, 3> out{};
  for (int c = 0; c < 3; ++c) {
    if (values[c] < 0 || values[c] > 1)
      table.Fail(key, fmt::format("= {} is outside [0, 1]", values[c]),
                 "give reflectances in linear Rec. 709");
    out[c] = static_cast<float>(values[c]);
  }
  return out;
}

// Its number in `geometry`, -1 if the key is absent.
int GetTexture(const Config& table, std::string_view key, Geometry& geometry) {
  if (!table.Has(key)) return -1;
  geometry.textures.push_back(ReadTexture(table.Path(key)));
  return static_cast<int>(geometry.textures.size()) - 1;
}

Material ReadMaterial(const Config& table, Geometry& geometry) {
  Material material;
  material.name = table.Text("name");
  material.albedo = GetReflectance(table, "albedo");
  material.texture = GetTexture(table, "texture", geometry);
  material.normal_texture = GetTexture(table, "normal_texture", geometry);
  const std::string kind = table.Choice("kind", {"lambert", "phong", "ggx"}, "lambert");
  if (kind == "phong") {
    material.kind = MaterialKind::kPhong;
    material.specular = GetReflectance(table, "specular");
    material.exponent = static_cast<float>(table.Number("exponent", {0, kLargestExponent}));
    for (int c = 0; c < 3; ++c) {
      const double sum = double{material.albedo[c]} + material.specular[c];
      if (sum > 1 + 1e-6)  // rounding of decimals
        table.Fail("specular",
                   fmt::format("= {} and albedo = {} reflect {:.3f} of the light in channel {}",
                               material.specular[c], material.albedo[c], sum, "rgb"[c]),
                   "let albedo + specular be at most 1");
    }
  } else if (kind == "ggx") {
    material.kind = MaterialKind::kGgx;
    material.metallic = static_cast<float>(table.Number("metallic", 0, {0, 1}));
    material.roughness = static_cast<float>(table.Number("roughness", {0, 1}));
    material.metallic_roughness_texture = GetTexture(table, "metallic_roughness_texture", geometry);
  }
  return material;
}

std::map<std::string, std::uint32_t> ReadMaterials(const Config& root, Geometry& geometry) {
  std::map<std::string, std::uint32_t> by_name;
  for (const Config& table : root.Tables("material")) {
    Material material = ReadMaterial(table, geometry);
    if (!by_name.emplace(material.name, static_cast<std::uint32_t>(geometry.materials.size()))
             .second)
      table.Fail("name", "is taken twice", "give each material its own name");
    geometry.materials.push_back(std::move(material));
  }
  return by_name;
}

// Of the box around the vertices from `first` on, its longest side.
double WidthFrom(const Geometry& geometry, std::size_t first) {
  double widest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(
        geometry.vertices.begin() + static_cast<std::ptrdiff_t>(first), geometry.vertices.end(),
        [axis](const Vertex& a, const Vertex& b) { return a.position[axis] < b.position[axis]; });
    if (low != geometry.vertices.end())
      widest = std::max(widest, double{high->position[axis]} - low->position[axis]);
  }
  return widest;
}

// Where copies of something stand against the first one: its arrays ([[luminaire.array]] ...), each
// of `count` at multiples of `step`, combined.
std::vector<Vec3> ReadArrays(const Config& table) {
  std::vector<Vec3> offsets = {{}};
  for (const Config& array : table.Tables("array")) {
    const int count = array.Integer("count", 1, kMostCopies);
    const Vec3 step = GetPoint(array, "step");
    if (offsets.size() * count > kMostCopies)
      array.Fail("count",
                 fmt::format("= {} makes more than {} copies with the arrays before it", count,
                             kMostCopies),
                 "make fewer of them");
    std::vector<Vec3> more;
    for (int k = 0; k < count; ++k)
      for (const Vec3 offset : offsets) more.push_back(offset + double{1} * k * step);
    offsets = std::move(more);
  }
  return offsets;
}

class GeometryReader {
 public:
  GeometryReader(const Config& root, Geometry& geometry)
      : root_(root), geometry_(geometry), materials_(ReadMaterials(root, geometry)) {}

  std::vector<LeftOut> Read() {
    std::vector<LeftOut> left_out;
    for (const Config& table : root_.Tables("mesh")) {
      std::optional<std::uint32_t> material;
      if (table.Has("material")) material = MaterialOf(table);
      const auto file = table.Path("file");
      std::error_code unused;
      if (!std::filesystem::exists(file, unused))
        table.Fail("file", "does not exist", "correct the path");
      const Vec3 factors = GetVec3(table, "scale", {1, 1, 1});
      const std::size_t first = geometry_.vertices.size();
      auto features = AppendMesh(file, GetTransform(table, "scale", factors), material, geometry_);
      core::SuspectLength(table.file(), "the width of the mesh " + file.string(),
                          WidthFrom(geometry_, first), kUsual_m);
      const bool is_new = std::none_of(left_out.begin(), left_out.end(),
                                       [&](const LeftOut& other) { return other.file == file; });
      if (!features.empty() && is_new) left_out.push_back({file, std::move(features)});
    }
    for (const Config& table : root_.Tables("quad")) {
      const Vec3 corner = GetPoint(table, "corner"), u = GetPoint(table, "edge_u"),
                 v = GetPoint(table, "edge_v");
      if (!(Length(Cross(u, v)) > 0))
        table.Fail("edge_v", "is zero or parallel to edge_u",
                   "give two edges that span a parallelogram");
      for (const Vec3 offset : ReadArrays(table))
        AppendQuad(corner + offset, u, v, MaterialOf(table), geometry_);
    }
    for (const Config& table : root_.Tables("box")) {
      const Transform box = GetTransform(table, "size", GetPoint(table, "size"));
      for (const Vec3 offset : ReadArrays(table))
        AppendBox(Translation(offset) * box, MaterialOf(table), geometry_);
    }
    return left_out;
  }

 private:
  std::uint32_t MaterialOf(const Config& table) const {
    const std::string name = table.Text("material");
    const auto found = materials_.find(name);
    if (found == materials_.end())
      table.Fail("material", "is not defined", "add a [[material]] of that name");
    return found->second;
  }

  const Config& root_;
  Geometry& geometry_;
  std::map<std::string, std::uint32_t> materials_;
};

Camera CameraAt(const Config& table, int width, int height) {
  const View view = GetView(table);
  const double fov = table.Number("vertical_fov_deg", 40, {0.01, 170});
  return Camera::LookAt(view.position, view.target, view.up, fov, width, height);
}

Camera ReadCamera(const Config& root, const SceneOverrides& overrides) {
  const Config table = root.Table("camera");
  const int width = table.Integer("width", 1024, 1, kMaxPixels);
  const int height = table.Integer("height", 768, 1, kMaxPixels);
  return CameraAt(table, overrides.width.value_or(width), overrides.height.value_or(height));
}

struct NamedView {
  std::string name;
  Camera camera;
};

std::vector<NamedView> ReadViews(const Config& root, const Camera& camera) {
  std::vector<NamedView> views;
  for (const Config& table : root.Tables("view")) {
    const std::string name = table.Text("name");
    if (std::ranges::find(views, name, &NamedView::name) != views.end())
      table.Fail("name", "is taken", "give each view its own name");
    views.push_back({name, CameraAt(table, camera.width, camera.height)});
  }
  return views;
}

// Adds the copies of a light, whose pose is world_from_light.
template <typename Light>
void AppendCopies(const Config& table, const Light& light, Pose Light::*world_from_light,
                  std::vector<Light>& lights) {
  for (const Vec3 offset : ReadArrays(table)) {
    lights.push_back(light);
    Pose& pose = lights.back().*world_from_light;
    pose = Translation(offset) * pose;
    const Vec3 p = pose.translation;
    if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > kLargest_m)
      table.Fail("array",
                 fmt::format("puts a copy at [{}, {}, {}], farther than {} m from the "
                             "origin",
                             p.x, p.y, p.z, kLargest_m),
                 "shorten its step");
  }
}

// The factors of a light's channels.
core::Rgb GetColour(const Config& table) {
  core::Rgb colour = {1, 1, 1};
  if (!table.Has("colour")) return colour;
  const auto factors = table.Numbers("colour", 3);
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(factors[c] >= 0 && factors[c] <= kBrightest))
      table.Fail("colour", fmt::format("= {} is outside [0, {:g}]", factors[c], kBrightest),
                 "give three factors in that range, [1, 1, 1] for the light as it is");
    colour[c] = factors[c];
  }
  return colour;
}

Luminaire ReadLuminaire(const Config& table) {
  Luminaire luminaire;
  luminaire.light_field = table.Path("file");
  if (table.Has("tables")) luminaire.tables = table.Path("tables");
  luminaire.world_from_luminaire = GetPose(table);
  luminaire.scale = table.Number("scale", 1, {0, kBrightest});
  luminaire.colour = GetColour(table);
  return luminaire;
}

// The sides of a linear light or an area; empty: not stated.
std::optional<std::array<double, 2>> GetSize(const Config& table, ClassicalModel model) {
  if (model == ClassicalModel::kPoint || !table.Has("size")) return {};
  const auto size = table.Numbers("size", 2);
  const bool linear = model == ClassicalModel::kLinear;
  for (const double side : size)
    if (!((side >= kSmallestLight_m && side <= kLargest_m) || (linear && side == 0)))
      table.Fail("size",
                 fmt::format("= {} is outside [{:g}, {:g}] m", side, kSmallestLight_m, kLargest_m),
                 linear ? "give [length, 0] or [0, length]" : "give the area's two sides");
  if (linear && (size[0] == 0) == (size[1] == 0))
    table.Fail("size", fmt::format("= [{}, {}] is no line", size[0], size[1]),
               "give [length, 0] or [0, length]");
  return std::array{size[0], size[1]};
}

ClassicalLight ReadClassicalLight(const Config& table) {
  ClassicalLight light;
  const std::string model = table.Choice("model", {"point", "linear", "area"});
  light.model = model == "point"    ? ClassicalModel::kPoint
                : model == "linear" ? ClassicalModel::kLinear
                                    : ClassicalModel::kArea;
  if (table.Has("file"))
    table.Fail("file", "is a light field's, and a model's light is a far field",
               "give its photometric file as distribution, or drop model");
  light.distribution = table.Path("distribution");
  light.size_m = GetSize(table, light.model);
  light.world_from_light = GetPose(table);
  light.scale = table.Number("scale", 1, {0, kBrightest});
  light.colour = GetColour(table);
  return light;
}

void ReadLuminaires(const Config& root, Scene& scene) {
  std::set<std::string> names;
  for (const Config& table : root.Tables("luminaire")) {
    const std::string name = table.Text("name", fmt::format("luminaire {}", names.size() + 1));
    if (!names.insert(name).second || name == "*")
      table.Fail("name", "is taken", "give each luminaire its own name");
    if (table.Has("model")) {
      ClassicalLight light = ReadClassicalLight(table);
      light.name = name;
      AppendCopies(table, light, &ClassicalLight::world_from_light, scene.classical_lights);
    } else {
      if (table.Has("distribution"))
        table.Fail("distribution", "is given without a model",
                   "add model = \"point\", \"linear\" or \"area\"");
      Luminaire luminaire = ReadLuminaire(table);
      luminaire.name = name;
      AppendCopies(table, luminaire, &Luminaire::world_from_luminaire, scene.luminaires);
    }
  }
}

std::vector<AreaLight> ReadAreaLights(const Config& root) {
  std::vector<AreaLight> lights;
  std::set<std::string> names;
  for (const Config& table : root.Tables("light")) {
    AreaLight light;
    light.name = table.Text("name", fmt::format("light {}", names.size() + 1));
    if (!names.insert(light.name).second)
      table.Fail("name", "is taken", "give each light its own name");
    const auto radiance = table.Numbers("radiance", 3);
    for (int c = 0; c < 3; ++c) {
      if (!(radiance[c] >= 0 && radiance[c] <= kBrightest))
        table.Fail("radiance", fmt::format("= {} is outside [0, {:g}]", radiance[c], kBrightest),
                   "choose a value in that range");
      light.radiance[c] = radiance[c];
    }
    if (table.Choice("kind", {"rectangle", "sphere"}) == "rectangle") {
      const auto size = table.Numbers("size", 2);
      for (const double side : size)
        if (!(side >= kSmallestLight_m && side <= kLargest_m))
          table.Fail(
              "size",
              fmt::format("= {} is outside [{:g}, {:g}] m", side, kSmallestLight_m, kLargest_m),
              "give the rectangle's two sides");
      light.width_m = size[0];
      light.height_m = size[1];
      light.world_from_light = GetPose(table);
    } else {
      light.kind = AreaLightKind::kSphere;
      light.radius_m = table.Number("radius", {kSmallestLight_m, kLargest_m});
      light.world_from_light = Translation(GetPoint(table, "position"));
    }
    AppendCopies(table, light, &AreaLight::world_from_light, lights);
  }
  return lights;
}

std::optional<Environment> ReadEnvironment(const Config& root) {
  const auto table = root.OptionalTable("environment");
  if (!table) return {};
  Environment environment;
  environment.file = table->Path("file");
  if (table->Has("layout")) {
    const std::string name = table->Text("layout");
    environment.layout = environment::EnvironmentLayoutFromName(name);
    if (!environment.layout)
      table->Fail("layout", fmt::format("= '{}' is unknown", name),
                  "use one of " + environment::EnvironmentLayoutNames());
  }
  environment.world_from_environment = RotationXyz(GetVec3(*table, "rotate_deg", {0, 0, 0}));
  environment.scale = table->Number("scale", 1, {0, 1e12});
  environment.face_size = table->Integer("face_size", 0, 0, kMaxFaceSize);
  return environment;
}

// Calls apply(luminaire, path) for the luminaires that each entry names.
template <typename Apply>
void Override(const std::map<std::string, std::filesystem::path>& paths, Scene& scene,
              const Apply& apply) {
  for (const auto& [name, path] : paths) {
    bool known = false;
    for (Luminaire& luminaire : scene.luminaires)
      if (name == "*" || name == luminaire.name) {
        apply(luminaire, path);
        known = true;
      }
    if (known) continue;
    for (const ClassicalLight& light : scene.classical_lights)
      if (name == "*" || name == light.name)
        throw InputError(scene.file.string(),
                         fmt::format("the luminaire '{}' shines by a photometric file", light.name),
                         "change its distribution there");
    throw InputError(scene.file.string(), fmt::format("holds no luminaire named '{}'", name),
                     "name one of the scene's");
  }
}

}  // namespace

Camera Camera::LookAt(Vec3 position, Vec3 target, Vec3 up_hint, double vertical_fov_deg, int width,
                      int height) {
  Camera camera;
  camera.position = position;
  camera.forward = Normalized(target - position);
  camera.right = Normalized(Cross(camera.forward, up_hint));
  camera.up = Cross(camera.right, camera.forward);
  camera.vertical_fov_deg = vertical_fov_deg;
  camera.width = width;
  camera.height = height;
  return camera;
}

Vec3 Camera::Direction(double column, double row) const {
  const double half = std::tan(vertical_fov_deg * std::numbers::pi / 360);
  const double x = (2 * column - width) / height * half, y = (1 - 2 * row / height) * half;
  return forward + x * right + y * up;
}

Scene ReadScene(const std::filesystem::path& path, const SceneOverrides& overrides) {
  for (const auto& size : {overrides.width, overrides.height})
    if (size && (*size < 1 || *size > kMaxPixels))
      throw InputError(
          fmt::format("a picture of {} pixels along one side cannot be rendered; choose 1 to {}",
                      *size, kMaxPixels));
  const Config root = Config::FromFile(path);
  Scene scene;
  scene.file = path;
  scene.camera = ReadCamera(root, overrides);
  ReadViews(root, scene.camera);
  ReadLuminaires(root, scene);
  scene.area_lights = ReadAreaLights(root);
  scene.environment = ReadEnvironment(root);
  scene.left_out = GeometryReader(root, scene.geometry).Read();
  for (const LeftOut& of : scene.left_out)
    core::Warn(fmt::format("{}: left out: {}", of.file.string(), fmt::join(of.features, ", ")));
  root.Finish();
  Override(overrides.light_fields, scene, [](Luminaire& luminaire, const auto& file) {
    luminaire.light_field = file;
    luminaire.tables.clear();
  });
  Override(overrides.tables, scene,
           [](Luminaire& luminaire, const auto& file) { luminaire.tables = file; });
  return scene;
}

Camera ReadNamedView(const std::filesystem::path& scene, const std::string& name,
                     const Camera& camera) {
  const std::vector<NamedView> views = ReadViews(Config::FromFile(scene), camera);
  const auto view = std::ranges::find(views, name, &NamedView::name);
  if (view != views.end()) return view->camera;
  std::vector<std::string> names;
  for (const NamedView& known : views) names.push_back(known.name);
  throw InputError(scene.string(), fmt::format("has no view named '{}'", name),
                   names.empty() ? "add a [[view]] of that name"
                                 : fmt::format("use one of {}", fmt::join(names, ", ")));
}

}  // namespace luxfield::scene
