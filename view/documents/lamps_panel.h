// The lamps of a scene as a list, and the numbers of one of them.
#pragma once

#include <cstddef>
#include <string>

#include "luxfield/view/scene_file/lamp_editor.h"

namespace luxfield::view {

class LampsPanel {
 public:
  // Draws into the ImGui window that is begun; whether a lamp changed. Ctrl and Z undoes, Ctrl and Y
  // does it again, Ctrl and S saves.
  bool Draw(LampEditor& editor);
  // Of the lamp whose numbers stand there.
  std::size_t& chosen() { return chosen_; }
  bool handles() const { return handles_; }

 private:
  bool DrawNumbers(LampEditor& editor);
  void Save(LampEditor& editor);

  std::size_t chosen_ = 0;
  bool handles_ = true;  // in the picture
  std::string said_;     // of the last save
};

}  // namespace luxfield::view
