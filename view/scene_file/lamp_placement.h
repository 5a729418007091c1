// A luminaire of a scene.toml (docs/formats/scene.md) as that file says it: with a point that it
// looks at, or with a rotation; a light field, or a classical light.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "luxfield/scene/transform.h"

namespace luxfield::view {

struct LampPlacement {
  std::string name;
  lightfield::Vec3 position;
  std::optional<lightfield::Vec3> look_at = {};  // else rotate_deg holds
  lightfield::Vec3 up{0, 0, 1};                  // with look_at
  lightfield::Vec3 rotate_deg = {};
  double scale = 1;
  std::array<double, 3> colour = {1, 1, 1};
  // Of a light field, as the file has them; tables empty: none are named.
  std::string file = {}, tables = {};
  // Of a classical light instead, likewise: "point", "linear" or "area", its photometric file and
  // its size; model empty: it is a light field.
  std::string model = {}, distribution = {};
  std::optional<std::array<double, 2>> size_m = {};

  bool IsClassical() const { return !model.empty(); }
  // Empty where look_at is the position, or the line between them parallel to `up`.
  std::optional<scene::Pose> WorldFromLuminaire() const;
  bool operator==(const LampPlacement& other) const;
};

// Metres to whole millimetres: what hands move, the file says without further digits.
double InMillimetres(double metres);

bool Same(const lightfield::Vec3& a, const lightfield::Vec3& b);

}  // namespace luxfield::view
