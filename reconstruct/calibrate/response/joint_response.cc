#include "luxfield/reconstruct/calibrate/response/joint_response.h"

#include <ceres/normal_prior.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "luxfield/reconstruct/calibrate/least_squares.h"

namespace luxfield::reconstruct {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Holds g(reference) at 0, which no other term does; any value gives the same curve.
constexpr double kGaugeWeight = 100;

// A code's residual; parameters: the step of the curve's, ln X.
class CodeResidual : public ceres::CostFunction {
 public:
  // `value`: g(z) of the last solution, with its bias; `predicted`: ln I_p.
  CodeResidual(ResponseLikelihood likelihood, const CodeObservation& o, VectorXd derivative,
               double value, double predicted)
      : log_(likelihood == ResponseLikelihood::kLog),
        derivative_(std::move(derivative)),
        weight_(o.weight),
        value_(log_ ? value : std::exp(value - predicted)),
        log_t_(log_ ? o.log_t : o.log_t - predicted) {
    set_num_residuals(1);
    *mutable_parameter_block_sizes() = {static_cast<int>(derivative_.size()), 1};
  }

  bool Evaluate(double const* const* p, double* residual, double** jacobian) const override {
    const double y = *p[1] + log_t_, predicted = log_ ? y : std::exp(y);
    const Eigen::Map<const VectorXd> step(p[0], derivative_.size());
    residual[0] = weight_ * (value_ + derivative_.dot(step) - predicted);
    if (jacobian && jacobian[0])
      Eigen::Map<VectorXd>(jacobian[0], derivative_.size()) = weight_ * derivative_;
    if (jacobian && jacobian[1]) *jacobian[1] = -weight_ * (log_ ? 1 : predicted);
    return true;
  }

 private:
  const bool log_;
  const VectorXd derivative_;
  const double weight_, value_, log_t_;
};

bool Run(ceres::Problem& problem, const double* curve) {
  ceres::Solver::Options how;
  how.linear_solver_type = ceres::DENSE_SCHUR;
  how.max_num_iterations = 20;
  how.function_tolerance = 1e-9;
  how.initial_trust_region_radius = 1e8;  // nearly linear: no damping
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<double*> blocks;
  problem.GetParameterBlocks(&blocks);
  for (double* block : blocks) ordering->AddElementToGroup(block, block == curve ? 1 : 0);
  how.linear_solver_ordering = ordering;
  // A step whose iterations ran out goes on in the next one.
  return SolveLeastSquares(how, &problem) != ceres::FAILURE;
}

}  // namespace

JointResponse::JointResponse(const ResponseSamples& samples, std::span<const double> exposures_s,
                             double reference_code, double huber_sigmas)
    : reference_code_(reference_code), huber_sigmas_(huber_sigmas), log_x_(samples.count(), 0.0) {
  for (int i = 0; i < samples.count(); ++i)
    for (int j = 0; j < samples.exposures; ++j)
      if (const std::size_t n = samples.index(i, j); samples.usable[n]) {
        CodeObservation o;
        o.sample = i;
        o.code = samples.code[n];
        o.log_t = std::log(exposures_s[j]);
        observations.push_back(o);
      }
}

// body(first, last): the observations of a sample.
template <typename Body>
void JointResponse::ForSamples(const Body& body) {
  for (std::size_t first = 0; first < observations.size();) {
    std::size_t last = first;
    while (last < observations.size() && observations[last].sample == observations[first].sample)
      ++last;
    body(first, last);
    first = last;
  }
}

int JointResponse::KeepPairs() {
  int left = 0;
  ForSamples([&](std::size_t first, std::size_t last) {
    int count = 0;
    for (std::size_t n = first; n < last; ++n) count += observations[n].weight > 0;
    left += count >= 2;
    if (count < 2)
      for (std::size_t n = first; n < last; ++n) observations[n].weight = 0;
  });
  return left;
}

