#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/hal/sim/world.h"
#include "luxfield/lightfield/quadrature.h"

namespace luxfield::hal::sim {
namespace {

// Inverse of the 1-D Gram matrix <B(./h - i), B(./h - k)>, integrated cell by cell.
Eigen::MatrixXd InverseGram(const lightfield::Basis& basis, int count, double spacing_m) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(count, count);
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < count; ++k)
      for (int cell = std::max(i, k); cell < std::min(i, k) + basis.cells; ++cell)
        gram(i, k) += spacing_m * lightfield::Gauss3(cell, cell + 1, [&](double x) {
                        return basis.Value(x - i) * basis.Value(x - k);
                      });
  return gram.ldlt().solve(Eigen::MatrixXd::Identity(count, count));
}

}  // namespace

std::vector<std::vector<float>> SimulatedLab::true_irradiance(
    const lightfield::LuminaireGeometry& geometry) const {
  const LabDescription& lab = world_->lab();
  if (geometry.delta_m != lab.geometry.delta_m)
    throw InputError(lab.name,
                     fmt::format("has delta = {} m, the truth is asked for delta = {} m",
                                 lab.geometry.delta_m, geometry.delta_m),
                     "use the lab's");
  const auto& grid = geometry.grid;
  std::vector<FilterPose> poses;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) poses.push_back({grid.centre(i, j), 0});
  TraceOptions options;
  options.delta_m = lab.geometry.delta_m;
  options.cell_m = grid.spacing_m;
  options.cell_origin = {grid.u0_m, grid.v0_m};
  options.u_samples_per_cell = lab.tracing.u_samples_per_cell;
  const double texel = std::max(geometry.lattice.ds_m, geometry.lattice.dt_m);
  options.s_samples_per_texel =
      lab.tracing.s_samples_per_pixel *
      std::max(1, static_cast<int>(std::lround(texel / lab.camera.pitch_m)));
  const double centre = 0.5 * grid.basis.cells;
  return TraceIrradiance(
      *lab.lamp,
      [&](Vec2 offset, int) {
        return grid.basis.Value(offset.x / grid.spacing_m + centre) *
               grid.basis.Value(offset.y / grid.spacing_m + centre);
      },
      centre * grid.spacing_m, poses, geometry.lattice,
      std::vector<LatticeWindow>(poses.size(),
                                 {0, 0, geometry.lattice.width, geometry.lattice.height}),
      options);
}

lightfield::LightField SimulatedLab::truth(const lightfield::LuminaireGeometry& geometry) const {
  const LabDescription& lab = world_->lab();
  geometry.Validate("geometry of the truth");
  if (geometry.channels != lab.channels)
    throw InputError(
        lab.name,
        fmt::format("has {} channels, the truth is asked for {}", lab.channels, geometry.channels),
        "use the lab's");
  if (const auto* field = lab.lamp->field()) {
    auto same = field->geometry;
    same.unit = geometry.unit;
    if (same == geometry) {
      lightfield::LightField copy = *field;
      copy.geometry.unit = geometry.unit;
      return copy;
    }
  }
  const auto irradiance = true_irradiance(geometry);
  const auto& grid = geometry.grid;
  const Eigen::MatrixXd gu = InverseGram(grid.basis, grid.width, grid.spacing_m);
  const Eigen::MatrixXd gv = InverseGram(grid.basis, grid.height, grid.spacing_m);
  lightfield::LightField field(geometry);
  field.provenance["truth of"] = lab.name;
  const int traced = lab.lamp->traced_channels();
  core::ParallelFor(geometry.plane_size(), 512, [&](std::size_t begin, std::size_t end) {
    Eigen::MatrixXd e(grid.width, grid.height);
    for (int channel = 0; channel < geometry.channels; ++channel) {
      const std::size_t plane = traced > 1 ? channel * geometry.plane_size() : 0;
      const double factor = lab.lamp->channel_factor(channel);
      for (std::size_t pixel = begin; pixel < end; ++pixel) {
        for (int j = 0; j < grid.height; ++j)
          for (int i = 0; i < grid.width; ++i)
            e(i, j) = factor * irradiance[grid.index(i, j)][plane + pixel];
        const Eigen::MatrixXd c = gu * e * gv.transpose();
        for (int j = 0; j < grid.height; ++j)
          for (int i = 0; i < grid.width; ++i)
            field.image(grid.index(i, j), channel)[pixel] = static_cast<float>(c(i, j));
      }
    }
  });
  return field;
}

}  // namespace luxfield::hal::sim
