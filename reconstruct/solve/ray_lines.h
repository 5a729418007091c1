// Rays of a file as lines in the frame of a light field, and what of them decides where its planes
// lie.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/formats/ray_file.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::reconstruct {

// A ray with dz > 0: it crosses the plane z at at_zero + z slope.
struct RayLine {
  lightfield::Vec2 at_zero, slope;
  double flux = 0, cosine = 0;  // cosine to +z
  std::size_t ray = 0;          // number in the file

  lightfield::Vec2 At(double z) const { return at_zero + z * slope; }
};

// The cube of directions: a ray belongs to the face that its largest component points to (the first
// of equals), so |dx|, |dy| <= dz in the face's frame, at most 54.7 degrees from its axis.
constexpr int kFaces = 6;
constexpr int kForwardFace = 0;
const char* FaceName(int face);                            // "+z", "-z", "+x", "-x", "+y", "-y"
const lightfield::RigidPose& LuminaireFromFace(int face);  // a rotation; identity for "+z"
int FaceOf(lightfield::Vec3 direction);

// The rays that `takes` says yes to (given the direction in the luminaire's frame), as lines in the
// frame of the face, in the file's order. All must have dz > 0 there.
std::vector<RayLine> LinesOf(const formats::RayFile& file,
                             const lightfield::RigidPose& luminaire_from_file, int face,
                             const std::function<bool(lightfield::Vec3)>& takes);

// The z that minimises the variance of the crossings, weighted by flux cos^4 so that grazing rays
// do not rule; 0 for parallel light, which is as narrow everywhere.
double NarrowestZ(std::span<const RayLine> lines);

struct RayWindow {
  double low = 0, high = 0;
  double size() const { return high - low; }
  double middle() const { return (low + high) / 2; }
  bool Holds(double x) const { return x >= low && x <= high; }
};

// Along x and y of the crossings of plane z: the intervals between the flux quantiles `outside` and
// 1 - `outside`; all crossings of rays with flux for 0.
struct RayWindows {
  RayWindow x, y;
};
RayWindows FluxWindows(std::span<const RayLine> lines, double z, double outside);

// The same of slopes.
RayWindows SlopeWindows(std::span<const RayLine> lines, double outside);

}  // namespace luxfield::reconstruct
