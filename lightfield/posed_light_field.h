// Light fields with frames of their own that shine together: one pair of planes shows the light of
// less than a half space, several show any luminaire's. Its radiance, flux and intensity are the
// sums over the fields.
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::lightfield {

// x_in_b = rotation * x_in_a + translation; metres.
struct RigidPose {
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major
  Vec3 translation_m;

  Vec3 Point(Vec3 p) const { return Direction(p) + translation_m; }
  Vec3 Direction(Vec3 d) const;
  Vec3 InverseDirection(Vec3 d) const;  // of a direction in frame b
  RigidPose Inverse() const;
  // Throws InputError naming `file` unless the rotation is orthonormal to 1e-6 and right-handed and
  // the translation at most 1e6 m long.
  void Validate(const std::string& file) const;
  bool operator==(const RigidPose& other) const;
};

// b_from_a after c_from_b.
RigidPose operator*(const RigidPose& c_from_b, const RigidPose& b_from_a);

struct PosedLightField {
  std::string name;  // "+z": where its axis points, for messages; unique within a luminaire
  RigidPose luminaire_from_field;
  LightField field;
};

// Sums over the fields; as the functions of one field (light_field.h).
std::array<double, 3> TotalFlux(std::span<const PosedLightField> fields);
// direction in the luminaire's frame; any but 0.
std::array<double, 3> FarFieldIntensity(std::span<const PosedLightField> fields, Vec3 direction);

// *.lf.exr of several fields (docs/formats/light-field.md): units must be equal, names unique. One
// field in the luminaire's own frame is written as WriteLightField does. Reading takes both kinds
// of file; a file of one field has one of no name at the identity. Throws InputError as
// ReadLightField.
void WriteLightFields(const std::filesystem::path& path, std::span<const PosedLightField> fields);
std::vector<PosedLightField> ReadLightFields(const std::filesystem::path& path);

}  // namespace luxfield::lightfield
