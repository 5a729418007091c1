// Which part of a luminaire's light a scene can see.
#pragma once

#include <cstdint>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/preprocess/light_vector_volume.h"
#include "luxfield/scene/scene.h"

namespace luxfield::preprocess {

// Surfaces behind random places of the camera's picture, in front of the luminaire (z > 0): the
// receivers over which the relative RMSE of the picture is taken; normals are on the eye's side.
// Fewer than `count` where rays
// miss or hit behind the luminaire. CPU ray queries, deterministic in `seed`.
std::vector<Receiver> PictureReceivers(const scene::Scene& scene,
                                       const scene::Pose& world_from_luminaire, int count,
                                       std::uint64_t seed);

// The rectangle of I that receivers see through the supports, in metres; empty (s0 > s1) if none
// does.
struct SeenRectangle {
  double s0_m = 1, s1_m = -1, t0_m = 1, t1_m = -1;

  bool empty() const { return s0_m > s1_m; }
  void Add(const SeenRectangle& other);
};

// The union over all points of all triangles in front of the luminaire, nearer than delta / 1000 to
// F left out. s(u) = (delta / z) p + (1 - delta / z) u is linear-fractional in p, so its extremes
// over a triangle lie at the corners of the part in front (docs/theory.md 6 and 7.2).
SeenRectangle SeenByTriangles(const scene::Geometry& geometry,
                              const lightfield::LuminaireGeometry& luminaire,
                              const scene::Pose& world_from_luminaire);

// Texels in the windows through which a receiver at p (luminaire frame, z > 0) sees the basis
// functions, all images together: what a closed form reads per channel.
double TexelsSeen(const lightfield::LuminaireGeometry& luminaire, lightfield::Vec3 p);

}  // namespace luxfield::preprocess
