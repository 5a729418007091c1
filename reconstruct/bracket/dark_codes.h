// Pixels in the dark by what an ADC really gives: where noise does not dither the rounding, or 0 DN
// clips it, a sample's mean is no line and its variance not the analogue one.
//
//   y = clip(round(black + gain N + read noise)),  N ~ Poisson(lambda),   lambda_n = X c_n + D_n
//   m(lambda) = E y = sum_N P(N | lambda) E[y | N],   v(lambda) = var y,
//   m'(lambda) = sum_N P(N | lambda) (E[y | N + 1] - E[y | N])
//
// exactly for the sensor as it is stated. X solves sum_n c_n m'_n (y_n - m_n) / v_n = 0 (quasi-
// likelihood, Wedderburn 1974) by Fisher scoring: unbiased to second order as the weighted mean of
// merge_exposures.h is once the bend of m is allowed for, which shifts the root by
//
//   -sum c^3 m' m'' / v / (2 I^2),   I = sum c^2 m'^2 / v
//
// (the terms of v' cancel as they do where m is a line). Its information I is within 0.1 % of the
// codes' own (bench/bench_exposures.h) on 20 electrons per DN and on a black level of one read
// noise.
#pragma once

#include <span>
#include <vector>

#include "luxfield/rig/sensor_model.h"

namespace luxfield::reconstruct {

class DarkCodes {
 public:
  // Tabulates m, m' and v over sqrt(lambda) in steps of 0.05 electrons^1/2, as far as rounding is
  // not dithered or 0 DN within `margin` standard deviations; linear in between: off by less than
  // 1e-3 standard deviations. Double.
  DarkCodes(const rig::SensorModel& sensor, double margin);

  struct Moments {
    double mean = 0, variance = 0;    // DN, DN^2
    double slope = 0, curvature = 0;  // m', m'': DN per electron, and per its square
  };
  Moments At(double electrons) const;  // below 0: the line through m(0)

  struct Sample {
    double dn = 0;
    double electrons_per_x = 0, dark_electrons = 0;  // c, D
  };
  struct Estimate {
    double x = 0, information = 0, squared_weights = 0;  // sum w, sum w^2 with w = c^2 m'^2 / v
  };
  // From a start within a few standard deviations.
  Estimate Solve(std::span<const Sample> samples, double start) const;

 private:
  rig::SensorModel sensor_;
  std::vector<Moments> table_;
};

}  // namespace luxfield::reconstruct
