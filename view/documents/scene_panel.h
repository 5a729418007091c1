// What can be changed of a scene's file beside its lamps: materials and environment by numbers, saved
// views; and undoing, doing again and saving all of it.
#pragma once

#include <optional>
#include <string>

#include "luxfield/view/lighting/camera_control.h"
#include "luxfield/view/scene_file/scene_editor.h"

namespace luxfield::view {

// Each draws into the ImGui window that is begun, and says whether something changed that is lit.
class ScenePanel {
 public:
  // Undo, redo and save, and what the last save said. Ctrl and Z undoes, Ctrl and Y does it again,
  // Ctrl and S saves.
  bool DrawHistory(SceneEditor& editor);
  bool DrawEnvironment(SceneEditor& editor);
  bool DrawMaterials(SceneEditor& editor);
  // The view that is to be gone to, if one was chosen.
  std::optional<SavedView> DrawViews(const CameraControl& camera, SceneEditor& editor);

  // Into the scene's file; whether it could.
  bool Save(SceneEditor& editor);
  // Of what could not be done.
  void Say(std::string sentence) { said_ = std::move(sentence); }
  // As DrawHistory does, where there is nothing to edit.
  void DrawSaid() const;

 private:
  std::size_t material_ = 0;
  std::string view_name_;
  std::string said_;
};

}  // namespace luxfield::view
