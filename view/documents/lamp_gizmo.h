// Handles on the lamps of a picture: arrows along the world's axes that move one, a ring that aims
// it, dots that choose another.
#pragma once

#include <cstddef>
#include <optional>

#include "luxfield/scene/scene.h"
#include "luxfield/view/documents/document.h"
#include "luxfield/view/scene_file/lamp_handles.h"
#include "luxfield/view/scene_file/scene_editor.h"

namespace luxfield::view {

class LampGizmo {
 public:
  // Draws into the ImGui window that is begun, over the picture at `area`, and reads the mouse there
  // while `hovered`; whether a lamp changed. A drag is undone as one.
  bool Draw(const PictureRect& area, bool hovered, const scene::Camera& camera, SceneEditor& editor,
            std::size_t& chosen);
  // Whether the mouse is at a handle, so that it moves no camera.
  bool has_mouse() const { return has_mouse_; }

 private:
  enum class Handle { kX, kY, kZ, kAim };
  struct Grip {
    Handle handle;
    LampPlacement lamp;  // where it stood
    double along_m = 0;  // of the axis, where the pointer took hold of it
  };
  std::optional<Handle> HandleAt(const PictureRect& area, const scene::Camera& camera,
                                 const LampPlacement& lamp, PicturePoint pointer) const;
  void Choose(const PictureRect& area, const scene::Camera& camera, const SceneEditor& editor,
              PicturePoint pointer, std::size_t& chosen);
  bool Pull(const scene::Camera& camera, PicturePoint pointer, SceneEditor& editor,
            std::size_t chosen);
  void DrawLamp(const PictureRect& area, const scene::Camera& camera, const LampPlacement& lamp,
                std::optional<Handle> lit) const;

  std::optional<Grip> grip_;
  bool has_mouse_ = false;
};

}  // namespace luxfield::view
