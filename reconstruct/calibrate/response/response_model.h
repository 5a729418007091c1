// Families of response curves g(z) = ln I(z) for FitResponse: what the parameters of each do to g.
#pragma once

#include <Eigen/Core>

#include "luxfield/reconstruct/calibrate/response/response_curve.h"

namespace luxfield::reconstruct {

class ResponseModel {
 public:
  virtual ~ResponseModel() = default;

  virtual double LogExposure(double z) const = 0;  // g
  // dg(z) / d parameters.
  virtual Eigen::VectorXd Derivative(double z) const = 0;
  // A with |A parameters|^2 = integral of g_uu^2 du, u = LogitCode; no rows: nothing is smoothed,
  // and the model itself keeps g(reference) = 0.
  virtual Eigen::MatrixXd RoughnessRows() const = 0;

  Eigen::VectorXd parameters;
};

// Cubic B-splines of u = LogitCode(z), in which both ends of the scale count alike and every power
// of z starts straight; about 0.35 between knots, over which the curves of cameras are cubics to
// 1e-4. Starts as g = 1.2 u.
class SplineResponse : public ResponseModel {
 public:
  explicit SplineResponse(double saturation_code);
  double LogExposure(double z) const override;
  Eigen::VectorXd Derivative(double z) const override;
  Eigen::MatrixXd RoughnessRows() const override;

 private:
  double saturation_code_, lowest_u_, spacing_u_;
  int intervals_;
};

// I(z) = 1 + sum_{n = 1..order} c_n (T_n(x) - T_n(x_reference)), x = 2 z / saturation - 1 and T_n
// the Chebyshev polynomials, which keep the normal equations well conditioned.
class PolynomialResponse : public ResponseModel {
 public:
  // Least relative squares to the nodes of `curve`.
  PolynomialResponse(int order, const ResponseCurve& curve);
  double LogExposure(double z) const override;
  Eigen::VectorXd Derivative(double z) const override;
  Eigen::MatrixXd RoughnessRows() const override { return {}; }

 private:
  Eigen::VectorXd Basis(double z) const;
  double Exposure(double z) const;

  double saturation_code_, reference_code_;
};

}  // namespace luxfield::reconstruct
