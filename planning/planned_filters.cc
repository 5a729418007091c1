#include "luxfield/planning/planned_filters.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/projected_texels.h"
#include "luxfield/lightfield/quadrature.h"
#include "luxfield/reconstruct/solve/gram_solve.h"

namespace luxfield::planning {
namespace {

using lightfield::Basis;
using lightfield::PencilAxis;
using lightfield::TexelAxis;
using preprocess::Receiver;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using DoubleRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Integral of max(sign Phi*, 0) over [x0, x1]. Pieces an eighth of a cell long: the function's sign
// changes where it is small.
double DualPartIntegral(const Basis& basis, double sign, double x0, double x1) {
  constexpr int kPieces = 8;
  double sum = 0;
  for (int k = 0; k < kPieces; ++k)
    sum += lightfield::Gauss2(
        x0 + (x1 - x0) * k / kPieces, x0 + (x1 - x0) * (k + 1) / kPieces,
        [&](double x) { return std::max(sign * basis.DualValue(x - 0.5 * basis.cells), 0.0); });
  return sum;
}

// Rows i: integrals of the filters over the cells, metres. Dual filters have `count` rows of the
// positive parts and then as many of the negative ones.
FloatRows AxisIntegrals(const PlannedFilters& filters, double grid_corner_m, int count,
                        double lit_corner_m, double cell_m, int cells) {
  const Basis& basis = filters.grid.basis;
  const double h = filters.grid.spacing_m;
  FloatRows rows(filters.dual ? 2 * count : count, cells);
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < cells; ++k) {
      const double x0 = (lit_corner_m + k * cell_m - grid_corner_m) / h - i, x1 = x0 + cell_m / h;
      if (filters.dual) {
        rows(i, k) = static_cast<float>(h * DualPartIntegral(basis, 1, x0, x1));
        rows(count + i, k) = static_cast<float>(h * DualPartIntegral(basis, -1, x0, x1));
      } else {
        rows(i, k) = static_cast<float>(h * basis.Integral(x0, x1));
      }
    }
  return rows;
}

// The closed form's texel weights of one axis seen from a receiver, [i][texel], through the
// transposed map of the solve.
struct AxisWeights {
  int first = 0, size = 0;  // of the texels that any filter's window meets
  DoubleRows zeroth, moment;
};
AxisWeights WeighAxis(const Basis& basis, double corner_m, double spacing_m, int count,
                      const TexelAxis& texels, const PencilAxis& pencil,
                      const DoubleRows& transposed) {
  const auto projected =
      lightfield::ProjectAllTexels(basis, corner_m, spacing_m, count, texels, pencil);
  int first = texels.count, end = 0;
  for (const auto& p : projected) {
    if (p.size() == 0) continue;
    first = std::min(first, p.first);
    end = std::max(end, p.first + static_cast<int>(p.size()));
  }
  AxisWeights weights{first, std::max(0, end - first), {}, {}};
  DoubleRows zeroth = DoubleRows::Zero(count, weights.size), moment = zeroth;
  for (int i = 0; i < count; ++i)
    for (std::size_t k = 0; k < projected[i].size(); ++k) {
      const auto column = projected[i].first - first + static_cast<Eigen::Index>(k);
      zeroth(i, column) = projected[i].zeroth[k];
      moment(i, column) = projected[i].moment[k];
    }
  weights.zeroth = transposed * zeroth;
  weights.moment = transposed * moment;
  return weights;
}

// w = x_a (x) y_a + x_b (x) y_b over [i][column] and [j][row].
struct ReceiverWeights {
  AxisWeights x, y;  // of x zeroth is x_b and moment x_a, of y moment is y_b and zeroth y_a
};

// delta^2 / z^2 (n_x m_x z_y / z + n_y z_x m_y / z - n_z z_x z_y), see linear_functional.cc.
ReceiverWeights Weigh(const PlannedFilters& filters, double delta_m, const Receiver& receiver,
                      const DoubleRows& transposed_u, const DoubleRows& transposed_v) {
  const auto& grid = filters.grid;
  const auto& [p, n] = receiver;
  ReceiverWeights w{WeighAxis(grid.basis, grid.u0_m, grid.spacing_m, grid.width,
                              TexelAxis::Columns(filters.lattice),
                              PencilAxis::ThroughPoint(p.x, p.z, delta_m), transposed_u),
                    WeighAxis(grid.basis, grid.v0_m, grid.spacing_m, grid.height,
                              TexelAxis::Rows(filters.lattice),
                              PencilAxis::ThroughPoint(p.y, p.z, delta_m), transposed_v)};
  const double scale = delta_m * delta_m / (p.z * p.z);
  w.x.moment *= scale * n.x / p.z;
  w.y.moment = scale * (n.y / p.z * w.y.moment - n.z * w.y.zeroth);
  return w;
}

DoubleRows TransposedMap(const PlannedFilters& filters, int count, int moments) {
  const double h = filters.grid.spacing_m;
  if (filters.dual) return DoubleRows::Identity(count, count) / h;
  auto gram = lightfield::GramMatrix(filters.grid.basis, count, h);
  auto axis = reconstruct::GramAxis::Factor(std::move(gram), count, "an axis");
  axis.KeepMoments(reconstruct::MomentsAlong(filters.grid.basis, count, h, moments));
  return Eigen::Map<const DoubleRows>(axis.map.data(), count, count).transpose();
}

// Are all the supports behind the receiver's horizon?
bool FacesAway(const lightfield::BasisGrid& grid, const Receiver& receiver) {
  const double u1 = grid.u0_m + (grid.width + grid.basis.cells - 1) * grid.spacing_m,
               v1 = grid.v0_m + (grid.height + grid.basis.cells - 1) * grid.spacing_m;
  for (const double u : {grid.u0_m, u1})
    for (const double v : {grid.v0_m, v1})
      if (Dot(receiver.n, lightfield::Vec3{u, v, 0} - receiver.p) > 0) return false;
  return true;
}

}  // namespace

