#include "luxfield/reconstruct/calibrate/response/response_model.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace luxfield::reconstruct {
namespace {

constexpr double kKnotSpacing = 0.35;
constexpr double kLeastExposure = 1e-6;  // of a polynomial that is not above 0

// The four cubic B-splines on an interval, at share f of it, and their second derivatives.
Eigen::Vector4d CubicSplines(double f) {
  const double e = 1 - f;
  return Eigen::Vector4d(e * e * e, 3 * f * f * f - 6 * f * f + 4, 3 * e * e * e - 6 * e * e + 4,
                         f * f * f) /
         6;
}

Eigen::Vector4d SecondDerivatives(double f) { return {1 - f, 3 * f - 2, 1 - 3 * f, f}; }

}  // namespace

SplineResponse::SplineResponse(double saturation_code) : saturation_code_(saturation_code) {
  lowest_u_ = LogitCode(1, saturation_code);
  const double range = -2 * lowest_u_;
  intervals_ = std::max(4, static_cast<int>(std::round(range / kKnotSpacing)));
  spacing_u_ = range / intervals_;
  parameters.resize(intervals_ + 3);
  for (int k = 0; k < parameters.size(); ++k)
    parameters[k] = 1.2 * (lowest_u_ + (k - 1) * spacing_u_);
}

double SplineResponse::LogExposure(double z) const { return Derivative(z).dot(parameters); }

Eigen::VectorXd SplineResponse::Derivative(double z) const {
  const double place = (LogitCode(z, saturation_code_) - lowest_u_) / spacing_u_;
  const double inside = std::clamp<double>(place, 0, intervals_);
  const int k = std::min(static_cast<int>(inside), intervals_ - 1);
  Eigen::VectorXd row = Eigen::VectorXd::Zero(parameters.size());
  row.segment<4>(k) = CubicSplines(inside - k);
  return row;
}

Eigen::MatrixXd SplineResponse::RoughnessRows() const {
  // g_uu is linear on an interval: two Gauss points integrate its square exactly.
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2 * intervals_, parameters.size());
  const double scale = std::sqrt(spacing_u_ / 2) / (spacing_u_ * spacing_u_);
  for (int k = 0; k < intervals_; ++k)
    for (int side = 0; side < 2; ++side)
      rows.row(2 * k + side).segment<4>(k) =
          scale * SecondDerivatives(0.5 + (side - 0.5) / std::sqrt(3.0));
  return rows;
}

PolynomialResponse::PolynomialResponse(int order, const ResponseCurve& curve)
    : saturation_code_(curve.saturation_code), reference_code_(curve.reference_code) {
  parameters = Eigen::VectorXd::Zero(order);
  const auto nodes = static_cast<int>(curve.code.size());
  Eigen::MatrixXd design(nodes, order);
  Eigen::VectorXd right(nodes);
  for (int k = 0; k < nodes; ++k) {
    const double inverse = std::exp(-curve.log_exposure[k]);
    design.row(k) = inverse * Basis(curve.code[k]);
    right[k] = 1 - inverse;
  }
  parameters = design.colPivHouseholderQr().solve(right);
}

double PolynomialResponse::LogExposure(double z) const { return std::log(Exposure(z)); }

Eigen::VectorXd PolynomialResponse::Derivative(double z) const { return Basis(z) / Exposure(z); }

Eigen::VectorXd PolynomialResponse::Basis(double z) const {
  const auto chebyshev = [&](int n, double code) {
    return std::cos(n * std::acos(std::clamp(2 * code / saturation_code_ - 1, -1.0, 1.0)));
  };
  Eigen::VectorXd basis(parameters.size());
  for (int n = 1; n <= basis.size(); ++n)
    basis[n - 1] = chebyshev(n, z) - chebyshev(n, reference_code_);
  return basis;
}

double PolynomialResponse::Exposure(double z) const {
  return std::max(1 + Basis(z).dot(parameters), kLeastExposure);
}

}  // namespace luxfield::reconstruct
