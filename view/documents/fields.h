// Fields of numbers in panels, whose changes between taking hold and letting go are undone together.
#pragma once

#include <array>

#include "luxfield/scene/transform.h"
#include "luxfield/view/scene_file/scene_editor.h"

namespace luxfield::view {

// Fields of one thing: begins the editor's step when one is taken hold of, and ends it when one is let
// go, once End is called.
class Fields {
 public:
  explicit Fields(SceneEditor& editor) : editor_(editor) {}

  void Drag(const char* name, double& value, float step, double low, double high,
            const char* format, const char* tip);
  // From 0 to `high`, of any size: what a pixel changes is a share of it.
  void Factor(const char* name, double& value, double high, const char* tip);
  void Drag(const char* name, lightfield::Vec3& v, float step, double limit, const char* format,
            const char* tip);
  void Colour(const char* name, std::array<double, 3>& linear, const char* tip);
  // Factors of a light's channels, any from 0, behind a swatch by which their ratios are chosen: the
  // largest stays what it is.
  void Tint(const char* name, std::array<double, 3>& factors, double high, const char* tip);

  bool changed() const { return changed_; }
  // Behind the last field, and behind what the editor was told.
  void End() {
    if (ended_) editor_.End();
  }

 private:
  void See(bool changed, const char* tip = nullptr);

  SceneEditor& editor_;
  bool changed_ = false, ended_ = false;
};

}  // namespace luxfield::view
