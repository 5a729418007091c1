// A scene's file under hands: lamps moved, copied and exchanged, materials, environment and saved
// views, with what was before.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "luxfield/view/scene_file/scene_edits.h"

namespace luxfield::view {

class SceneEditor {
 public:
  // Of the scene that was read from its file. Throws what ReadSceneEdits throws.
  explicit SceneEditor(const scene::Scene& scene);

  const SceneEdits& edits() const { return now_; }
  // Luminaires in the file's order, classical lights among them. Empty of scenes that stand any in
  // arrays, which have fewer places to write than lamps.
  const std::vector<LampPlacement>& lamps() const { return now_.lamps; }
  const std::filesystem::path& file() const { return file_; }

  // Changes between Begin and End are undone together. Of a lamp that would have no pose nothing
  // changes, and false is returned.
  void Begin() { before_ = now_; }
  bool Set(std::size_t lamp, const LampPlacement& placement);
  void Set(std::size_t material, const MaterialNumbers& numbers);
  void Set(const EnvironmentNumbers& environment) { now_.environment = environment; }
  void End();

  // Each of these is undone by itself. The new lamp is the last one, `offset` away, and aims as far
  // beside where the other does.
  void Duplicate(std::size_t lamp, const lightfield::Vec3& offset);
  // The last lamp stays.
  bool Remove(std::size_t lamp);
  // The lamp with another light field; the tables that it named belong to the old one. Classical
  // lights have none, and stay as they are.
  void Exchange(std::size_t lamp, const std::string& light_field);
  // Of that name; one that is there is replaced.
  void Keep(const SavedView& view);
  void DropView(std::size_t view);

  bool CanUndo() const { return !undone_to_.empty(); }
  bool CanRedo() const { return !redone_to_.empty(); }
  void Undo();
  void Redo();
  // Whether the file says otherwise.
  bool changed() const { return now_ != saved_; }
  // Throws what SaveSceneEdits throws.
  void Save();
  int saves() const { return saves_; }  // that were done

  // The scene with all changes, and its materials (view/scene_file/scene_edits.h).
  scene::Scene Apply(const scene::Scene& read) const { return Edited(read, read_, now_); }
  std::vector<scene::Material> MaterialsOf(const scene::Scene& read) const {
    return EditedMaterials(read, now_);
  }

 private:
  std::filesystem::path file_;
  SceneEdits read_, saved_, now_;
  std::optional<SceneEdits> before_;
  int saves_ = 0;
  std::vector<SceneEdits> undone_to_, redone_to_;
};

// Light fields in the scene's folder and in those of its lamps, as scene.toml names them.
std::set<std::string> LightFieldsNear(const SceneEditor& editor);

}  // namespace luxfield::view
