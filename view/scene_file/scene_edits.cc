#include "luxfield/view/scene_file/scene_edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/view/scene_file/toml_text.h"

namespace luxfield::view {
namespace {

using lightfield::Vec3;
using scene::MaterialKind;

std::string Written(const Vec3& v) {
  return fmt::format("[{}, {}, {}]", TomlNumber(v.x), TomlNumber(v.y), TomlNumber(v.z));
}
std::string Written(const std::array<double, 3>& v) { return Written(Vec3{v[0], v[1], v[2]}); }

std::optional<Vec3> VectorOf(const toml::table& table, std::string_view key) {
  const toml::array* array = table[key].as_array();
  if (!array || array->size() != 3) return {};
  std::array<double, 3> v{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto number = array->get(i)->value<double>();
    if (!number) return {};
    v[i] = *number;
  }
  return Vec3{v[0], v[1], v[2]};
}

Vec3 VectorOf(const toml::table& table, std::string_view key, const Vec3& fallback) {
  return VectorOf(table, key).value_or(fallback);
}

std::string TextOf(const toml::table& table, std::string_view key, const std::string& fallback) {
  return table[key].value<std::string>().value_or(fallback);
}

double NumberOf(const toml::table& table, std::string_view key, double fallback) {
  return table[key].value<double>().value_or(fallback);
}

std::array<double, 3> ColourOf(const toml::table& table, std::string_view key,
                               const Vec3& fallback = {}) {
  const Vec3 v = VectorOf(table, key, fallback);
  return {v.x, v.y, v.z};
}

std::optional<std::array<double, 2>> SizeOf(const toml::table& table) {
  const toml::array* array = table["size"].as_array();
  if (!array || array->size() != 2) return {};
  const auto x = array->get(0)->value<double>(), y = array->get(1)->value<double>();
  if (!x || !y) return {};
  return std::array{*x, *y};
}

LampPlacement LampOf(const toml::table& table, std::size_t number, const std::string& file) {
  LampPlacement lamp;
  lamp.name = TextOf(table, "name", fmt::format("luminaire {}", number + 1));
  const auto position = VectorOf(table, "position");
  if (!position) throw InputError(file, fmt::format("luminaire {} has no position", number + 1));
  lamp.position = *position;
  lamp.look_at = VectorOf(table, "look_at");
  lamp.up = VectorOf(table, "up", {0, 0, 1});
  lamp.rotate_deg = VectorOf(table, "rotate_deg", {});
  lamp.scale = NumberOf(table, "scale", 1);
  lamp.colour = ColourOf(table, "colour", {1, 1, 1});
  lamp.file = TextOf(table, "file", "");
  lamp.tables = TextOf(table, "tables", "");
  lamp.model = TextOf(table, "model", "");
  lamp.distribution = TextOf(table, "distribution", "");
  lamp.size_m = SizeOf(table);
  return lamp;
}

MaterialNumbers MaterialOf(const toml::table& table) {
  MaterialNumbers material;
  material.name = TextOf(table, "name", "");
  const std::string kind = TextOf(table, "kind", "lambert");
  material.kind = kind == "phong" ? MaterialKind::kPhong
                  : kind == "ggx" ? MaterialKind::kGgx
                                  : MaterialKind::kLambert;
  material.albedo = ColourOf(table, "albedo");
  material.specular = ColourOf(table, "specular");
  material.exponent = NumberOf(table, "exponent", 0);
  material.metallic = NumberOf(table, "metallic", 0);
  material.roughness = NumberOf(table, "roughness", 1);
  return material;
}

SavedView ViewOf(const toml::table& table) {
  return {TextOf(table, "name", ""), VectorOf(table, "position", {}),
          VectorOf(table, "look_at", {}), VectorOf(table, "up", {0, 0, 1}),
          NumberOf(table, "vertical_fov_deg", 40)};
}

SceneEdits EditsOf(const TomlText& text, const std::string& file) {
  SceneEdits edits;
  for (const toml::table* table : text.Tables("luminaire"))
    edits.lamps.push_back(LampOf(*table, edits.lamps.size(), file));
  for (const toml::table* table : text.Tables("material"))
    edits.materials.push_back(MaterialOf(*table));
  for (const toml::table* table : text.Tables("view")) edits.views.push_back(ViewOf(*table));
  if (const toml::table* table = text.root()["environment"].as_table())
    edits.environment =
        EnvironmentNumbers{VectorOf(*table, "rotate_deg", {}), NumberOf(*table, "scale", 1)};
  return edits;
}

template <typename Named>
const Named* Find(const std::vector<Named>& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &Named::name);
  return found == all.end() ? nullptr : &*found;
}

// Whether two lists have the same names, in any order.
template <typename Named>
bool SameNames(const std::vector<Named>& a, const std::vector<Named>& b) {
  return a.size() == b.size() &&
         std::ranges::all_of(a, [&](const Named& one) { return Find(b, one.name); });
}

void RequireUnchanged(const SceneEdits& found, const SceneEdits& was, const std::string& file) {
  const auto require = [&](bool same, const char* what) {
    if (same) return;
    throw InputError(file, fmt::format("has other {} than when it was opened", what),
                     "open it again, and change them there");
  };
  const auto same_lamp = [&](const LampPlacement& lamp) {
    const LampPlacement* before = Find(was.lamps, lamp.name);
    return before && before->look_at.has_value() == lamp.look_at.has_value() &&
           before->model == lamp.model;
  };
  // Lamps of arrays are nobody's to move.
  if (!was.lamps.empty())
    require(found.lamps.size() == was.lamps.size() && std::ranges::all_of(found.lamps, same_lamp),
            "luminaires");
  require(SameNames(found.materials, was.materials), "materials");
  require(SameNames(found.views, was.views), "views");
  require(found.environment.has_value() == was.environment.has_value(), "light from far away");
}

std::string NewLamp(const LampPlacement& lamp) {
  std::string lines = fmt::format("\n[[luminaire]]\nname = {}\n", TomlString(lamp.name));
  for (const auto& [key, value] : {std::pair("model", lamp.model),
                                   {"file", lamp.file},
                                   {"tables", lamp.tables},
                                   {"distribution", lamp.distribution}})
    if (!value.empty()) lines += fmt::format("{} = {}\n", key, TomlString(value));
  if (lamp.size_m)
    lines += fmt::format("size = [{}, {}]\n", TomlNumber((*lamp.size_m)[0]),
                         TomlNumber((*lamp.size_m)[1]));
  lines += fmt::format("position = {}\n", Written(lamp.position));
  if (lamp.look_at) {
    lines += fmt::format("look_at = {}\n", Written(*lamp.look_at));
    if (!Same(lamp.up, {0, 0, 1})) lines += fmt::format("up = {}\n", Written(lamp.up));
  } else {
    lines += fmt::format("rotate_deg = {}\n", Written(lamp.rotate_deg));
  }
  if (lamp.scale != 1) lines += fmt::format("scale = {}\n", TomlNumber(lamp.scale));
  if (lamp.colour != LampPlacement().colour)
    lines += fmt::format("colour = {}\n", Written(lamp.colour));
  return lines;
}

std::string NewView(const SavedView& view) {
  std::string lines =
      fmt::format("\n[[view]]\nname = {}\nposition = {}\nlook_at = {}\n", TomlString(view.name),
                  Written(view.position), Written(view.look_at));
  if (!Same(view.up, {0, 0, 1})) lines += fmt::format("up = {}\n", Written(view.up));
  return lines + fmt::format("vertical_fov_deg = {}\n", TomlNumber(view.vertical_fov_deg));
}

// Writes what differs of one table.
class TableWriter {
 public:
  TableWriter(TomlText& text, const toml::table& table, const char* after)
      : text_(text), table_(table), after_(after) {}

