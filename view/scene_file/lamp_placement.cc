#include "luxfield/view/scene_file/lamp_placement.h"

#include <cmath>

#include "luxfield/scene/motion_path.h"

namespace luxfield::view {

using lightfield::Vec3;

double InMillimetres(double metres) { return std::round(1e3 * metres) / 1e3; }

bool Same(const Vec3& a, const Vec3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

std::optional<scene::Pose> LampPlacement::WorldFromLuminaire() const {
  if (!look_at) return scene::Translation(position) * scene::RotationXyz(rotate_deg);
  return scene::Facing(position, *look_at, up);
}

bool LampPlacement::operator==(const LampPlacement& other) const {
  return name == other.name && Same(position, other.position) &&
         look_at.has_value() == other.look_at.has_value() &&
         (!look_at || Same(*look_at, *other.look_at)) && Same(up, other.up) &&
         Same(rotate_deg, other.rotate_deg) && scale == other.scale && colour == other.colour &&
         file == other.file && tables == other.tables && model == other.model &&
         distribution == other.distribution && size_m == other.size_m;
}

}  // namespace luxfield::view
