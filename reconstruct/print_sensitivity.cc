#include "reconstruct/print_sensitivity.h"

#include <cmath>

namespace luxfield::reconstruct {
namespace {

// Midpoints per cell for integrands with a logarithm: error below 1e-6 of the integral (B ln B has
// at worst x ln x ends).
constexpr int kMidpoints = 1000;
constexpr double kStep = 1e-4;  // spacings, for the derivative of the Gram function

}  // namespace

LagSums& LagSums::operator+=(const LagSums& other) {
  if (sums.empty()) return *this = other;
  for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += other.sums[k];
  return *this;
}

LagSums SumLags(const lightfield::LightField& coefficients, const lightfield::Weights& weights,
                int m) {
  const auto& grid = coefficients.geometry.grid;
  const std::size_t values = coefficients.geometry.plane_size() * coefficients.geometry.channels;
  const double* w = weights.data() + static_cast<std::size_t>(m) * values;
  const int n = grid.basis.cells, i = m % grid.width, j = m / grid.width;
  LagSums lags{n, {}};
  for (int b = 1 - n; b < n; ++b)
    for (int a = 1 - n; a < n; ++a) {
      double sum = 0;
      if (i + a >= 0 && i + a < grid.width && j + b >= 0 && j + b < grid.height) {
        const float* c =
            coefficients.data.data() + static_cast<std::size_t>(grid.index(i + a, j + b)) * values;
        for (std::size_t k = 0; k < values; ++k) sum += w[k] * c[k];
      }
      lags.sums.push_back(sum);
    }
  return lags;
}

PrintSensitivity::PrintSensitivity(const lightfield::Basis& basis, double spacing_m, double scale)
    : basis_(basis), spacing_m_(spacing_m), scale_(scale) {
  const int n = basis.cells;
  for (int a = 1 - n; a < n; ++a) {
    axis_.product.push_back(spacing_m * basis.Gram(a));
    // <B', B(. - a)> = d/de <B(. + e), B(. - a)> = d/de Gram(a + e)
    axis_.slope.push_back((basis.Gram(a + kStep) - basis.Gram(a - kStep)) / (2 * kStep));
    double logarithm = 0;
    for (int k = 0; k < n * kMidpoints; ++k) {
      const double x = (k + 0.5) / kMidpoints, value = basis.Value(x);
      if (value <= 0) continue;
      logarithm += std::log(value) * value * basis.Value(x - a) / kMidpoints;
    }
    axis_.logarithm.push_back(spacing_m * logarithm);
  }
}

double PrintSensitivity::Contract(const LagSums& lags, const std::vector<double>& u,
                                  const std::vector<double>& v) const {
  double sum = 0;
  for (std::size_t b = 0; b < v.size(); ++b)
    for (std::size_t a = 0; a < u.size(); ++a) sum += lags.sums[b * u.size() + a] * u[a] * v[b];
  return sum;
}

lightfield::Vec2 PrintSensitivity::Shift(const LagSums& lags) const {
  return {-Contract(lags, axis_.slope, axis_.product), -Contract(lags, axis_.product, axis_.slope)};
}

double PrintSensitivity::Density(const LagSums& lags) const {
  return Contract(lags, axis_.product, axis_.product);
}

double PrintSensitivity::Gamma(const LagSums& lags) const {
  return std::log(scale_) * Density(lags) + Contract(lags, axis_.logarithm, axis_.product) +
         Contract(lags, axis_.product, axis_.logarithm);
}

double PrintSensitivity::Grain(const LagSums& lags) const {
  constexpr int kPoints = 16;  // per cell and axis: polynomials of degree 8 per cell, to 1e-3
  const int n = basis_.cells, count = n * kPoints;
  double sum = 0;
  for (int y = 0; y < count; ++y)
    for (int x = 0; x < count; ++x) {
      const double px = (x + 0.5) / kPoints, py = (y + 0.5) / kPoints;
      double s = 0;
      for (int b = 1 - n; b < n; ++b)
        for (int a = 1 - n; a < n; ++a)
          s += lags.at(a, b) * basis_.Value(px - a) * basis_.Value(py - b);
      const double h = basis_.Value(px) * basis_.Value(py) * s;
      sum += h * h;
    }
  const double du = spacing_m_ / kPoints;
  return std::sqrt(sum) * du;
}

}  // namespace luxfield::reconstruct