  void Write(const char* key, double was, double is) {
    if (was != is) text_.Set(table_, key, TomlNumber(is), after_);
  }
  void Write(const char* key, const Vec3& was, const Vec3& is) {
    if (!Same(was, is)) text_.Set(table_, key, Written(is), after_);
  }
  void Write(const char* key, const std::array<double, 3>& was, const std::array<double, 3>& is) {
    if (was != is) text_.Set(table_, key, Written(is), after_);
  }
  void Write(const char* key, const std::string& was, const std::string& is) {
    if (was == is) return;
    if (is.empty())
      text_.Drop(table_, key);
    else
      text_.Set(table_, key, TomlString(is), after_);
  }

 private:
  TomlText& text_;
  const toml::table& table_;
  const char* after_;
};

void WriteLamp(TomlText& text, const toml::table& table, const LampPlacement& was,
               const LampPlacement& is) {
  TableWriter writer(text, table, "position");
  writer.Write("file", was.file, is.file);
  writer.Write("tables", was.tables, is.tables);
  writer.Write("position", was.position, is.position);
  if (is.look_at) writer.Write("look_at", *was.look_at, *is.look_at);
  writer.Write("up", was.up, is.up);
  writer.Write("rotate_deg", was.rotate_deg, is.rotate_deg);
  writer.Write("scale", was.scale, is.scale);
  writer.Write("colour", was.colour, is.colour);
}

void WriteLamps(TomlText& text, const std::vector<LampPlacement>& found,
                const std::vector<LampPlacement>& is) {
  const auto tables = text.Tables("luminaire");
  bool numbers_shift = false;  // of lamps that have no name but their number
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const LampPlacement* lamp = Find(is, found[i].name);
    if (!lamp) {
      text.DropTable(*tables[i]);
      numbers_shift = true;
      continue;
    }
    WriteLamp(text, *tables[i], found[i], *lamp);
    if (numbers_shift && !tables[i]->contains("name"))
      text.Set(*tables[i], "name", TomlString(lamp->name), "position");
  }
  for (const LampPlacement& lamp : is)
    if (!Find(found, lamp.name)) text.Append(NewLamp(lamp));
}

