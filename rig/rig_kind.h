// The two kinds of bench (docs/theory.md 3).
#pragma once

#include <string>

namespace luxfield::rig {

// Lensless: the sensor lies in the image plane. Reflector: a camera looks at a screen there.
enum class RigKind { kLensless, kReflector };

// As plan.toml, lab.toml and plan.json have it.
inline std::string RigKindName(RigKind kind) {
  return kind == RigKind::kLensless ? "lensless" : "reflector";
}

}  // namespace luxfield::rig
