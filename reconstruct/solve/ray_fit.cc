#include "luxfield/reconstruct/solve/ray_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "luxfield/core/parallel.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::BasisGrid;
using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Linear Rec. 709 from XYZ (primaries and white of ITU-R BT.709).
std::array<double, 3> RgbFromXyz(const std::array<double, 3>& xyz) {
  return {3.2409699 * xyz[0] - 1.5373832 * xyz[1] - 0.4986108 * xyz[2],
          -0.9692436 * xyz[0] + 1.8759675 * xyz[1] + 0.0415551 * xyz[2],
          0.0556301 * xyz[0] - 0.2039770 * xyz[1] + 1.0569715 * xyz[2]};
}

// Where the basis functions sum to 1.
RayWindow InnerCells(const BasisGrid& grid, int count, double start_m) {
  return {start_m + (grid.basis.cells - 1) * grid.spacing_m, start_m + count * grid.spacing_m};
}

// The basis functions of one axis that are not 0 at x: first and values.
struct AxisValues {
  int first = 0, count = 0;
  std::array<double, lightfield::Basis::kMaxCells + 1> value{};

  AxisValues(const lightfield::Basis& basis, double x, int functions) {
    const int cell = static_cast<int>(std::floor(x));
    first = std::max(0, cell - basis.cells);
    for (int i = first; i <= std::min(functions - 1, cell); ++i)
      value[count++] = basis.Value(x - i);
  }
  Eigen::VectorXd Dense(int functions) const {
    Eigen::VectorXd dense = Eigen::VectorXd::Zero(functions);
    for (int i = 0; i < count; ++i) dense(first + i) = value[i];
    return dense;
  }
  // phi^T G^-1 phi
  double Kernel(const GramAxis& axis) const {
    double sum = 0;
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < count; ++k)
        sum += value[i] * value[k] *
               axis.inverse[static_cast<std::size_t>(first + i) * axis.count + first + k];
    return sum;
  }
};

AxisValues ValuesU(const BasisGrid& grid, double u) {
  return {grid.basis, (u - grid.u0_m) / grid.spacing_m, grid.width};
}
AxisValues ValuesV(const BasisGrid& grid, double v) {
  return {grid.basis, (v - grid.v0_m) / grid.spacing_m, grid.height};
}

// x = L^-1 x in place for G = L L^T, entries `stride` apart.
void ForwardSubstitute(const GramAxis& axis, double* x, std::ptrdiff_t stride) {
  for (int i = 0; i < axis.count; ++i) {
    double sum = x[i * stride];
    if (i > 0) sum -= axis.first_band[i] * x[(i - 1) * stride];
    if (i > 1) sum -= axis.second_band[i] * x[(i - 2) * stride];
    x[i * stride] = sum * axis.reciprocal_diagonal[i];
  }
}

}  // namespace

RayBins BinRays(std::span<const RayLine> lines, const LuminaireGeometry& geometry,
                double filter_z_m, double scale) {
  const auto& lattice = geometry.lattice;
  const RayWindow u_window = InnerCells(geometry.grid, geometry.grid.width, geometry.grid.u0_m);
  const RayWindow v_window = InnerCells(geometry.grid, geometry.grid.height, geometry.grid.v0_m);
  constexpr std::size_t kMissed = static_cast<std::size_t>(-1);
  std::vector<std::size_t> texel(lines.size(), kMissed);
  RayBins bins;
  bins.first.assign(geometry.plane_size() + 1, 0);
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const Vec2 u = lines[n].At(filter_z_m), s = lines[n].At(filter_z_m + geometry.delta_m);
    const double column = std::floor(lattice.column_of_s(s.x)),
                 row = std::floor(lattice.row_of_t(s.y));
    RayTally* tally = &bins.used;
    if (!u_window.Holds(u.x) || !v_window.Holds(u.y))
      tally = &bins.missed_filter_plane;
    else if (!(column >= 0 && column < lattice.width && row >= 0 && row < lattice.height))
      tally = &bins.missed_image_plane;
    else
      ++bins.first[(texel[n] = static_cast<std::size_t>(row) * lattice.width +
                               static_cast<std::size_t>(column)) +
                   1];
    ++tally->rays;
    tally->flux += scale * lines[n].flux;
  }
  std::partial_sum(bins.first.begin(), bins.first.end(), bins.first.begin());
  bins.hits.resize(bins.first.back());
  std::vector<std::size_t> next(bins.first.begin(), bins.first.end() - 1);
  for (std::size_t n = 0; n < lines.size(); ++n)
    if (texel[n] != kMissed)
      bins.hits[next[texel[n]]++] = {lines[n].At(filter_z_m), lines[n].flux, lines[n].ray};
  return bins;
}

