#include "luxfield/preprocess/scene_receivers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/core/random.h"
#include "luxfield/scene/ray_caster.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Dot;
using lightfield::Vec3;

Vec3 ToVec3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

// The corners of the part of a triangle with z >= near.
std::vector<Vec3> ClipInFront(const std::array<Vec3, 3>& triangle, double near) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 3; ++k) {
    const Vec3 a = triangle[k], b = triangle[(k + 1) % 3];
    if (a.z >= near) corners.push_back(a);
    if ((a.z >= near) != (b.z >= near))
      corners.push_back(a + ((near - a.z) / (b.z - a.z)) * (b - a));
  }
  return corners;
}

// Texels of one axis in the windows of all basis functions, clipped to the lattice.
double TexelsOfAxis(double corner_m, const lightfield::BasisGrid& grid, int count, double edge_m,
                    double texel_m, int texels, double tau, double p_m) {
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    const double a = (tau * p_m + (1 - tau) * (corner_m + i * grid.spacing_m) - edge_m) / texel_m;
    const double b = a + (1 - tau) * grid.basis.cells * grid.spacing_m / texel_m;
    const auto limit = static_cast<double>(texels);
    sum += std::clamp(std::ceil(std::max(a, b)), 0.0, limit) -
           std::clamp(std::floor(std::min(a, b)), 0.0, limit);
  }
  return sum;
}

}  // namespace

std::vector<Receiver> PictureReceivers(const scene::Scene& scene,
                                       const scene::Pose& world_from_luminaire, int count,
                                       std::uint64_t seed) {
  const scene::RayCaster caster(scene.geometry);
  const scene::Pose luminaire_from_world = world_from_luminaire.Inverse();
  core::Random random(seed, 0);
  std::vector<Receiver> receivers;
  for (int k = 0; k < count; ++k) {
    const double column = scene.camera.width * random.Uniform(),
                 row = scene.camera.height * random.Uniform();
    const Vec3 direction = scene.camera.Direction(column, row);
    const auto hit = caster.Intersect({scene.camera.position, direction});
    if (!hit) continue;
    const auto& g = scene.geometry;
    const Vec3 a = ToVec3(g.corner(hit->triangle, 0)), b = ToVec3(g.corner(hit->triangle, 1)),
               c = ToVec3(g.corner(hit->triangle, 2));
    const Vec3 p = a + hit->b * (b - a) + hit->c * (c - a);
    Vec3 n = lightfield::Normalized(Cross(b - a, c - a));
    if (Dot(n, direction) > 0) n = -1.0 * n;
    const Receiver receiver{luminaire_from_world.Point(p), luminaire_from_world.Vector(n)};
    if (receiver.p.z > 0) receivers.push_back(receiver);
  }
  return receivers;
}

void SeenRectangle::Add(const SeenRectangle& other) {
  if (other.empty()) return;
  if (empty()) {
    *this = other;
    return;
  }
  s0_m = std::min(s0_m, other.s0_m);
  s1_m = std::max(s1_m, other.s1_m);
  t0_m = std::min(t0_m, other.t0_m);
  t1_m = std::max(t1_m, other.t1_m);
}

SeenRectangle SeenByTriangles(const scene::Geometry& geometry,
                              const lightfield::LuminaireGeometry& luminaire,
                              const scene::Pose& world_from_luminaire) {
  const auto& grid = luminaire.grid;
  const double u0 = grid.u0_m, u1 = u0 + (grid.width + grid.basis.cells - 1) * grid.spacing_m;
  const double v0 = grid.v0_m, v1 = v0 + (grid.height + grid.basis.cells - 1) * grid.spacing_m;
  const scene::Pose luminaire_from_world = world_from_luminaire.Inverse();
  SeenRectangle seen;
  for (std::size_t triangle = 0; triangle < geometry.triangles.size(); ++triangle) {
    std::array<Vec3, 3> corners;
    for (int k = 0; k < 3; ++k)
      corners[k] = luminaire_from_world.Point(ToVec3(geometry.corner(triangle, k)));
    for (const Vec3 p : ClipInFront(corners, 1e-3 * luminaire.delta_m)) {
      const double tau = luminaire.delta_m / p.z;
      const double s[2] = {tau * p.x + (1 - tau) * u0, tau * p.x + (1 - tau) * u1};
      const double t[2] = {tau * p.y + (1 - tau) * v0, tau * p.y + (1 - tau) * v1};
      seen.Add(
          {std::min(s[0], s[1]), std::max(s[0], s[1]), std::min(t[0], t[1]), std::max(t[0], t[1])});
    }
  }
  return seen;
}

double TexelsSeen(const lightfield::LuminaireGeometry& luminaire, Vec3 p) {
  const auto& grid = luminaire.grid;
  const auto& lattice = luminaire.lattice;
  const double tau = luminaire.delta_m / p.z;
  return TexelsOfAxis(grid.u0_m, grid, grid.width, lattice.s0_m, lattice.ds_m, lattice.width, tau,
                      p.x) *
         TexelsOfAxis(grid.v0_m, grid, grid.height, lattice.t1_m - lattice.extent_t_m(),
                      lattice.dt_m, lattice.height, tau, p.y);
}

}  // namespace luxfield::preprocess
