#include "luxfield/reconstruct/budget/spot_posterior.h"

#include <algorithm>
#include <cmath>

#include "luxfield/lightfield/quadrature.h"
#include "luxfield/reconstruct/merge/filter_profile.h"

namespace luxfield::reconstruct {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using lightfield::Basis;
using lightfield::BasisKind;

constexpr double kLargest = 2;      // spot, in spacings
constexpr int kSizesPerOctave = 2;  // more change nothing: neighbours overlap by nine tenths

// Evenly spread in the logarithm between both ends, in spacings.
std::vector<double> SpotSizes(double smallest) {
  const double octaves = std::max(0.0, std::log2(kLargest / smallest));
  const int count = std::max(1, static_cast<int>(std::lround(kSizesPerOctave * octaves)));
  std::vector<double> sizes;
  for (int k = 0; k < count; ++k)
    sizes.push_back(smallest * std::exp2(octaves * (k + 0.5) / count));
  return sizes;
}

// Coefficients that make a spot: a Gaussian whose variance lacks that of the fine function, 1/4 of
// its spacing's square.
MatrixXd Spots(int places, int finer, double size) {
  const double variance = std::pow(size * finer, 2) - 0.25;
  MatrixXd spots(places, places);
  for (int c = 0; c < places; ++c)
    for (int a = 0; a < places; ++a) spots(a, c) = std::exp(-0.5 * (a - c) * (a - c) / variance);
  return spots;
}

}  // namespace

SpotAxis::SpotAxis(const Basis& basis_, lightfield::FilterKind filter, int count, int finer,
                   double smallest) {
  const Basis fine = Basis::Make(BasisKind::kBspline2);
  const int places = finer * (count + basis_.cells - 1) - (fine.cells - 1);
  const FilterProfile profile(filter, basis_);
  seen.setZero(count, places);
  basis.setZero(count, places);
  overlap.setZero(count, count);
  for (int i = 0; i < count; ++i) {
    for (int m = 0; m < count; ++m) overlap(i, m) = profile.Overlap(m - i);
    for (int a = 0; a < places; ++a) {
      basis(i, a) = basis_.Value((a + 0.5 * fine.cells) / finer - i);
      // Knots of the filters are knots of the fine functions: polynomials of degree 4.
      for (int cell = 0; cell < fine.cells; ++cell)
        seen(i, a) += lightfield::Gauss3(a + cell, a + cell + 1, [&](double x) {
          return profile.Value(x / finer - i) * fine.Value(x - a) / finer;
        });
    }
  }
  resolved = overlap.partialPivLu().solve(seen);
  for (const double size : SpotSizes(smallest)) {
    spots.push_back(Spots(places, finer, size));
    seen_spots.push_back(seen * spots.back());
  }
}

SpotPosterior::SpotPosterior(const SpotAxis& u, const SpotAxis& v, const MatrixXd& c,
                             const MatrixXd& noise)
    : u_(&u), v_(&v), e_(u.overlap * c * v.overlap.transpose()), noise_(noise) {
  // What is dark keeps a little, so that no place is excluded for good.
  constexpr double kDark = 1e-9;
  constexpr int kRounds = 3;
  const auto relative = [&](const MatrixXd& brightness) -> Eigen::ArrayXXd {
    const Eigen::ArrayXXd lit = brightness.array().max(0.0);
    const double most = lit.maxCoeff();
    return most > 0 ? Eigen::ArrayXXd(lit / most)
                    : Eigen::ArrayXXd::Ones(brightness.rows(), brightness.cols());
  };
  places_ = (relative(u.basis.transpose() * c * v.basis) + kDark).matrix();
  Solve();
  for (int round = 0; round < kRounds; ++round) {
    MatrixXd strength = MatrixXd::Zero(places_.rows(), places_.cols());
    for (std::size_t k = 0; k < u.spots.size(); ++k) strength += Strengths(k);
    places_ = (relative(strength).square() + kDark).matrix();
    Solve();
  }
  amplitude_ = e_.cwiseProduct(weighted_).sum() / static_cast<double>(e_.size());
  mean_ = MatrixXd::Zero(places_.rows(), places_.cols());
  for (std::size_t k = 0; k < u.spots.size(); ++k)
    mean_ += u.spots[k] * Strengths(k) * v.spots[k].transpose();
}

MatrixXd SpotPosterior::Strengths(std::size_t size) const {
  const double share = 1.0 / static_cast<double>(u_->spots.size());
  return share *
         places_.cwiseProduct(u_->seen_spots[size].transpose() * weighted_ * v_->seen_spots[size]);
}

MatrixXd SpotPosterior::SeenCovariance() const {
  const Eigen::Index width = e_.rows(), height = e_.cols(), places_u = places_.rows();
  const double share = 1.0 / static_cast<double>(u_->spots.size());
  MatrixXd covariance = MatrixXd::Zero(e_.size(), e_.size());
  for (std::size_t k = 0; k < u_->spots.size(); ++k) {
    const MatrixXd &su = u_->seen_spots[k], &sv = v_->seen_spots[k];
    // Along u first: a row of weights over v for each pair of columns.
    MatrixXd pairs(width * (width + 1) / 2, places_u);
    for (Eigen::Index i = 0, pair = 0; i < width; ++i)
      for (Eigen::Index m = 0; m <= i; ++m, ++pair)
        pairs.row(pair) = su.row(i).cwiseProduct(su.row(m));
    const MatrixXd along_v = share * (pairs * places_);
    for (Eigen::Index i = 0, pair = 0; i < width; ++i)
      for (Eigen::Index m = 0; m <= i; ++m, ++pair)
        covariance.block(i * height, m * height, height, height).noalias() +=
            sv * along_v.row(pair).asDiagonal() * sv.transpose();
  }
  return covariance;
}

void SpotPosterior::Solve() {
  MatrixXd covariance = SeenCovariance();
  const double trace = covariance.trace();
  // In units of a, which is not known yet: about |e|^2 / trace. Rounding needs no more than 1e-10.
  const double about = e_.squaredNorm() / trace;
  const double rounding = 1e-10 * trace / static_cast<double>(e_.size());
  for (Eigen::Index i = 0; i < e_.rows(); ++i)
    for (Eigen::Index j = 0; j < e_.cols(); ++j)
      covariance(i * e_.cols() + j, i * e_.cols() + j) += noise_(i, j) / about + rounding;
  solver_.compute(covariance);
  const MatrixXd turned = e_.transpose();  // its columns one after the other are the order of A
  const VectorXd weighted = solver_.solve(turned.reshaped());
  weighted_ = weighted.reshaped(e_.cols(), e_.rows()).transpose();
}

Moments SpotPosterior::Of(const MatrixXd& form) const {
  const double share = 1.0 / static_cast<double>(u_->spots.size());
  MatrixXd seen = MatrixXd::Zero(e_.cols(), e_.rows());
  double prior = 0;
  for (std::size_t k = 0; k < u_->spots.size(); ++k) {
    const MatrixXd at_places = u_->spots[k].transpose() * form * v_->spots[k];
    const MatrixXd weighted = share * places_.cwiseProduct(at_places);
    prior += weighted.cwiseProduct(at_places).sum();
    seen += v_->seen_spots[k] * weighted.transpose() * u_->seen_spots[k].transpose();
  }
  const VectorXd k = seen.reshaped();
  return {form.cwiseProduct(mean_).sum(),
          amplitude_ * std::max(0.0, prior - k.dot(solver_.solve(k)))};
}

}  // namespace luxfield::reconstruct