void FitRays(const formats::RayFile& file, const RayBins& bins, double scale,
             const GramSolver& solver, LightField& c, LightField& sigma) {
  const auto& geometry = c.geometry;
  const auto& grid = geometry.grid;
  const std::size_t texels = geometry.plane_size();
  const double area = geometry.lattice.texel_area_m2();
  const Eigen::Map<const RowMatrix> inverse_u(solver.u().inverse.data(), grid.width, grid.width);
  const Eigen::Map<const RowMatrix> inverse_v(solver.v().inverse.data(), grid.height, grid.height);
  // Flux of the fit of one ray of flux 1 at (u, v): the product of gain . phi over both axes; 1 in
  // the middle of a large grid.
  const double integral_m = grid.basis.TotalIntegral() * grid.spacing_m;
  const Eigen::VectorXd gain_u = integral_m * inverse_u.rowwise().sum();
  const Eigen::VectorXd gain_v = integral_m * inverse_v.rowwise().sum();
  core::ParallelFor(texels, 64, [&](std::size_t begin, std::size_t end) {
    std::vector<RowMatrix> e(geometry.channels), variance(geometry.channels);
    for (std::size_t texel = begin; texel < end; ++texel) {
      if (bins.first[texel] == bins.first[texel + 1]) continue;
      for (int channel = 0; channel < geometry.channels; ++channel)
        e[channel] = variance[channel] = RowMatrix::Zero(grid.height, grid.width);
      double flux_in = 0, flux_fitted = 0;
      for (std::size_t h = bins.first[texel]; h < bins.first[texel + 1]; ++h) {
        const RayBins::Hit& hit = bins.hits[h];
        const Eigen::VectorXd phi_u = ValuesU(grid, hit.u.x).Dense(grid.width);
        const Eigen::VectorXd phi_v = ValuesV(grid, hit.u.y).Dense(grid.height);
        const RowMatrix phi = phi_v * phi_u.transpose();
        flux_in += hit.flux;
        flux_fitted += hit.flux * gain_u.dot(phi_u) * gain_v.dot(phi_v);
        const RowMatrix dual =
            (inverse_v * phi_v).cwiseAbs2() * (inverse_u * phi_u).cwiseAbs2().transpose();
        const std::array<double, 3> flux = geometry.channels == 3
                                               ? RgbFromXyz(*file.rays[hit.ray].tristimulus)
                                               : std::array<double, 3>{hit.flux, 0, 0};
        for (int channel = 0; channel < geometry.channels; ++channel) {
          const double scaled = scale * flux[channel];
          e[channel] += scaled / area * phi;
          variance[channel] += scaled * scaled / (area * area) * dual;
        }
      }
      const double correction = flux_fitted > 0 ? flux_in / flux_fitted : 1;
      for (int channel = 0; channel < geometry.channels; ++channel) {
        const RowMatrix solved = inverse_v * e[channel] * inverse_u;
        for (int m = 0; m < grid.count(); ++m) {
          c.image(m, channel)[texel] = static_cast<float>(correction * solved.data()[m]);
          sigma.image(m, channel)[texel] =
              static_cast<float>(correction * std::sqrt(variance[channel].data()[m]));
        }
      }
    }
  });
}

double LatticeRisk(const RayBins& bins, const LuminaireGeometry& geometry, const GramSolver& solver,
                   double share) {
  const BasisGrid& grid = geometry.grid;
  const double area = geometry.lattice.texel_area_m2();
  std::vector<double> variance(geometry.plane_size()), square(geometry.plane_size());
  core::ParallelFor(geometry.plane_size(), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<double> e(static_cast<std::size_t>(grid.count()));
    for (std::size_t texel = begin; texel < end; ++texel) {
      if (bins.first[texel] == bins.first[texel + 1]) continue;
      std::fill(e.begin(), e.end(), 0);
      for (std::size_t h = bins.first[texel]; h < bins.first[texel + 1]; ++h) {
        const RayBins::Hit& hit = bins.hits[h];
        const AxisValues u = ValuesU(grid, hit.u.x), v = ValuesV(grid, hit.u.y);
        for (int j = 0; j < v.count; ++j)
          for (int i = 0; i < u.count; ++i)
            e[grid.index(u.first + i, v.first + j)] += hit.flux * u.value[i] * v.value[j];
        variance[texel] += hit.flux * hit.flux * u.Kernel(solver.u()) * v.Kernel(solver.v());
      }
      for (int j = 0; j < grid.height; ++j) ForwardSubstitute(solver.u(), &e[grid.index(0, j)], 1);
      for (int i = 0; i < grid.width; ++i)
        ForwardSubstitute(solver.v(), &e[grid.index(i, 0)], grid.width);
      for (const double x : e) square[texel] += x * x;
    }
  });
  const double all_variance = std::accumulate(variance.begin(), variance.end(), 0.0) / area;
  const double all_square = std::accumulate(square.begin(), square.end(), 0.0) / area;
  return geometry.delta_m * geometry.delta_m * (share * all_variance - (all_square - all_variance));
}

}  // namespace luxfield::reconstruct
