#include "luxfield/reconstruct/solve/moment_constraint.h"

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <cmath>

namespace luxfield::reconstruct {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Map = Eigen::Map<const RowMatrix>;

constexpr int kSamples = 8;          // of a cell and axis
constexpr double kStiffness = 1e-3;  // of a to its start, relative to a filter's own square

// A and X = G^-1 A of both axes together; columns 1, u, v.
struct Integrals {
  RowMatrix a, x;

  Integrals(const lightfield::BasisGrid& grid, int moments) {
    const auto axis = [&](int count, const char* name) {
      const int along = moments > 1 ? 2 : 1;
      const AxisMoments kept = MomentsAlong(grid.basis, count, grid.spacing_m, along);
      const GramAxis gram =
          GramAxis::Factor(lightfield::GramMatrix(grid.basis, count, grid.spacing_m), count, name);
      const RowMatrix integrals = Map(kept.integrals.data(), count, along);
      return std::pair{integrals, RowMatrix(Map(gram.inverse.data(), count, count) * integrals)};
    };
    const auto [a_u, x_u] = axis(grid.width, "u");
    const auto [a_v, x_v] = axis(grid.height, "v");
    a.resize(grid.count(), moments);
    x.resize(grid.count(), moments);
    for (int m = 0; m < grid.count(); ++m)
      for (int k = 0; k < moments; ++k) {
        const int i = m % grid.width, j = m / grid.width, of_u = k == 1, of_v = k == 2;
        a(m, k) = a_u(i, of_u) * a_v(j, of_v);
        x(m, k) = x_u(i, of_u) * x_v(j, of_v);
      }
  }
};

// Weights of the rows that are one position's, 1 / noise^2 over their sum.
VectorXd Shares(const FilterSystem& system, std::span<const double> row_noise) {
  VectorXd shares(system.rows());
  for (Index r = 0; r < shares.size(); ++r) {
    const double noise = row_noise.empty() ? 1 : row_noise[static_cast<std::size_t>(r)];
    shares(r) = noise > 0 ? 1 / (noise * noise) : 1;
  }
  VectorXd of_position = VectorXd::Zero(system.columns());
  for (Index r = 0; r < shares.size(); ++r) of_position(r % system.columns()) += shares(r);
  for (Index r = 0; r < shares.size(); ++r) shares(r) /= of_position(r % system.columns());
  return shares;
}

}  // namespace

std::vector<double> MomentConstraint::Map(const std::vector<double>& p) const {
  if (moments == 0) return p;
  const Eigen::Map<const RowMatrix> weights(p.data(), columns, rows),
      a(integrals.data(), columns, moments), y(step.data(), columns, moments),
      of_rows(measured.data(), rows, moments);
  const RowMatrix map = weights + y * (of_rows.transpose() - a.transpose() * weights);
  return {map.data(), map.data() + map.size()};
}

MomentConstraint ConstrainMoments(const FilterSystem& system, const lightfield::BasisGrid& grid,
                                  KeptMoments kept, std::span<const double> row_noise) {
  MomentConstraint result;
  result.rows = system.rows();
  result.columns = system.columns();
  const int least = std::min(kept.u, kept.v);
  if (least == 0) return result;
  const int moments = least > 1 ? 3 : 1;

  const InteriorSamples samples = system.SampleInterior(kSamples);
  std::vector<Eigen::Triplet<double>> entries;
  for (int r = 0; r < result.rows; ++r)
    for (const auto& [point, value] : samples.filters[r]) entries.emplace_back(r, point, value);
  Eigen::SparseMatrix<double> filters(result.rows, samples.width * samples.height);
  filters.setFromTriplets(entries.begin(), entries.end());
  const double per_cell = 1.0 / (kSamples * kSamples);

  // 1, u and v at the points, in spacings from the middle of the supports.
  RowMatrix target(filters.cols(), moments);
  for (int point = 0; point < filters.cols(); ++point) {
    const double u = (point % samples.width + 0.5) / kSamples - 0.5 * samples.width / kSamples,
                 v = (point / samples.width + 0.5) / kSamples - 0.5 * samples.height / kSamples;
    const double values[3] = {1, u, v};
    for (int k = 0; k < moments; ++k) target(point, k) = values[k];
  }
  const VectorXd shares = Shares(system, row_noise);
  const lightfield::Vec2 middle =
      0.5 * (grid.centre(0, 0) + grid.centre(grid.width - 1, grid.height - 1));
  RowMatrix start(result.rows, moments);
  for (int r = 0; r < result.rows; ++r) {
    const lightfield::Vec2 c = (1 / grid.spacing_m) * (system.centre(r) - middle);
    const double values[3] = {1, c.x, c.y};
    for (int k = 0; k < moments; ++k) start(r, k) = shares(r) * values[k];
  }
  const double own = grid.basis.Gram(0) * grid.basis.Gram(0);
  Eigen::SparseMatrix<double> normal =
      per_cell * Eigen::SparseMatrix<double>(filters * filters.transpose());
  Eigen::SparseMatrix<double> stiffness(result.rows, result.rows);
  stiffness.setIdentity();
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal +
                                                                  kStiffness * own * stiffness);
  const RowMatrix left = target - filters.transpose() * start;
  const RowMatrix a = start + solver.solve(Eigen::MatrixXd(per_cell * (filters * left)));

  const Integrals integrals(grid, moments);
  const Map inverse(system.PseudoInverse().data(), result.columns, result.rows);
  const RowMatrix q = inverse.transpose() * integrals.a;  // moments of the plain solution are q^T E
  const auto residuals = [&](const RowMatrix& weights) {
    const RowMatrix off = filters.transpose() * weights - target;
    return VectorXd(
        (off.colwise().squaredNorm() / static_cast<double>(off.rows())).cwiseSqrt().transpose());
  };
  const VectorXd of_a = residuals(a), of_q = residuals(q);
  result.residual = of_a(0);
  result.residual_of_least_squares = of_q(0);
  if (!(of_a(0) < of_q(0))) return result;
  result.moments = moments == 3 && of_a(1) < of_q(1) && of_a(2) < of_q(2) ? 3 : 1;
  const auto columns = [&](const RowMatrix& m) {
    const RowMatrix some = m.leftCols(result.moments);
    return std::vector<double>(some.data(), some.data() + some.size());
  };
  result.integrals = columns(integrals.a);
  result.measured = columns(a);
  const RowMatrix x = integrals.x.leftCols(result.moments),
                  s = integrals.a.leftCols(result.moments).transpose() * x;
  const RowMatrix y = s.ldlt().solve(x.transpose()).transpose();
  result.step = columns(y);
  return result;
}

}  // namespace luxfield::reconstruct
