// Interpolating cubic splines with uniform nodes and not-a-knot ends (de Boor 1978), along one axis
// of an array of float32. Internal to preprocess/.
//
//   f(x) = sum_k c[k] B(x - k + 1),   B the cubic B-spline on [-2, 2]: 2/3 at 0, 1/6 at +-1
//
// x counts nodes from 0; coefficients 0 .. nodes + 1, nodes >= 4.
#pragma once

#include <array>
#include <cstddef>

namespace luxfield::preprocess {

// The array is [outer][nodes + 2][inner]; replaces the values at 1 .. nodes by the coefficients
// 0 .. nodes + 1. Double arithmetic, rounded to float32 at the end.
void SplineFromValues(float* data, std::size_t outer, std::size_t nodes, std::size_t inner);

// The values that coefficients before, at and after a node stand for.
inline double ValueAtNode(double before, double at, double after) {
  return (before + 4 * at + after) / 6;
}

// Weights of coefficients k .. k + 3 at x = k + f, 0 <= f <= 1.
inline std::array<double, 4> SplineWeights(double f) {
  const double g = 1 - f;
  return {g * g * g / 6, 2.0 / 3 - f * f * (1 - f / 2), 2.0 / 3 - g * g * (1 - g / 2),
          f * f * f / 6};
}

}  // namespace luxfield::preprocess
