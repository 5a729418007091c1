// Frames: b_from_a maps points, vectors and normals given in frame a to frame b.
#pragma once

#include <array>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::scene {

using lightfield::Vec3;

// x_in_b = linear * x_in_a + translation. linear[row][column].
struct Transform {
  std::array<std::array<double, 3>, 3> linear{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vec3 translation;

  Vec3 Point(Vec3 p) const { return Vector(p) + translation; }
  Vec3 Vector(Vec3 v) const {
    const auto row = [&](int i) {
      return linear[i][0] * v.x + linear[i][1] * v.y + linear[i][2] * v.z;
    };
    return {row(0), row(1), row(2)};
  }
  // Unit normal of the transformed surface: inverse transpose, also right under non-uniform scale
  // and mirroring.
  Vec3 Normal(Vec3 n) const;
  double Determinant() const;
  Transform Inverse() const;  // the linear part must be regular
};

// c_from_a = c_from_b * b_from_a.
Transform operator*(const Transform& c_from_b, const Transform& b_from_a);

// A Transform whose linear part is a rotation: where a luminaire or a camera stands.
using Pose = Transform;

// Rotation about x, then y, then z of the fixed frame, right-handed, degrees: R = Rz Ry Rx.
Transform RotationXyz(Vec3 degrees);
Transform Scaling(Vec3 factors);
Transform Translation(Vec3 offset);

// The pose with its origin at `position`, +z towards `target` and +y as near to `up` as that allows
// (x = up x z). A luminaire shines along its +z. `position` and `target` must differ, `up` must not
// be parallel to their line.
Pose LookAt(Vec3 position, Vec3 target, Vec3 up);

}  // namespace luxfield::scene
