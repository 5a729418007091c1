#include "luxfield/view/scene_file/lamp_placement.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <tuple>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"

namespace luxfield::view {
namespace {

using lightfield::Vec3;

bool Same(const Vec3& a, const Vec3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

std::string Written(double value) { return fmt::format("{}", value); }
std::string Written(const Vec3& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); }

toml::table Parse(std::string_view text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError(file, fmt::format("is no valid TOML: {}", error.description()));
  }
}

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

std::vector<const toml::table*> LuminairesOf(const toml::table& root) {
  std::vector<const toml::table*> tables;
  if (const toml::array* array = root["luminaire"].as_array())
    for (const toml::node& node : *array)
      if (const toml::table* table = node.as_table()) tables.push_back(table);
  return tables;
}

LampPlacement PlacementOf(const toml::table& table, std::size_t number, const std::string& file) {
  LampPlacement placement;
  placement.name =
      table["name"].value<std::string>().value_or(fmt::format("luminaire {}", number + 1));
  const auto position = VectorOf(table, "position");
  if (!position) throw InputError(file, fmt::format("luminaire {} has no position", number + 1));
  placement.position = *position;
  placement.look_at = VectorOf(table, "look_at");
  placement.up = VectorOf(table, "up").value_or(Vec3{0, 0, 1});
  placement.rotate_deg = VectorOf(table, "rotate_deg").value_or(Vec3{});
  placement.scale = table["scale"].value<double>().value_or(1);
  return placement;
}

std::vector<LampPlacement> PlacementsOf(const toml::table& root, const std::string& file) {
  std::vector<LampPlacement> placements;
  for (const toml::table* table : LuminairesOf(root))
    placements.push_back(PlacementOf(*table, placements.size(), file));
  return placements;
}

// The byte at a line and column of the parser, which count from 1 and columns in characters.
std::size_t ByteAt(std::string_view text, toml::source_position place) {
  std::size_t at = 0;
  for (toml::source_index line = 1; line < place.line; ++line) at = text.find('\n', at) + 1;
  for (toml::source_index column = 1; column < place.column && at < text.size(); ++column) {
    ++at;
    while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0) == 0x80) ++at;
  }
  return at;
}

// `length` bytes from `at` are to become `text`.
struct Edit {
  std::size_t at = 0, length = 0;
  std::string text;
};

class Editor {
 public:
  explicit Editor(std::string_view text) : text_(text) {}

  void Set(const toml::table& table, std::string_view key, const std::string& value) {
    if (const toml::node* node = table.get(key)) {
      const std::size_t begin = ByteAt(text_, node->source().begin),
                        end = ByteAt(text_, node->source().end);
      edits_.push_back({begin, end - begin, value});
      return;
    }
    const std::size_t line_end =
        text_.find('\n', ByteAt(text_, table.get("position")->source().end));
    if (line_end == std::string_view::npos)
      edits_.push_back({text_.size(), 0, fmt::format("\n{} = {}", key, value)});
    else
      edits_.push_back({line_end + 1, 0, fmt::format("{} = {}\n", key, value)});
  }

  std::string Text() {
    std::ranges::stable_sort(edits_, {}, &Edit::at);
    std::string out;
    std::size_t at = 0;
    for (const Edit& edit : edits_) {
      out += text_.substr(at, edit.at - at);
      out += edit.text;
      at = edit.at + edit.length;
    }
    return out += text_.substr(at);
  }

 private:
  std::string_view text_;
  std::vector<Edit> edits_;
};

}  // namespace

std::optional<scene::Pose> LampPlacement::WorldFromLuminaire() const {
  if (!look_at) return scene::Translation(position) * scene::RotationXyz(rotate_deg);
  const Vec3 line = *look_at - position;
  if (lightfield::Length(line) <= 1e-9 * (1 + lightfield::Length(position))) return {};
  if (lightfield::Length(up) == 0 ||
      lightfield::Length(
          lightfield::Cross(lightfield::Normalized(up), lightfield::Normalized(line))) < 1e-6)
    return {};
  return scene::LookAt(position, *look_at, up);
}

bool LampPlacement::operator==(const LampPlacement& other) const {
  return name == other.name && Same(position, other.position) &&
         look_at.has_value() == other.look_at.has_value() &&
         (!look_at || Same(*look_at, *other.look_at)) && Same(up, other.up) &&
         Same(rotate_deg, other.rotate_deg) && scale == other.scale;
}

std::vector<LampPlacement> ReadPlacements(const std::filesystem::path& scene) {
  return PlacementsOf(Parse(core::ReadFile(scene), scene.string()), scene.string());
}

std::string WithPlacements(std::string_view text, const std::vector<LampPlacement>& placements,
                           const std::string& file) {
  const toml::table root = Parse(text, file);
  const auto tables = LuminairesOf(root);
  const auto before = PlacementsOf(root, file);
  const auto same_lamp = [](const LampPlacement& a, const LampPlacement& b) {
    return a.name == b.name && a.look_at.has_value() == b.look_at.has_value();
  };
  if (!std::ranges::equal(before, placements, same_lamp))
    throw InputError(file, "has other luminaires than when it was opened",
                     "open it again, and move them there");
  Editor editor(text);
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const LampPlacement &was = before[i], &is = placements[i];
    if (!Same(was.position, is.position)) editor.Set(*tables[i], "position", Written(is.position));
    if (is.look_at && !Same(*was.look_at, *is.look_at))
      editor.Set(*tables[i], "look_at", Written(*is.look_at));
    if (!Same(was.up, is.up)) editor.Set(*tables[i], "up", Written(is.up));
    if (!Same(was.rotate_deg, is.rotate_deg))
      editor.Set(*tables[i], "rotate_deg", Written(is.rotate_deg));
    if (was.scale != is.scale) editor.Set(*tables[i], "scale", Written(is.scale));
  }
  return editor.Text();
}

void SavePlacements(const std::filesystem::path& scene,
                    const std::vector<LampPlacement>& placements) {
  const std::string text = WithPlacements(core::ReadFile(scene), placements, scene.string());
  const core::WritesAtOnce at_once;
  core::WriteFileAtomically(scene, text);
}

}  // namespace luxfield::view
