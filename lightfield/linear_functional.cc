#include "luxfield/lightfield/linear_functional.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/lightfield/projected_texels.h"

namespace luxfield::lightfield {
namespace {

// Share of a channel in Q.
double ChannelWeight(const LuminaireGeometry& geometry, int channel) {
  return geometry.channels == 1 ? 1 : core::kLuminanceWeights[static_cast<std::size_t>(channel)];
}

// Calls set(channel weight, start of the image in LightField::data) for every channel of image m.
template <typename F>
void ForChannels(const LuminaireGeometry& geometry, int m, F&& set) {
  for (int channel = 0; channel < geometry.channels; ++channel)
    set(ChannelWeight(geometry, channel),
        (static_cast<std::size_t>(m) * geometry.channels + channel) * geometry.plane_size());
}

}  // namespace

Weights RadianceWeights(const LuminaireGeometry& geometry, Vec2 u, Vec2 s) {
  Weights weights(geometry.value_count(), 0.0);
  const Lattice& lattice = geometry.lattice;
  const double column = std::floor(lattice.column_of_s(s.x)),
               row = std::floor(lattice.row_of_t(s.y));
  if (!(column >= 0 && column < lattice.width && row >= 0 && row < lattice.height)) return weights;
  const auto texel = static_cast<std::size_t>(row * lattice.width + column);
  const double cosine = CosTheta(geometry.delta_m, u, s), d = geometry.delta_m / (cosine * cosine);
  for (int j = 0; j < geometry.grid.height; ++j)
    for (int i = 0; i < geometry.grid.width; ++i) {
      const double phi = geometry.grid.Phi(i, j, u);
      ForChannels(geometry, geometry.grid.index(i, j), [&](double share, std::size_t start) {
        weights[start + texel] = share * d * d * phi;
      });
    }
  return weights;
}

Weights IrradianceWeights(const LuminaireGeometry& geometry, Vec3 p, Vec3 n) {
  if (!(p.z > 0) || HorizonCutsSupport(geometry, p, n))
    throw InputError(fmt::format(
        "the receiver at ({}, {}, {}) m with normal ({}, {}, {}) does not see the whole filter "
        "plane; turn it to the lamp or move it forward",
        p.x, p.y, p.z, n.x, n.y, n.z));
  Weights weights(geometry.value_count(), 0.0);
  const BasisGrid& grid = geometry.grid;
  const auto x = PencilAxis::ThroughPoint(p.x, p.z, geometry.delta_m),
             y = PencilAxis::ThroughPoint(p.y, p.z, geometry.delta_m);
  const auto columns = ProjectAllTexels(grid.basis, grid.u0_m, grid.spacing_m, grid.width,
                                        TexelAxis::Columns(geometry.lattice), x);
  const auto rows = ProjectAllTexels(grid.basis, grid.v0_m, grid.spacing_m, grid.height,
                                     TexelAxis::Rows(geometry.lattice), y);
  // delta^2 / z^3 n . (u - p), with lengths in units of z as in light_vector.cc.
  const double scale = geometry.delta_m * geometry.delta_m / (p.z * p.z);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const ProjectedTexels &a = columns[i], &b = rows[j];
      ForChannels(geometry, grid.index(i, j), [&](double share, std::size_t start) {
        for (std::size_t r = 0; r < b.size(); ++r)
          for (std::size_t c = 0; c < a.size(); ++c)
            weights[start + (b.first + r) * geometry.lattice.width + a.first + c] =
                share * scale *
                (n.x * a.moment[c] / p.z * b.zeroth[r] + n.y * a.zeroth[c] * b.moment[r] / p.z -
                 n.z * a.zeroth[c] * b.zeroth[r]);
      });
    }
  return weights;
}

Weights IntensityWeights(const LuminaireGeometry& geometry, Vec3 direction) {
  Weights weights(geometry.value_count(), 0.0);
  if (!(direction.z > 0)) return weights;
  const double delta = geometry.delta_m;
  const Vec2 shift{delta * direction.x / direction.z, delta * direction.y / direction.z};
  const BasisGrid& grid = geometry.grid;
  const auto columns =
      ProjectAllTexels(grid.basis, grid.u0_m, grid.spacing_m, grid.width,
                       TexelAxis::Columns(geometry.lattice), PencilAxis::Parallel(shift.x));
  const auto rows =
      ProjectAllTexels(grid.basis, grid.v0_m, grid.spacing_m, grid.height,
                       TexelAxis::Rows(geometry.lattice), PencilAxis::Parallel(shift.y));
  const double cosine = CosTheta(delta, {0, 0}, shift);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const ProjectedTexels &x = columns[i], &y = rows[j];
      ForChannels(geometry, grid.index(i, j), [&](double share, std::size_t start) {
        for (std::size_t r = 0; r < y.size(); ++r)
          for (std::size_t c = 0; c < x.size(); ++c)
            weights[start + (y.first + r) * geometry.lattice.width + x.first + c] =
                share * delta * delta / (cosine * cosine * cosine) * y.zeroth[r] * x.zeroth[c];
      });
    }
  return weights;
}

Weights FluxWeights(const LuminaireGeometry& geometry) {
  Weights weights(geometry.value_count());
  const double one = geometry.lattice.texel_area_m2() * geometry.grid.PhiIntegral();
  for (int m = 0; m < geometry.grid.count(); ++m)
    ForChannels(geometry, m, [&](double share, std::size_t start) {
      std::fill_n(weights.begin() + static_cast<std::ptrdiff_t>(start), geometry.plane_size(),
                  share * one);
    });
  return weights;
}

double Apply(const Weights& weights, const LightField& field) {
  double sum = 0;
  for (std::size_t k = 0; k < weights.size(); ++k) sum += weights[k] * field.data[k];
  return sum;
}

}  // namespace luxfield::lightfield
