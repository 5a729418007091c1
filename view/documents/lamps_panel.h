// The lamps of a scene as a list, the numbers of one of them, and what can be done with it.
#pragma once

#include <cstddef>
#include <string>

#include "luxfield/view/scene_file/lamp_handles.h"
#include "luxfield/view/scene_file/scene_editor.h"

namespace luxfield::view {

class LampsPanel {
 public:
  // Draws into the ImGui window that is begun; whether a lamp changed. A lamp that is copied stands
  // beside the other as this camera sees them. Ctrl and D copies, G hides the handles.
  bool Draw(const scene::Camera& camera, SceneEditor& editor);
  // Of the lamp whose numbers stand there; one of those that there are.
  std::size_t& chosen() { return chosen_; }
  bool handles() const { return handles_; }

 private:
  bool DrawNumbers(SceneEditor& editor);
  bool DrawSwitch(SceneEditor& editor);
  bool DrawFile(SceneEditor& editor);
  static void DrawDistribution(const LampPlacement& lamp);
  bool DrawMirror(SceneEditor& editor);
  bool DrawActions(const scene::Camera& camera, SceneEditor& editor);
  void Duplicate(const scene::Camera& camera, SceneEditor& editor);

  std::size_t chosen_ = 0;
  bool handles_ = true;     // in the picture
  double switched_on_ = 1;  // the scale of the lamp that was switched off last
  Axis mirror_ = Axis::kX;
  double mirror_at_m_ = 0;
  std::string typed_file_;
};

}  // namespace luxfield::view