double PlannedFilters::print_scale() const {
  return dual ? 1 : 1 / (grid.basis.Peak() * grid.basis.Peak());
}

std::vector<double> PlannedFilters::print_factors() const {
  if (!dual) return {1 / print_scale()};
  const auto peaks = grid.basis.DualPeaks();
  return {peaks[0], -peaks[1]};
}

std::vector<std::vector<float>> FilterImages(const SampledLamp& samples,
                                             const PlannedFilters& filters) {
  const auto& grid = filters.grid;
  const auto& lattice = filters.lattice;
  const FloatRows u = AxisIntegrals(filters, grid.u0_m, grid.width, samples.lit.x0, samples.cell_m,
                                    samples.cells_u),
                  v = AxisIntegrals(filters, grid.v0_m, grid.height, samples.lit.y0, samples.cell_m,
                                    samples.cells_v);
  const auto column0 = std::lround((lattice.s0_m - samples.lattice.s0_m) / samples.lattice.ds_m),
             row0 = std::lround((samples.lattice.t1_m - lattice.t1_m) / samples.lattice.dt_m);
  const std::size_t texels = static_cast<std::size_t>(lattice.width) * lattice.height;
  std::vector<std::vector<float>> images(
      filters.prints(), std::vector<float>(texels * static_cast<std::size_t>(grid.count())));
  const auto factors = filters.print_factors();
  const int w = grid.width, h = grid.height;
  core::ParallelFor(texels, 64, [&](std::size_t begin, std::size_t end) {
    FloatRows half, all;
    for (std::size_t texel = begin; texel < end; ++texel) {
      const std::size_t row = texel / lattice.width + row0,
                        column = texel % lattice.width + column0;
      const Eigen::Map<const FloatRows> light(
          samples.of_texel(row * samples.lattice.width + column), samples.cells_v, samples.cells_u);
      half.noalias() = v * light;
      all.noalias() = half * u.transpose();
      for (int j = 0; j < h; ++j)
        for (int i = 0; i < w; ++i) {
          const std::size_t at = static_cast<std::size_t>(grid.index(i, j)) * texels + texel;
          if (filters.dual) {  // the product is positive where both factors have the same sign
            images[0][at] = (all(j, i) + all(h + j, w + i)) / static_cast<float>(factors[0]);
            images[1][at] = -(all(j, w + i) + all(h + j, i)) / static_cast<float>(factors[1]);
          } else {
            images[0][at] = all(j, i) / static_cast<float>(factors[0]);
          }
        }
    }
  });
  return images;
}

