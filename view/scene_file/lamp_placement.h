// Where a scene.toml stands its luminaires (docs/formats/scene.md), as that file says it: with a point
// that they look at, or with a rotation.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/scene/transform.h"

namespace luxfield::view {

struct LampPlacement {
  std::string name;
  lightfield::Vec3 position;
  std::optional<lightfield::Vec3> look_at;  // else rotate_deg holds
  lightfield::Vec3 up{0, 0, 1};             // with look_at
  lightfield::Vec3 rotate_deg;
  double scale = 1;

  // Empty where look_at is the position, or the line between them parallel to `up`.
  std::optional<scene::Pose> WorldFromLuminaire() const;
  bool operator==(const LampPlacement& other) const;
};

// In the file's order. Throws InputError.
std::vector<LampPlacement> ReadPlacements(const std::filesystem::path& scene);

// The text of a scene.toml with these luminaires where `placements` have them: values that differ are
// written in place of those that stood there, keys that were absent on a line of their own below
// `position`; every other byte, comments among them, stays. Throws InputError, naming `file`, where
// the text has other luminaires.
std::string WithPlacements(std::string_view text, const std::vector<LampPlacement>& placements,
                           const std::string& file);

// Writes that into the file, at once (core/file.h). Throws InputError, DeviceError.
void SavePlacements(const std::filesystem::path& scene,
                    const std::vector<LampPlacement>& placements);

}  // namespace luxfield::view
