// Rays of a file as lines in the frame of a light field, and what of them decides where its planes
// lie.
#pragma once

#include <array>
#include <span>

#include "luxfield/formats/ray_file.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/reconstruct/solve/flux_window.h"

namespace luxfield::reconstruct {

// A ray with dz > 0: it crosses the plane z at at_zero + z slope.
struct RayLine {
  lightfield::Vec2 at_zero, slope;
  double flux = 0, cosine = 0;  // cosine to +z
  std::array<double, 3> xyz{};  // tristimulus values, where the file has them

  lightfield::Vec2 At(double z) const { return at_zero + z * slope; }
};

// The cube of directions: a ray belongs to the face that its largest component points to (the first
// of equals), so |dx|, |dy| <= dz in the face's frame, at most 54.7 degrees from its axis.
constexpr int kFaces = 6;
constexpr int kForwardFace = 0;
const char* FaceName(int face);                            // "+z", "-z", "+x", "-x", "+y", "-y"
const lightfield::RigidPose& LuminaireFromFace(int face);  // a rotation; identity for "+z"
int FaceOf(lightfield::Vec3 direction);

// As a line in the frame of a face, where its dz must be above 0.
RayLine LineOf(const formats::Ray& ray, const lightfield::RigidPose& face_from_file);

// Where lines are narrowest: the z that minimises the variance of the crossings, weighted by
// flux cos^4 so that grazing rays do not rule; 0 for parallel light, which is as narrow everywhere.
// Means and sums about them are updated line by line (Welford, Technometrics 4, 1962).
class NarrowestZ {
 public:
  void Add(const RayLine& line);
  double z() const;

 private:
  double weight_ = 0;
  lightfield::Vec2 mean_at_zero_, mean_slope_;
  double covariance_ = 0, variance_ = 0;  // sums, of at_zero with slope and of slope
};

// Of the crossings of plane z.
RayWindows WindowsOf(std::span<const RayLine> lines, double z, double outside);

}  // namespace luxfield::reconstruct
