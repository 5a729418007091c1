#include "luxfield/reconstruct/calibrate/least_squares.h"

#include <gtest/gtest.h>

#include <cmath>

namespace luxfield::reconstruct {
namespace {

// exp(x) - 1000 from far away; or, beyond reach, what has no value.
class Residual : public ceres::SizedCostFunction<1, 1> {
 public:
  explicit Residual(bool has_value) : has_value_(has_value) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobian) const override {
    residual[0] = std::exp(x[0][0]) - 1000;
    if (jacobian && jacobian[0]) jacobian[0][0] = std::exp(x[0][0]);
    return has_value_;
  }

 private:
  const bool has_value_;
};

ceres::TerminationType Solve(bool has_value, int iterations, double* x) {
  ceres::Problem problem;
  problem.AddResidualBlock(new Residual(has_value), nullptr, x);
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  return SolveLeastSquares(options, &problem);
}

TEST(LeastSquares, SaysHowItEndedAndNothingElse) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  double x = 0;
  EXPECT_EQ(Solve(true, 1, &x), ceres::NO_CONVERGENCE);
  EXPECT_EQ(Solve(true, 100, &x), ceres::CONVERGENCE);
  EXPECT_NEAR(x, std::log(1000), 1e-6);
  x = 5;
  EXPECT_EQ(Solve(false, 100, &x), ceres::FAILURE);
  EXPECT_EQ(x, 5);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace luxfield::reconstruct
