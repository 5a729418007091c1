#include "luxfield/reconstruct/solve/ray_lines.h"

#include <array>
#include <cmath>

namespace luxfield::reconstruct {
namespace {

using lightfield::RigidPose;
using lightfield::Vec2;
using lightfield::Vec3;

struct Face {
  const char* name;
  RigidPose luminaire_from_face;
};

// Rows: what the luminaire's x, y, z are in the face's frame.
const std::array<Face, kFaces> kCube{{
    {"+z", {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}}},
    {"-z", {{1, 0, 0, 0, -1, 0, 0, 0, -1}, {}}},
    {"+x", {{0, 0, 1, 1, 0, 0, 0, 1, 0}, {}}},
    {"-x", {{0, 0, -1, -1, 0, 0, 0, 1, 0}, {}}},
    {"+y", {{0, 1, 0, 0, 0, 1, 1, 0, 0}, {}}},
    {"-y", {{1, 0, 0, 0, 0, -1, 0, 1, 0}, {}}},
}};

}  // namespace

const char* FaceName(int face) { return kCube[static_cast<std::size_t>(face)].name; }

const RigidPose& LuminaireFromFace(int face) {
  return kCube[static_cast<std::size_t>(face)].luminaire_from_face;
}

int FaceOf(Vec3 d) {
  const double x = std::abs(d.x), y = std::abs(d.y), z = std::abs(d.z);
  if (z >= x && z >= y) return d.z > 0 ? 0 : 1;
  if (x >= y) return d.x > 0 ? 2 : 3;
  return d.y > 0 ? 4 : 5;
}

RayLine LineOf(const formats::Ray& ray, const RigidPose& face_from_file) {
  const Vec3 p = face_from_file.Point(ray.position_m);
  const Vec3 d = face_from_file.Direction(ray.direction);
  const Vec2 slope{d.x / d.z, d.y / d.z};
  RayLine line{Vec2{p.x, p.y} - p.z * slope, slope, ray.flux, d.z / Length(d)};
  if (ray.tristimulus) line.xyz = *ray.tristimulus;
  return line;
}

void NarrowestZ::Add(const RayLine& line) {
  const double w = line.flux * std::pow(line.cosine, 4);
  if (!(w > 0)) return;
  weight_ += w;
  const Vec2 da = line.at_zero - mean_at_zero_, dm = line.slope - mean_slope_;
  mean_at_zero_ = mean_at_zero_ + (w / weight_) * da;
  mean_slope_ = mean_slope_ + (w / weight_) * dm;
  const Vec2 off = line.slope - mean_slope_;
  covariance_ += w * (da.x * off.x + da.y * off.y);
  variance_ += w * (dm.x * off.x + dm.y * off.y);
}

double NarrowestZ::z() const {
  return variance_ > 1e-12 * weight_ ? 0 - covariance_ / variance_ : 0;  // 0 - x: no negative zero
}

RayWindows WindowsOf(std::span<const RayLine> lines, double z, double outside) {
  FluxWindows windows(outside);
  do {
    for (const RayLine& line : lines) windows.Add(line.At(z), line.flux);
  } while (windows.EndPass());
  return windows.windows();
}

}  // namespace luxfield::reconstruct
