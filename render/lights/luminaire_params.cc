#include "luxfield/render/lights/luminaire_params.h"

#include <algorithm>

namespace luxfield::render {
namespace {

DoubleFloat Split(double x) {
  const auto hi = static_cast<float>(x);
  return {hi, static_cast<float>(x - hi)};
}

AxisParams MakeAxis(double origin, double direction, double texel_m, double corner_m,
                    double spacing_m, double delta_m, int count, int texels) {
  return {Split(origin),
          Split(direction * spacing_m / texel_m),
          Split(direction * delta_m / texel_m),
          Split(corner_m),
          Split(spacing_m),
          count,
          texels};
}

BasisParams MakeBasis(const lightfield::Basis& basis) {
  BasisParams params{};
  params.cells = basis.cells;
  for (int k = 0; k < basis.cells; ++k) {
    const auto& b = basis.c[k];
    const double right[3] = {b[0] + b[1] + b[2], -(b[1] + 2 * b[2]), b[2]};
    for (int power = 0; power < 3; ++power) {
      params.left[k][power] = static_cast<float>(b[power]);
      params.right[k][power] = static_cast<float>(right[power]);
    }
  }
  return params;
}

}  // namespace

LuminaireParams MakeLuminaireParams(const lightfield::LuminaireGeometry& geometry, int row_stride,
                                    const scene::Pose& world_from_luminaire) {
  const auto& grid = geometry.grid;
  const auto& lattice = geometry.lattice;
  LuminaireParams params{};
  params.axis[0] = MakeAxis((grid.u0_m - lattice.s0_m) / lattice.ds_m, 1, lattice.ds_m, grid.u0_m,
                            grid.spacing_m, geometry.delta_m, grid.width, lattice.width);
  params.axis[1] = MakeAxis((lattice.t1_m - grid.v0_m) / lattice.dt_m, -1, lattice.dt_m, grid.v0_m,
                            grid.spacing_m, geometry.delta_m, grid.height, lattice.height);
  params.basis = MakeBasis(grid.basis);
  params.delta = Split(geometry.delta_m);
  const double cells = std::max(grid.width, grid.height) + grid.basis.cells;
  params.min_z = static_cast<float>(geometry.delta_m * grid.spacing_m /
                                    std::min(lattice.ds_m, lattice.dt_m) * cells * 0x1p-29);
  const scene::Pose luminaire_from_world = world_from_luminaire.Inverse();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      params.rotation[3 * row + column] =
          static_cast<float>(luminaire_from_world.linear[row][column]);
  params.position[0] = Split(world_from_luminaire.translation.x);
  params.position[1] = Split(world_from_luminaire.translation.y);
  params.position[2] = Split(world_from_luminaire.translation.z);
  params.channels = geometry.channels;
  params.row_stride = row_stride;
  return params;
}

}  // namespace luxfield::render
