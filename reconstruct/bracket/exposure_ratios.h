// Exposure times from the pictures instead of the camera's word (docs/lab.md, "Exposure times").
//
// Pixel p seen by rung j (an exposure time, with what filter and lamp add) says x_pj = r_j X_p in
// units of the nominal exposure, with variance v_pj; r_j is the true over the nominal exposure. The
// ratios are those of t times lamp power: PWM and drift within an exposure are in them.
//
// Weighted least squares in ln r over all rungs and pixels at once, X_p eliminated (Gauss-Newton):
//
//   w = 1 / v,   X_p = sum_j w x e^-d / sum_j w,   o_j = w X_p^2
//   L_jk = sum_p (o_j [j = k] - o_j o_k / sum o)
//   u_j = sum_p X_p w_j (x_j e^-d - X_p)
//   L d' = u
//
// in exposures and not in their logarithms, which noise would bias. With efficient weights X_p is
// uncorrelated with x_j - X_p: the score u has no mean. Variances and the choice of samples have to
// come from the merged estimate, not from x_pj itself. Residuals beyond 3 standard deviations count
// as Huber's. Standard errors from L^-1, grown by sqrt(chi^2 / degrees) where that is above 1.
//
// Gauge: one rung of known exposure keeps r = 1. For a camera that is not linear the response has
// to be known from elsewhere (response_curve.h).
#pragma once

#include <span>
#include <vector>

#include "luxfield/core/quantity.h"

namespace luxfield::reconstruct {

struct RungSample {
  int rung = 0;
  double value = 0;     // x_pj
  double variance = 0;  // v_pj, > 0
};

class ExposureRatios {
 public:
  explicit ExposureRatios(int rungs) : rungs_(rungs) {}

  // What one pixel shows; fewer than two rungs say nothing. 24 bytes a sample are kept.
  void Add(std::span<const RungSample> pixel);
  std::size_t pixels() const { return begin_.size(); }

  struct Result {
    std::vector<core::Quantity> ratio;  // r_j with its standard error; 1 and 0 for the reference
    std::vector<bool> known;            // false: no pixel links the rung to the reference; then 1
    double chi_squared = 0, degrees = 0;
    std::vector<double> information;  // L, rungs x rungs, of all rungs
  };
  Result Solve(int reference) const;

 private:
  std::span<const RungSample> pixel(std::size_t n) const;

  int rungs_;
  std::vector<RungSample> samples_;
  std::vector<std::size_t> begin_;
};

}  // namespace luxfield::reconstruct
