// Lamps of a scene that are moved, turned and dimmed, with what was before.
#pragma once

#include <filesystem>
#include <vector>

#include "luxfield/view/scene_file/lamp_placement.h"

namespace luxfield::view {

class LampEditor {
 public:
  // Throws what ReadPlacements throws.
  explicit LampEditor(std::filesystem::path scene)
      : scene_(std::move(scene)), lamps_(ReadPlacements(scene_)), saved_(lamps_) {}

  const std::vector<LampPlacement>& lamps() const { return lamps_; }
  // One change of a lamp; those between Begin and End are undone together. Of a lamp that would have
  // no pose nothing changes, and false is returned.
  void Begin();
  bool Set(std::size_t lamp, const LampPlacement& placement);
  void End();
  bool CanUndo() const { return !undone_to_.empty(); }
  bool CanRedo() const { return !redone_to_.empty(); }
  void Undo();
  void Redo();
  // Whether the file says otherwise.
  bool changed() const { return lamps_ != saved_; }
  // Throws what SavePlacements throws.
  void Save();

 private:
  using Lamps = std::vector<LampPlacement>;
  std::filesystem::path scene_;
  Lamps lamps_, saved_, before_;
  std::vector<Lamps> undone_to_, redone_to_;
};

}  // namespace luxfield::view