lightfield::EdgeLight EdgeLightOf(const std::vector<std::vector<float>>& images,
                                  const PlannedFilters& filters) {
  if (filters.dual) return {};
  const auto count = static_cast<std::size_t>(filters.grid.count());
  const std::size_t texels = images[0].size() / count;
  std::vector<double> light(count);
  for (std::size_t m = 0; m < count; ++m)
    light[m] =
        std::accumulate(images[0].begin() + static_cast<std::ptrdiff_t>(m * texels),
                        images[0].begin() + static_cast<std::ptrdiff_t>((m + 1) * texels), 0.0);
  return FindEdgeLight(filters.grid, light, std::vector<double>(count));
}

FilterJudgement Judge(const std::vector<std::vector<float>>& images, const PlannedFilters& filters,
                      double delta_m, const std::vector<Receiver>& receivers,
                      const std::vector<double>& truth) {
  const auto& grid = filters.grid;
  const auto& lattice = filters.lattice;
  const std::size_t texels = static_cast<std::size_t>(lattice.width) * lattice.height;
  reconstruct::KeptMoments kept;
  if (!filters.dual)
    kept = MomentsToKeep(grid, reconstruct::Keep::kMoments, EdgeLightOf(images, filters));
  const DoubleRows map_u = TransposedMap(filters, grid.width, kept.u),
                   map_v = TransposedMap(filters, grid.height, kept.v);
  const auto factors = filters.print_factors();

  std::vector<std::size_t> facing;
  for (std::size_t r = 0; r < receivers.size(); ++r)
    if (!FacesAway(grid, receivers[r])) facing.push_back(r);
  std::vector<ReceiverWeights> weights(facing.size());
  core::ParallelFor(facing.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      weights[k] = Weigh(filters, delta_m, receivers[facing[k]], map_u, map_v);
  });

  FilterJudgement judgement;
  const double mean =
      std::accumulate(truth.begin(), truth.end(), 0.0) / static_cast<double>(truth.size());
  const double share = 1 / (mean * mean * static_cast<double>(receivers.size()));
  judgement.noise_weight.resize(texels * grid.count());
  // Image by image, so that no two threads add to one place.
  std::vector<std::vector<double>> per_image(grid.count());
  core::ParallelFor(
      static_cast<std::size_t>(grid.count()), 1, [&](std::size_t begin, std::size_t end) {
        std::vector<double> light(texels), squares(texels);
        for (std::size_t m = begin; m < end; ++m) {
          const auto i = static_cast<Eigen::Index>(m) % grid.width,
                     j = static_cast<Eigen::Index>(m) / grid.width;
          for (std::size_t t = 0; t < texels; ++t) {
            light[t] = 0;
            for (std::size_t print = 0; print < images.size(); ++print)
              light[t] += factors[print] * images[print][m * texels + t];
          }
          std::fill(squares.begin(), squares.end(), 0.0);
          per_image[m].resize(weights.size());
          for (std::size_t r = 0; r < weights.size(); ++r) {
            const AxisWeights &x = weights[r].x, &y = weights[r].y;
            double sum = 0;
            for (int row = 0; row < y.size; ++row) {
              const double ya = y.zeroth(j, row), yb = y.moment(j, row);
              const std::size_t start =
                  static_cast<std::size_t>(y.first + row) * lattice.width + x.first;
              for (int column = 0; column < x.size; ++column) {
                const double w = x.moment(i, column) * ya + x.zeroth(i, column) * yb;
                sum += w * light[start + column];
                squares[start + column] += w * w;
              }
            }
            per_image[m][r] = sum;
          }
          for (std::size_t t = 0; t < texels; ++t)
            judgement.noise_weight[m * texels + t] = static_cast<float>(share * squares[t]);
        }
      });

  std::vector<double> found(receivers.size(), 0.0);
  for (std::size_t k = 0; k < facing.size(); ++k)
    for (const auto& image : per_image) found[facing[k]] += image[k];
  judgement.truncation = RelativeRmse(found, truth);
  return judgement;
}

}  // namespace luxfield::planning
