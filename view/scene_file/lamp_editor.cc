#include "luxfield/view/scene_file/lamp_editor.h"

#include <utility>

namespace luxfield::view {

void LampEditor::Begin() { before_ = lamps_; }

bool LampEditor::Set(std::size_t lamp, const LampPlacement& placement) {
  if (!placement.WorldFromLuminaire()) return false;
  lamps_.at(lamp) = placement;
  return true;
}

void LampEditor::End() {
  if (before_.empty() || before_ == lamps_) return;
  undone_to_.push_back(std::exchange(before_, {}));
  redone_to_.clear();
}

void LampEditor::Undo() {
  if (!CanUndo()) return;
  redone_to_.push_back(std::exchange(lamps_, undone_to_.back()));
  undone_to_.pop_back();
}

void LampEditor::Redo() {
  if (!CanRedo()) return;
  undone_to_.push_back(std::exchange(lamps_, redone_to_.back()));
  redone_to_.pop_back();
}

void LampEditor::Save() {
  SavePlacements(scene_, lamps_);
  saved_ = lamps_;
}

}  // namespace luxfield::view
