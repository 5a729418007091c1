#include "luxfield/photometry/conformity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/random.h"

namespace luxfield::photometry {
namespace {

// Sum of products over the texels that both hold.
double Product(const FieldFunctional& a, const FieldFunctional& b) {
  if (a.weights.empty() || b.weights.empty()) return 0;
  const TexelWindow &wa = a.window, &wb = b.window;
  const int row0 = std::max(wa.row0, wb.row0),
            row1 = std::min(wa.row0 + wa.rows, wb.row0 + wb.rows);
  const int column0 = std::max(wa.column0, wb.column0),
            column1 = std::min(wa.column0 + wa.columns, wb.column0 + wb.columns);
  const std::size_t images = a.weights.size() / wa.size();
  const auto at = [](const FieldFunctional& f, std::size_t m, int row, int column) {
    return &f.weights[(m * f.window.rows + row - f.window.row0) * f.window.columns + column -
                      f.window.column0];
  };
  double sum = 0;
  for (std::size_t m = 0; m < images; ++m)
    for (int row = row0; row < row1; ++row) {
      if (column0 >= column1) break;
      const double *x = at(a, m, row, column0), *y = at(b, m, row, column0);
      for (int k = 0; k < column1 - column0; ++k) sum += x[k] * y[k];
    }
  return sum;
}

}  // namespace

int Covariances::Add(const Functional& functional) {
  Functional whitened = functional;
  for (std::size_t k = 0; k < whitened.size(); ++k)
    if (!whitened[k].weights.empty())
      whitened[k].weights = lamp_.noise[k].Whitened(functional[k].window, functional[k].weights);
  whitened_.push_back(std::move(whitened));
  return static_cast<int>(whitened_.size()) - 1;
}

double Covariances::Of(int a, int b) const {
  if (a > b) std::swap(a, b);
  if (const auto found = known_.find({a, b}); found != known_.end()) return found->second;
  double& sum = known_[{a, b}];
  for (std::size_t k = 0; k < whitened_[a].size(); ++k)
    sum += Product(whitened_[a][k], whitened_[b][k]);
  return sum;
}

double PassProbability(double margin, double u) {
  if (!(u > 0)) return margin >= 0 ? 1 : 0;
  return 0.5 * std::erfc(-margin / u / std::numbers::sqrt2);
}

double JointPassProbability(const std::vector<double>& margins,
                            const std::function<double(std::size_t, std::size_t)>& covariance) {
  constexpr double kCertain = 6;
  constexpr int kDraws = 40000;
  const std::size_t count = margins.size();
  std::vector<double> u;
  std::vector<std::size_t> doubtful;
  for (std::size_t k = 0; k < count; ++k) {
    u.push_back(std::sqrt(std::max(0.0, covariance(k, k))));
    if (margins[k] < -kCertain * u[k]) return 0;
    if (!(margins[k] > kCertain * u[k]) && u[k] > 0) doubtful.push_back(k);
  }
  if (doubtful.empty()) return 1;
  if (doubtful.size() == 1) return PassProbability(margins[doubtful[0]], u[doubtful[0]]);
  const auto n = static_cast<Eigen::Index>(doubtful.size());
  Eigen::MatrixXd c(n, n);
  Eigen::VectorXd margin(n), scale(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    scale(k) = u[doubtful[k]];
    margin(k) = margins[doubtful[k]] / scale(k);
  }
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b < n; ++b)
      c(a, b) = covariance(doubtful[a], doubtful[b]) / scale(a) / scale(b);
  // A root of a matrix that may be singular: margins that are one and the same.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(c);
  const Eigen::MatrixXd root =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  core::Random random(1, 0);
  Eigen::VectorXd z(n);
  int passed = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    for (Eigen::Index k = 0; k < n; ++k) z(k) = random.Normal();
    passed += (margin + root * z).minCoeff() >= 0;
  }
  return static_cast<double>(passed) / kDraws;
}

}  // namespace luxfield::photometry
