#include "luxfield/view/scene_file/scene_editor.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "luxfield/core/descriptor.h"

namespace luxfield::view {
namespace {

std::string FreeName(const std::vector<LampPlacement>& lamps, const std::string& name) {
  for (int number = 2;; ++number) {
    std::string free = fmt::format("{} {}", name, number);
    if (std::ranges::find(lamps, free, &LampPlacement::name) == lamps.end()) return free;
  }
}

}  // namespace

SceneEditor::SceneEditor(const scene::Scene& scene)
    : file_(scene.file), read_(ReadSceneEdits(scene.file)) {
  if (read_.lamps.size() != scene.luminaires.size() + scene.classical_lights.size())
    read_.lamps.clear();
  saved_ = now_ = read_;
}

bool SceneEditor::Set(std::size_t lamp, const LampPlacement& placement) {
  if (!placement.WorldFromLuminaire()) return false;
  now_.lamps.at(lamp) = placement;
  return true;
}

void SceneEditor::Set(std::size_t material, const MaterialNumbers& numbers) {
  now_.materials.at(material) = numbers;
}

void SceneEditor::End() {
  if (!before_ || *before_ == now_) return;
  undone_to_.push_back(*std::exchange(before_, {}));
  redone_to_.clear();
}

void SceneEditor::Duplicate(std::size_t lamp, const lightfield::Vec3& offset) {
  Begin();
  LampPlacement copy = now_.lamps.at(lamp);
  copy.name = FreeName(now_.lamps, copy.name);
  copy.position = copy.position + offset;
  if (copy.look_at) copy.look_at = *copy.look_at + offset;
  now_.lamps.push_back(copy);
  End();
}

bool SceneEditor::Remove(std::size_t lamp) {
  if (now_.lamps.size() < 2) return false;
  Begin();
  now_.lamps.erase(now_.lamps.begin() + static_cast<std::ptrdiff_t>(lamp));
  End();
  return true;
}

void SceneEditor::Exchange(std::size_t lamp, const std::string& light_field) {
  if (now_.lamps.at(lamp).IsClassical()) return;
  Begin();
  now_.lamps.at(lamp).file = light_field;
  now_.lamps[lamp].tables.clear();
  End();
}

void SceneEditor::Keep(const SavedView& view) {
  Begin();
  const auto same = std::ranges::find(now_.views, view.name, &SavedView::name);
  if (same == now_.views.end())
    now_.views.push_back(view);
  else
    *same = view;
  End();
}

void SceneEditor::DropView(std::size_t view) {
  Begin();
  now_.views.erase(now_.views.begin() + static_cast<std::ptrdiff_t>(view));
  End();
}

void SceneEditor::Undo() {
  if (!CanUndo()) return;
  redone_to_.push_back(std::exchange(now_, undone_to_.back()));
  undone_to_.pop_back();
}

void SceneEditor::Redo() {
  if (!CanRedo()) return;
  undone_to_.push_back(std::exchange(now_, redone_to_.back()));
  redone_to_.pop_back();
}

void SceneEditor::Save() {
  SaveSceneEdits(file_, saved_, now_);
  saved_ = now_;
  ++saves_;
}

std::set<std::string> LightFieldsNear(const SceneEditor& editor) {
  namespace fs = std::filesystem;
  std::set<std::string> names;
  const auto look = [&](const fs::path& relative) {
    std::error_code unreadable;
    for (const auto& entry :
         fs::directory_iterator(core::FolderOf(editor.file()) / relative, unreadable))
      if (entry.path().string().ends_with(".lf.exr"))
        names.insert((relative / entry.path().filename()).string());
  };
  look("");
  for (const LampPlacement& lamp : editor.lamps()) look(fs::path(lamp.file).parent_path());
  return names;
}

}  // namespace luxfield::view
