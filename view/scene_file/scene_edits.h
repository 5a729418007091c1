// What is changed by hand in a scene.toml (docs/formats/scene.md): its luminaires, materials,
// environment and saved views, as the file says them.
//
//   SceneEdits edits = ReadSceneEdits("scene.toml");
//   edits.lamps[0].scale = 0.5;
//   SaveSceneEdits("scene.toml", ReadSceneEdits("scene.toml"), edits);
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/scene/scene.h"
#include "luxfield/view/scene_file/lamp_placement.h"

namespace luxfield::view {

// The numbers of a [[material]]; those of its kind hold.
struct MaterialNumbers {
  std::string name;
  scene::MaterialKind kind = scene::MaterialKind::kLambert;
  std::array<double, 3> albedo{}, specular{};  // linear Rec. 709, 0 to 1
  double exponent = 0, metallic = 0, roughness = 1;
  bool operator==(const MaterialNumbers& other) const = default;
};

struct EnvironmentNumbers {
  lightfield::Vec3 rotate_deg;
  double scale = 1;
  bool operator==(const EnvironmentNumbers& other) const;
};

// A [[view]]: a camera with a name.
struct SavedView {
  std::string name;
  lightfield::Vec3 position, look_at, up{0, 0, 1};
  double vertical_fov_deg = 40;
  bool operator==(const SavedView& other) const;
};

// Of a camera that looks at what lies `distance_m` ahead, to tenths of millimetres.
SavedView ViewFrom(const scene::Camera& camera, double distance_m, const std::string& name);
// With as many pixels as `like`.
scene::Camera CameraOf(const SavedView& view, const scene::Camera& like);

struct SceneEdits {
  std::vector<LampPlacement> lamps;  // names are unique
  std::vector<MaterialNumbers> materials;
  std::optional<EnvironmentNumbers> environment;
  std::vector<SavedView> views;  // likewise
  bool operator==(const SceneEdits& other) const = default;
};

// In the file's order. Throws InputError.
SceneEdits ReadSceneEdits(const std::filesystem::path& scene);

// The text of a scene.toml that said `was` as it says `is`: values that differ are written in place of
// those that stood there, keys that were absent on a line of their own, luminaires and views that are
// new at the end; those that are gone are left out. Every other byte, comments among them, stays.
// Throws InputError, naming `file`, where the text has other luminaires, materials or views than
// `was`, or is written in a way (inline tables) that cannot be changed like that.
std::string WithEdits(const std::string& text, const SceneEdits& was, const SceneEdits& is,
                      const std::string& file);

// Writes that into the file, at once (core/file.h). Throws InputError, DeviceError.
void SaveSceneEdits(const std::filesystem::path& scene, const SceneEdits& was,
                    const SceneEdits& is);

// A scene that was read from a file which said `was`, as it would be read if that said `is`. Scenes
// that stand luminaires in arrays keep theirs.
scene::Scene Edited(const scene::Scene& scene, const SceneEdits& was, const SceneEdits& is);

// Its materials alone.
std::vector<scene::Material> EditedMaterials(const scene::Scene& scene, const SceneEdits& is);

// Whether both have the same lamps with the same light fields, wherever these stand.
bool SameLamps(const SceneEdits& a, const SceneEdits& b);

}  // namespace luxfield::view
