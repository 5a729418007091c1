#include "luxfield/scene/transform.h"

#include <cmath>
#include <numbers>

namespace luxfield::scene {
namespace {

// Matrix of cofactors: det * inverse transpose.
std::array<std::array<double, 3>, 3> Cofactors(const std::array<std::array<double, 3>, 3>& m) {
  std::array<std::array<double, 3>, 3> out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      out[i][j] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
    }
  return out;
}

Transform Rotation(int axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  Transform out;
  out.linear[a][a] = out.linear[b][b] = std::cos(angle);
  out.linear[b][a] = std::sin(angle);
  out.linear[a][b] = -std::sin(angle);
  return out;
}

}  // namespace

double Transform::Determinant() const {
  const auto cofactors = Cofactors(linear);
  return linear[0][0] * cofactors[0][0] + linear[0][1] * cofactors[0][1] +
         linear[0][2] * cofactors[0][2];
}

Vec3 Transform::Normal(Vec3 n) const {
  const Transform cofactors{Cofactors(linear), {}};
  const double sign = Determinant() < 0 ? -1 : 1;
  return lightfield::Normalized(sign * cofactors.Vector(n));
}

Transform Transform::Inverse() const {
  const auto cofactors = Cofactors(linear);
  const double scale = 1 / Determinant();
  Transform out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.linear[i][j] = scale * cofactors[j][i];
  out.translation = -1.0 * out.Vector(translation);
  return out;
}

Transform operator*(const Transform& c_from_b, const Transform& b_from_a) {
  Transform out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      out.linear[i][j] = 0;
      for (int k = 0; k < 3; ++k) out.linear[i][j] += c_from_b.linear[i][k] * b_from_a.linear[k][j];
    }
  out.translation = c_from_b.Point(b_from_a.translation);
  return out;
}

Transform RotationXyz(Vec3 degrees) {
  return Rotation(2, degrees.z) * Rotation(1, degrees.y) * Rotation(0, degrees.x);
}

Transform Scaling(Vec3 factors) {
  Transform out;
  out.linear[0][0] = factors.x;
  out.linear[1][1] = factors.y;
  out.linear[2][2] = factors.z;
  return out;
}

Transform Translation(Vec3 offset) {
  Transform out;
  out.translation = offset;
  return out;
}

Pose LookAt(Vec3 position, Vec3 target, Vec3 up) {
  const Vec3 z = lightfield::Normalized(target - position);
  const Vec3 x = lightfield::Normalized(lightfield::Cross(up, z));
  const Vec3 y = lightfield::Cross(z, x);
  return {{{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}}, position};
}

}  // namespace luxfield::scene