void WriteMaterials(TomlText& text, const std::vector<MaterialNumbers>& found,
                    const std::vector<MaterialNumbers>& is) {
  const auto tables = text.Tables("material");
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const MaterialNumbers &before = found[i], &after = *Find(is, before.name);
    TableWriter writer(text, *tables[i], "albedo");
    writer.Write("albedo", before.albedo, after.albedo);
    writer.Write("specular", before.specular, after.specular);
    writer.Write("exponent", before.exponent, after.exponent);
    writer.Write("metallic", before.metallic, after.metallic);
    writer.Write("roughness", before.roughness, after.roughness);
  }
}

void WriteViews(TomlText& text, const std::vector<SavedView>& found,
                const std::vector<SavedView>& is) {
  const auto tables = text.Tables("view");
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const SavedView* view = Find(is, found[i].name);
    if (!view) {
      text.DropTable(*tables[i]);
      continue;
    }
    TableWriter writer(text, *tables[i], "position");
    writer.Write("position", found[i].position, view->position);
    writer.Write("look_at", found[i].look_at, view->look_at);
    writer.Write("up", found[i].up, view->up);
    writer.Write("vertical_fov_deg", found[i].vertical_fov_deg, view->vertical_fov_deg);
  }
  for (const SavedView& view : is)
    if (!Find(found, view.name)) text.Append(NewView(view));
}

// Whether a file says what it is to say, whatever the order.
template <typename Named>
bool SaysAll(const std::vector<Named>& file, const std::vector<Named>& is) {
  return file.size() == is.size() && std::ranges::all_of(is, [&](const Named& one) {
           const Named* written = Find(file, one.name);
           return written && *written == one;
         });
}

scene::Luminaire LuminaireOf(const LampPlacement& lamp, const std::filesystem::path& folder) {
  const auto path = [&](const std::string& name) {
    return name.empty() ? std::filesystem::path() : folder / name;
  };
  return {lamp.name,  path(lamp.file), path(lamp.tables), lamp.WorldFromLuminaire().value(),
          lamp.scale, lamp.colour};
}

scene::ClassicalLight ClassicalLightOf(const LampPlacement& lamp,
                                       const std::filesystem::path& folder) {
  return {lamp.name,
          lamp.model == "point"    ? scene::ClassicalModel::kPoint
          : lamp.model == "linear" ? scene::ClassicalModel::kLinear
                                   : scene::ClassicalModel::kArea,
          folder / lamp.distribution,
          lamp.model == "point" ? std::nullopt : lamp.size_m,
          lamp.WorldFromLuminaire().value(),
          lamp.scale,
          lamp.colour};
}

void Apply(const MaterialNumbers& numbers, scene::Material& material) {
  for (std::size_t c = 0; c < 3; ++c) {
    material.albedo[c] = static_cast<float>(numbers.albedo[c]);
    if (numbers.kind == MaterialKind::kPhong)
      material.specular[c] = static_cast<float>(numbers.specular[c]);
  }
  if (numbers.kind == MaterialKind::kPhong)
    material.exponent = static_cast<float>(numbers.exponent);
  if (numbers.kind != MaterialKind::kGgx) return;
  material.metallic = static_cast<float>(numbers.metallic);
  material.roughness = static_cast<float>(numbers.roughness);
}

}  // namespace

bool EnvironmentNumbers::operator==(const EnvironmentNumbers& other) const {
  return Same(rotate_deg, other.rotate_deg) && scale == other.scale;
}

bool SavedView::operator==(const SavedView& other) const {
  return name == other.name && Same(position, other.position) && Same(look_at, other.look_at) &&
         Same(up, other.up) && vertical_fov_deg == other.vertical_fov_deg;
}

