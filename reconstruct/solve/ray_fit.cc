#include "luxfield/reconstruct/solve/ray_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

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
  double Dot(const std::vector<double>& x) const {
    double sum = 0;
    for (int i = 0; i < count; ++i) sum += value[i] * x[static_cast<std::size_t>(first + i)];
    return sum;
  }
  // The squares of G^-1 phi: of the dual basis functions.
  void DualSquares(const GramAxis& axis, std::vector<double>& squares) const {
    squares.resize(static_cast<std::size_t>(axis.count));
    for (std::size_t i = 0; i < squares.size(); ++i) {
      const double* row = &axis.inverse[i * squares.size() + static_cast<std::size_t>(first)];
      double dual = 0;
      for (int k = 0; k < count; ++k) dual += row[k] * value[k];
      squares[i] = dual * dual;
    }
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

// What one ray of flux 1 adds to the fit's flux along an axis, for each function's value at it: the
// integral of the dual basis functions; with the values it is 1 in the middle of a large grid.
std::vector<double> GainOf(const GramAxis& axis, double integral_m) {
  std::vector<double> gain(static_cast<std::size_t>(axis.count));
  for (std::size_t i = 0; i < gain.size(); ++i)
    gain[i] = integral_m * std::accumulate(&axis.inverse[i * gain.size()],
                                           &axis.inverse[i * gain.size()] + gain.size(), 0.0);
  return gain;
}

// Calls body(texel, channel, place of its first basis function in sums over texel, channel and
// function).
void ForEachTexel(const LuminaireGeometry& geometry,
                  const std::function<void(std::size_t, int, std::size_t)>& body) {
  const auto functions = static_cast<std::size_t>(geometry.grid.count());
  core::ParallelFor(geometry.plane_size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t texel = begin; texel < end; ++texel)
      for (int channel = 0; channel < geometry.channels; ++channel)
        body(texel, channel, (texel * geometry.channels + channel) * functions);
  });
}

}  // namespace

RayBins BinRays(std::span<const RayLine> lines, const LuminaireGeometry& geometry,
                double filter_z_m, double scale) {
  const auto& lattice = geometry.lattice;
  const RayWindow u_window = InnerCells(geometry.grid, geometry.grid.width, geometry.grid.u0_m);
  const RayWindow v_window = InnerCells(geometry.grid, geometry.grid.height, geometry.grid.v0_m);
  RayBins bins;
  std::vector<std::pair<std::size_t, std::size_t>> order;  // texel and line
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
      order.emplace_back(
          static_cast<std::size_t>(row) * lattice.width + static_cast<std::size_t>(column), n);
    tally->Add({1, scale * lines[n].flux});
  }
  std::sort(order.begin(), order.end());
  bins.hits.reserve(order.size());
  for (const auto& [texel, n] : order) {
    if (bins.texels.empty() || bins.texels.back().texel != texel)
      bins.texels.push_back({texel, bins.hits.size(), 0});
    bins.hits.push_back({lines[n].At(filter_z_m), lines[n].flux, lines[n].xyz});
    bins.texels.back().end = bins.hits.size();
  }
  return bins;
}

RayFit::RayFit(const LuminaireGeometry& geometry, const GramSolver& solver, const Options& options)
    : geometry_(geometry), solver_(solver), options_(options) {
  const auto& grid = geometry.grid;
  const double integral_m = grid.basis.TotalIntegral() * grid.spacing_m;
  gain_u_ = GainOf(solver.u(), integral_m);
  gain_v_ = GainOf(solver.v(), integral_m);
  waiting_.reserve(options.block);
  sums_.resize(geometry.value_count());
  if (options.sigma) squares_.resize(sums_.size());
  flux_in_.resize(geometry.plane_size());
  flux_fitted_.resize(geometry.plane_size());
}

void RayFit::Add(const RayLine& line) {
  waiting_.push_back(line);
  if (waiting_.size() >= options_.block) AddBlock();
}

