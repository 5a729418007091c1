// The least squares of FitResponse: a response curve and the radiance of every sample together.
//
//   log        sum_ij rho(w_ij (g(z_ij) + b_ij - ln X_i - ln t_j))
//   exposure   sum_ij rho(w_ij (I(z_ij) - t_j X_i) / I_p,ij)
//
// with w the inverse of the relative standard deviation of an exposure, b = 1 / (2 w^2) what noise
// takes from the mean of a logarithm, I_p the exposure that the last solution predicts, rho Huber's
// loss. A step is linear in the curve's parameters with dg at the *predicted* code: a derivative
// with the code's own noise in it would be correlated with the residual and bend the curve. At the
// solution of repeated steps that leaves the quasi-score of the predicted codes, which has no mean.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "luxfield/reconstruct/calibrate/response/response_model.h"
#include "luxfield/reconstruct/calibrate/response/response_samples.h"

namespace luxfield::reconstruct {

enum class ResponseLikelihood { kLog, kExposure };

struct CodeObservation {
  int sample = 0;
  double code = 0, log_t = 0;
  double predicted_code = 0;
  double weight = 0;    // 0: does not count
  double log_bias = 0;  // b
  double leverage = 0;  // share of this code in its own prediction
};

// Of the curve's parameters, with all radiances eliminated.
struct CurveInformation {
  Eigen::MatrixXd data, covariance;
  double parameters_fixed = 0;  // trace(covariance data): parameters that the data and not
                                // smoothness decide
  double chi_squared = 0, degrees = 0;
};

class JointResponse {
 public:
  JointResponse(const ResponseSamples& samples, std::span<const double> exposures_s,
                double reference_code, double huber_sigmas);

  std::vector<CodeObservation> observations;  // of a sample: one after the other

  double log_exposure(const CodeObservation& o) const { return log_x_[o.sample] + o.log_t; }

  // Observations of samples that count in one exposure alone say nothing: their weights become 0.
  // Returns how many samples are left.
  int KeepPairs();
  // Radiances by the model as it is.
  void StartRadiances(const ResponseModel& model);
  // One step of model.parameters and radiances, by Ceres with the radiances as Schur complement.
  // `smoothness` s: the prior of g is that of a g_uu that is white noise of standard deviation s.
  // False, and nothing changed: no step is downhill, as where the samples leave parameters open.
  bool Step(ResponseModel& model, ResponseLikelihood likelihood, double smoothness);
  // Also sets leverages.
  CurveInformation Information(const ResponseModel& model, double smoothness);

 private:
  double RobustWeight(const ResponseModel& model, const CodeObservation& o) const;
  template <typename Body>
  void ForSamples(const Body& body);

  double reference_code_, huber_sigmas_;
  std::vector<double> log_x_;
};

}  // namespace luxfield::reconstruct
