#include "luxfield/reconstruct/budget/print_sensitivity.h"

#include <cmath>

namespace luxfield::reconstruct {
namespace {

// Midpoints per cell for integrands with a logarithm: error below 1e-6 of the integral (B ln B has
// at worst x ln x ends).
constexpr int kMidpoints = 1000;
constexpr double kStep = 1e-4;  // spacings, for derivatives of overlaps

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

PrintSensitivity::PrintSensitivity(lightfield::FilterKind filter, const lightfield::Basis& basis,
                                   double spacing_m, double scale)
    : basis_(basis),
      profile_(filter, basis),
      spacing_m_(spacing_m),
      peaks_(filter == lightfield::FilterKind::kDual ? basis.DualPeaks()
                                                     : std::array<double, 2>{1 / scale, 1}) {
  const int n = basis.cells;
  for (int a = 1 - n; a < n; ++a) {
    const double overlap = profile_.Overlap(a), moment = profile_.Moment(a);
    axis_.product.push_back(spacing_m * overlap);
    axis_.moment.push_back(spacing_m * spacing_m * moment);
    // <f', B(. - a)> = d/de <f(. + e), B(. - a)> = d/de Overlap(a + e), and likewise
    // <x f', B(. - a)> = d/de [Moment(a + e) - e Overlap(a + e)] at e = 0.
    const auto slope = [&](auto&& of) { return (of(a + kStep) - of(a - kStep)) / (2 * kStep); };
    axis_.slope.push_back(slope([&](double x) { return profile_.Overlap(x); }));
    axis_.moment_slope.push_back(spacing_m *
                                 (slope([&](double x) { return profile_.Moment(x); }) - overlap));
    axis_.plus.push_back(spacing_m * profile_.PartOverlap(1, a));
    axis_.minus.push_back(spacing_m * profile_.PartOverlap(-1, a));
    double logarithm = 0;
    for (int k = 0; k < n * kMidpoints; ++k) {
      const double x = (k + 0.5) / kMidpoints, value = profile_.Value(x);
      if (value == 0) continue;
      logarithm += std::log(std::abs(value)) * value * basis.Value(x - a) / kMidpoints;
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

// Gauss-Hermite, three nodes per axis: exact for the square of what is of second order in the
// shift.
double PrintSensitivity::ShiftVariance(const LagSums& lags, double sigma_m) const {
  struct Node {
    double weight;
    std::vector<double> overlap;
  };
  std::vector<Node> nodes;
  const int n = basis_.cells;
  for (const int k : {-1, 0, 1}) {
    Node& node = nodes.emplace_back(Node{k == 0 ? 2.0 / 3 : 1.0 / 6, {}});
    const double shift = k * std::sqrt(3.0) * sigma_m / spacing_m_;
    for (int a = 1 - n; a < n; ++a)
      node.overlap.push_back(spacing_m_ * profile_.Overlap(a - shift));
  }
  const double at_rest = Density(lags);
  double mean = 0;
  for (const Node& u : nodes)
    for (const Node& v : nodes)
      mean += u.weight * v.weight * std::pow(Contract(lags, u.overlap, v.overlap) - at_rest, 2);
  return mean;
}

// dPhi = -grad Phi . (L x).
std::array<double, 4> PrintSensitivity::Stretch(const LagSums& lags) const {
  return {-Contract(lags, axis_.moment_slope, axis_.product),
          -Contract(lags, axis_.slope, axis_.moment), -Contract(lags, axis_.moment, axis_.slope),
          -Contract(lags, axis_.product, axis_.moment_slope)};
}

double PrintSensitivity::Density(const LagSums& lags) const {
  return Contract(lags, axis_.product, axis_.product);
}

std::array<double, 2> PrintSensitivity::DensityOfPrints(const LagSums& lags) const {
  return {Contract(lags, axis_.plus, axis_.plus) + Contract(lags, axis_.minus, axis_.minus),
          -Contract(lags, axis_.plus, axis_.minus) - Contract(lags, axis_.minus, axis_.plus)};
}

// T = |Phi| / peak, so that sum of peak T ln T, signed, is Phi ln|Phi| - |Phi| ln(peak), signed.
double PrintSensitivity::Gamma(const LagSums& lags) const {
  const auto [positive, negative] = DensityOfPrints(lags);
  return Contract(lags, axis_.logarithm, axis_.product) +
         Contract(lags, axis_.product, axis_.logarithm) - std::log(peaks_[0]) * positive -
         std::log(peaks_[1]) * negative;
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
      const double h = profile_.Value(px) * profile_.Value(py) * s;
      sum += h * h;
    }
  const double du = spacing_m_ / kPoints;
  return std::sqrt(sum) * du;
}

}  // namespace luxfield::reconstruct
