#include "luxfield/lightfield/posed_light_field.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/core/error.h"

namespace luxfield::lightfield {

Vec3 RigidPose::Direction(Vec3 d) const {
  const auto& r = rotation;
  return {r[0] * d.x + r[1] * d.y + r[2] * d.z, r[3] * d.x + r[4] * d.y + r[5] * d.z,
          r[6] * d.x + r[7] * d.y + r[8] * d.z};
}

Vec3 RigidPose::InverseDirection(Vec3 d) const {
  const auto& r = rotation;
  return {r[0] * d.x + r[3] * d.y + r[6] * d.z, r[1] * d.x + r[4] * d.y + r[7] * d.z,
          r[2] * d.x + r[5] * d.y + r[8] * d.z};
}

RigidPose RigidPose::Inverse() const {
  const auto& r = rotation;
  const Vec3 t = InverseDirection(translation_m);
  return {{r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]}, {0 - t.x, 0 - t.y, 0 - t.z}};
}

void RigidPose::Validate(const std::string& file) const {
  constexpr double kOrthonormal = 1e-6, kFarthest_m = 1e6;
  const auto row = [&](int i) {
    return Vec3{rotation[3 * i], rotation[3 * i + 1], rotation[3 * i + 2]};
  };
  const Vec3 x = row(0), y = row(1), z = row(2);
  // Of a right-handed orthonormal frame the third row is the cross product of the others.
  const double off = std::abs(Length(x) - 1) + std::abs(Length(y) - 1) + std::abs(Dot(x, y)) +
                     Length(Cross(x, y) - z);
  if (!(off <= kOrthonormal))
    throw InputError(file, "the rotation of a pose is not a right-handed rotation",
                     "give three orthonormal rows");
  const Vec3 t = translation_m;
  if (!(Length(t) <= kFarthest_m))
    throw InputError(
        file,
        fmt::format("the translation ({}, {}, {}) m of a pose is not within 1e6 m", t.x, t.y, t.z),
        "give metres");
}

bool RigidPose::operator==(const RigidPose& other) const {
  return rotation == other.rotation && translation_m.x == other.translation_m.x &&
         translation_m.y == other.translation_m.y && translation_m.z == other.translation_m.z;
}

RigidPose operator*(const RigidPose& c_from_b, const RigidPose& b_from_a) {
  RigidPose product;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      double& entry = product.rotation[3 * row + column] = 0;
      for (int k = 0; k < 3; ++k)
        entry += c_from_b.rotation[3 * row + k] * b_from_a.rotation[3 * k + column];
    }
  product.translation_m = c_from_b.Point(b_from_a.translation_m);
  return product;
}

std::array<double, 3> TotalFlux(std::span<const PosedLightField> fields) {
  std::array<double, 3> sum{};
  for (const PosedLightField& posed : fields) {
    const auto flux = TotalFlux(posed.field);
    for (int channel = 0; channel < 3; ++channel) sum[channel] += flux[channel];
  }
  return sum;
}

std::array<double, 3> FarFieldIntensity(std::span<const PosedLightField> fields, Vec3 direction) {
  std::array<double, 3> sum{};
  for (const PosedLightField& posed : fields) {
    const auto intensity =
        FarFieldIntensity(posed.field, posed.luminaire_from_field.InverseDirection(direction));
    for (int channel = 0; channel < 3; ++channel) sum[channel] += intensity[channel];
  }
  return sum;
}

}  // namespace luxfield::lightfield