SavedView ViewFrom(const scene::Camera& camera, double distance_m, const std::string& name) {
  constexpr double kDigit = 1e4;
  const auto rounded = [](Vec3 v) {
    return Vec3{std::round(v.x * kDigit) / kDigit, std::round(v.y * kDigit) / kDigit,
                std::round(v.z * kDigit) / kDigit};
  };
  SavedView view{name,
                 rounded(camera.position),
                 {},
                 {0, 0, 1},
                 std::round(camera.vertical_fov_deg * kDigit) / kDigit};
  // Far enough that rounding turns it by less than a thousandth of a degree.
  view.look_at = rounded(camera.position + std::max(distance_m, 10.0) * camera.forward);
  // Upright cameras need no `up`.
  if (std::abs(camera.right.z) > 1e-6 || camera.up.z < 0.02) view.up = rounded(camera.up);
  return view;
}

scene::Camera CameraOf(const SavedView& view, const scene::Camera& like) {
  return scene::Camera::LookAt(view.position, view.look_at, view.up, view.vertical_fov_deg,
                               like.width, like.height);
}

SceneEdits ReadSceneEdits(const std::filesystem::path& scene) {
  return EditsOf(TomlText(core::ReadFile(scene), scene.string()), scene.string());
}

std::string WithEdits(const std::string& text, const SceneEdits& was, const SceneEdits& is,
                      const std::string& file) {
  TomlText edited(text, file);
  const SceneEdits found = EditsOf(edited, file);
  RequireUnchanged(found, was, file);
  if (!was.lamps.empty()) WriteLamps(edited, found.lamps, is.lamps);
  WriteMaterials(edited, found.materials, is.materials);
  WriteViews(edited, found.views, is.views);
  if (const toml::table* table = edited.root()["environment"].as_table()) {
    TableWriter writer(edited, *table, "file");
    writer.Write("rotate_deg", found.environment->rotate_deg, is.environment->rotate_deg);
    writer.Write("scale", found.environment->scale, is.environment->scale);
  }
  const std::string result = edited.Text();
  const InputError cannot(
      file, "is written in a way that the window cannot change",
      "write luminaires, materials and views as [[...]] with a line for each key");
  try {
    const SceneEdits says = EditsOf(TomlText(result, file), file);
    if ((!was.lamps.empty() && !SaysAll(says.lamps, is.lamps)) ||
        !SaysAll(says.materials, is.materials) || !SaysAll(says.views, is.views) ||
        says.environment != is.environment)
      throw cannot;
  } catch (const InputError&) {
    throw cannot;
  }
  return result;
}

void SaveSceneEdits(const std::filesystem::path& scene, const SceneEdits& was,
                    const SceneEdits& is) {
  const std::string text = WithEdits(core::ReadFile(scene), was, is, scene.string());
  const core::WritesAtOnce at_once;
  core::WriteFileAtomically(scene, text);
}

scene::Scene Edited(const scene::Scene& scene, const SceneEdits& was, const SceneEdits& is) {
  scene::Scene edited = scene;
  if (!was.lamps.empty() &&
      was.lamps.size() == scene.luminaires.size() + scene.classical_lights.size()) {
    const std::filesystem::path folder = scene.file.parent_path();
    edited.luminaires.clear();
    edited.classical_lights.clear();
    for (const LampPlacement& lamp : is.lamps)
      if (lamp.IsClassical())
        edited.classical_lights.push_back(ClassicalLightOf(lamp, folder));
      else
        edited.luminaires.push_back(LuminaireOf(lamp, folder));
  }
  edited.geometry.materials = EditedMaterials(scene, is);
  if (edited.environment && is.environment) {
    edited.environment->world_from_environment = scene::RotationXyz(is.environment->rotate_deg);
    edited.environment->scale = is.environment->scale;
  }
  return edited;
}

// The file's materials come before those of meshes.
std::vector<scene::Material> EditedMaterials(const scene::Scene& scene, const SceneEdits& is) {
  std::vector<scene::Material> materials = scene.geometry.materials;
  for (std::size_t i = 0; i < is.materials.size(); ++i) Apply(is.materials[i], materials.at(i));
  return materials;
}

bool SameLamps(const SceneEdits& a, const SceneEdits& b) {
  return std::ranges::equal(a.lamps, b.lamps, [](const auto& one, const auto& other) {
    return one.name == other.name && one.file == other.file && one.tables == other.tables &&
           one.distribution == other.distribution;
  });
}

}  // namespace luxfield::view