void RayFit::AddBlock() {
  const RayBins bins = BinRays(waiting_, geometry_, options_.filter_z_m, options_.scale);
  waiting_.clear();
  missed_filter_plane_.Add(bins.missed_filter_plane);
  missed_image_plane_.Add(bins.missed_image_plane);
  used_.Add(bins.used);
  core::ParallelFor(bins.texels.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) AddTexel(bins, bins.texels[k]);
  });
}

void RayFit::AddTexel(const RayBins& bins, const RayBins::Texel& texel) {
  const auto& grid = geometry_.grid;
  const auto functions = static_cast<std::size_t>(grid.count());
  const double area = geometry_.lattice.texel_area_m2();
  std::vector<double> dual_u, dual_v;
  for (std::size_t h = texel.begin; h < texel.end; ++h) {
    const RayBins::Hit& hit = bins.hits[h];
    const AxisValues u = ValuesU(grid, hit.u.x), v = ValuesV(grid, hit.u.y);
    flux_in_[texel.texel] += hit.flux;
    flux_fitted_[texel.texel] += hit.flux * u.Dot(gain_u_) * v.Dot(gain_v_);
    if (options_.sigma) {
      u.DualSquares(solver_.u(), dual_u);
      v.DualSquares(solver_.v(), dual_v);
    }
    const std::array<double, 3> flux =
        geometry_.channels == 3 ? RgbFromXyz(hit.xyz) : std::array<double, 3>{hit.flux, 0, 0};
    for (int channel = 0; channel < geometry_.channels; ++channel) {
      const double density = options_.scale * flux[channel] / area;
      const std::size_t first = (texel.texel * geometry_.channels + channel) * functions;
      for (int j = 0; j < v.count; ++j)
        for (int i = 0; i < u.count; ++i)
          sums_[first + grid.index(u.first + i, v.first + j)] += density * v.value[j] * u.value[i];
      if (!options_.sigma) continue;
      double* squares = &squares_[first];
      for (const double along_v : dual_v) {
        const double factor = density * density * along_v;
        for (const double along_u : dual_u) *squares++ += factor * along_u;
      }
    }
  }
}

double RayFit::Correction(std::size_t texel) const {
  return flux_fitted_[texel] > 0 ? flux_in_[texel] / flux_fitted_[texel] : 1;
}

LightField RayFit::Solution() const {
  LightField c(geometry_);
  const auto& grid = geometry_.grid;
  const Eigen::Map<const RowMatrix> inverse_u(solver_.u().inverse.data(), grid.width, grid.width);
  const Eigen::Map<const RowMatrix> inverse_v(solver_.v().inverse.data(), grid.height, grid.height);
  ForEachTexel(geometry_, [&](std::size_t texel, int channel, std::size_t first) {
    const Eigen::Map<const RowMatrix> e(&sums_[first], grid.height, grid.width);
    if (e.isZero(0)) return;
    const RowMatrix solved = inverse_v * e * inverse_u;
    for (int m = 0; m < grid.count(); ++m)
      c.image(m, channel)[texel] = static_cast<float>(Correction(texel) * solved.data()[m]);
  });
  return c;
}

LightField RayFit::Sigma() const {
  LightField sigma(geometry_);
  ForEachTexel(geometry_, [&](std::size_t texel, int channel, std::size_t first) {
    for (int m = 0; m < geometry_.grid.count(); ++m)
      sigma.image(m, channel)[texel] = static_cast<float>(
          Correction(texel) * std::sqrt(squares_[first + static_cast<std::size_t>(m)]));
  });
  return sigma;
}

double LatticeRisk(const RayBins& bins, const LuminaireGeometry& geometry, const GramSolver& solver,
                   double share) {
  const BasisGrid& grid = geometry.grid;
  const double area = geometry.lattice.texel_area_m2();
  std::vector<double> variance(bins.texels.size()), square(bins.texels.size());
  core::ParallelFor(bins.texels.size(), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<double> e(static_cast<std::size_t>(grid.count()));
    for (std::size_t texel = begin; texel < end; ++texel) {
      std::fill(e.begin(), e.end(), 0);
      for (std::size_t h = bins.texels[texel].begin; h < bins.texels[texel].end; ++h) {
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
