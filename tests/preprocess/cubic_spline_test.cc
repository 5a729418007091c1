// A cubic is its own not-a-knot spline; a sine is met to fourth order.
#include "luxfield/preprocess/cubic_spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace luxfield::preprocess {
namespace {

template <typename F>
std::vector<float> Coefficients(std::size_t nodes, F f) {
  std::vector<float> c(nodes + 2, 0.0f);
  for (std::size_t k = 0; k < nodes; ++k) c[k + 1] = static_cast<float>(f(static_cast<double>(k)));
  SplineFromValues(c.data(), 1, nodes, 1);
  return c;
}

double Evaluate(const std::vector<float>& c, double x) {
  const auto cell =
      static_cast<std::size_t>(std::min(std::floor(x), static_cast<double>(c.size()) - 4));
  const auto weight = SplineWeights(x - static_cast<double>(cell));
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += weight[k] * static_cast<double>(c[cell + k]);
  return sum;
}

TEST(CubicSpline, CubicsAreExactFromFourNodesOn) {
  const auto cubic = [](double x) { return 1 + x * (0.5 + x * (-0.25 + 0.03 * x)); };
  for (const std::size_t nodes : {4, 5, 6, 7, 12}) {
    const auto c = Coefficients(nodes, cubic);
    double scale = 0;
    for (const float value : c) scale = std::max(scale, std::abs(static_cast<double>(value)));
    for (double x = 0; x <= static_cast<double>(nodes) - 1; x += 0.0625)
      EXPECT_NEAR(Evaluate(c, x), cubic(x), 2e-7 * scale) << nodes << " nodes, x = " << x;
  }
}

TEST(CubicSpline, FourthOrderUpToTheEnds) {
  const auto worst = [](std::size_t nodes) {
    const double step = 3.0 / static_cast<double>(nodes - 1);
    const auto c = Coefficients(nodes, [&](double k) { return std::sin(1 + step * k); });
    double error = 0;
    for (double x = 0; x <= static_cast<double>(nodes) - 1; x += 0.125)
      error = std::max(error, std::abs(Evaluate(c, x) - std::sin(1 + step * x)));
    return error;
  };
  EXPECT_GT(worst(9) / worst(17), 12);  // 2^4 in the limit
  EXPECT_GT(worst(17) / worst(33), 12);
}

TEST(CubicSpline, LinesOfAnArrayAreIndependent) {
  constexpr std::size_t kOuter = 3, kNodes = 6, kInner = 37;
  std::vector<float> data(kOuter * (kNodes + 2) * kInner, 0.0f);
  const auto f = [](std::size_t o, double k, std::size_t i) {
    return std::cos(static_cast<double>(o) + 0.7 * k + 0.1 * static_cast<double>(i));
  };
  for (std::size_t o = 0; o < kOuter; ++o)
    for (std::size_t k = 0; k < kNodes; ++k)
      for (std::size_t i = 0; i < kInner; ++i)
        data[(o * (kNodes + 2) + k + 1) * kInner + i] =
            static_cast<float>(f(o, static_cast<double>(k), i));
  SplineFromValues(data.data(), kOuter, kNodes, kInner);
  for (std::size_t o = 0; o < kOuter; ++o)
    for (std::size_t i = 0; i < kInner; ++i)
      for (std::size_t k = 0; k < kNodes; ++k) {
        const float* c = data.data() + (o * (kNodes + 2) + k) * kInner + i;
        const double value = ValueAtNode(static_cast<double>(c[0]), static_cast<double>(c[kInner]),
                                         static_cast<double>(c[2 * kInner]));
        EXPECT_NEAR(value, f(o, static_cast<double>(k), i), 5e-7);
      }
}

}  // namespace
}  // namespace luxfield::preprocess