void JointResponse::StartRadiances(const ResponseModel& model) {
  ForSamples([&](std::size_t first, std::size_t last) {
    double weights = 0, sum = 0;
    for (std::size_t n = first; n < last; ++n) {
      const CodeObservation& o = observations[n];
      weights += o.weight * o.weight;
      sum += o.weight * o.weight * (model.LogExposure(o.code) - o.log_t);
    }
    if (weights > 0) log_x_[observations[first].sample] = sum / weights;
  });
}

bool JointResponse::Step(ResponseModel& model, ResponseLikelihood likelihood, double smoothness) {
  ceres::HuberLoss huber(huber_sigmas_);
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(options);
  VectorXd step = VectorXd::Zero(model.parameters.size());
  for (const CodeObservation& o : observations) {
    if (!(o.weight > 0)) continue;
    const double bias = likelihood == ResponseLikelihood::kLog ? o.log_bias : 0;
    problem.AddResidualBlock(new CodeResidual(likelihood, o, model.Derivative(o.predicted_code),
                                              model.LogExposure(o.code) + bias, log_exposure(o)),
                             &huber, step.data(), &log_x_[o.sample]);
  }
  if (const MatrixXd rows = model.RoughnessRows(); rows.rows() > 0) {
    problem.AddResidualBlock(new ceres::NormalPrior(rows / smoothness, -model.parameters), nullptr,
                             step.data());
    problem.AddResidualBlock(
        new ceres::NormalPrior(kGaugeWeight * model.Derivative(reference_code_).transpose(),
                               -model.parameters),
        nullptr, step.data());
  }
  if (!Run(problem, step.data())) return false;
  model.parameters += step;
  return true;
}

double JointResponse::RobustWeight(const ResponseModel& model, const CodeObservation& o) const {
  const double r = std::abs(o.weight * (model.LogExposure(o.code) + o.log_bias - log_exposure(o)));
  return std::min(1.0, huber_sigmas_ / std::max(r, 1e-30)) * o.weight * o.weight;
}

CurveInformation JointResponse::Information(const ResponseModel& model, double smoothness) {
  const auto size = model.parameters.size();
  CurveInformation result;
  result.data = MatrixXd::Zero(size, size);
  // Rows of the radiances' complement: sqrt(w) (dg - the sample's weighted mean of dg).
  std::vector<std::pair<std::size_t, VectorXd>> rows;
  ForSamples([&](std::size_t first, std::size_t last) {
    double weights = 0;
    VectorXd mean = VectorXd::Zero(size);
    std::vector<std::pair<std::size_t, VectorXd>> own;
    for (std::size_t n = first; n < last; ++n) {
      const CodeObservation& o = observations[n];
      if (!(o.weight > 0)) continue;
      const double w = RobustWeight(model, o);
      own.emplace_back(n, model.Derivative(o.predicted_code));
      mean += w * own.back().second;
      weights += w;
      const double r = o.weight * (model.LogExposure(o.code) + o.log_bias - log_exposure(o)),
                   share = w / (o.weight * o.weight);
      result.chi_squared += share * r * r * (2 - share);
      result.degrees += 1;
    }
    if (own.empty()) return;
    mean /= weights;
    result.degrees -= 1;
    for (auto& [n, row] : own) {
      const double w = RobustWeight(model, observations[n]);
      observations[n].leverage = w / weights;
      row = std::sqrt(w) * (row - mean);
      result.data.selfadjointView<Eigen::Lower>().rankUpdate(row);
      rows.emplace_back(n, std::move(row));
    }
  });
  result.data = MatrixXd(result.data.selfadjointView<Eigen::Lower>());
  MatrixXd information = result.data;
  if (const MatrixXd roughness = model.RoughnessRows(); roughness.rows() > 0) {
    const VectorXd reference = kGaugeWeight * model.Derivative(reference_code_);
    information += roughness.transpose() * roughness / (smoothness * smoothness) +
                   reference * reference.transpose();
  }
  result.covariance = information.ldlt().solve(MatrixXd::Identity(size, size));
  result.parameters_fixed = result.covariance.cwiseProduct(result.data).sum();
  result.degrees -= result.parameters_fixed;
  for (const auto& [n, row] : rows) observations[n].leverage += row.dot(result.covariance * row);
  return result;
}

}  // namespace luxfield::reconstruct
