#include "luxfield/reconstruct/budget/print_sensitivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

constexpr std::uint64_t kSeed = 7;
constexpr double kSpacing_m = 0.02, kScale = 16.0 / 9;

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::FilterKind;

// Q = sum w E with E behind a print T about its axis, or the difference of a pair, by midpoints: no
// Gram function in sight.
class Print : public testing::TestWithParam<FilterKind> {
 protected:
  Print() {
    lightfield::LuminaireGeometry g;
    g.delta_m = 0.3;
    g.grid = lightfield::BasisGrid::Centred(basis, 4, 3, kSpacing_m);
    g.lattice = {2, 1, -0.02, 0.01, 0.02, 0.02};
    field = lightfield::LightField(g);
    core::Random random(kSeed, 0);
    std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
    for (float& c : field.data) c = static_cast<float>(random.Uniform());
    for (std::size_t k = 0; k < field.data.size(); ++k) weights.push_back(random.Uniform() - 0.4);
    for (int m = 0; m < g.grid.count(); ++m) lags += SumLags(field, weights, m);
  }

  using Transmittance =
      std::function<double(double x_m, double y_m)>;  // about the axis; Phi, or Phi* of the pair
  double Quantity(const Transmittance& print) const {
    const auto& g = field.geometry;
    constexpr int kPoints = 160;
    const double half = 2 * kSpacing_m, du = 2 * half / kPoints;  // half a spacing around the print
    double q = 0;
    for (int m = 0; m < g.grid.count(); ++m) {
      const auto centre = g.grid.centre(m % g.grid.width, m / g.grid.width);
      for (int y = 0; y < kPoints; ++y)
        for (int x = 0; x < kPoints; ++x) {
          const lightfield::Vec2 at{(x + 0.5) * du - half, (y + 0.5) * du - half};
          const double t = print(at.x, at.y);
          if (t == 0) continue;
          for (int n = 0; n < g.grid.count(); ++n) {
            const double phi = g.grid.Phi(n % g.grid.width, n / g.grid.width, centre + at);
            for (int k = 0; k < 2; ++k)
              q += weights[m * 2 + k] * t * field.data[n * 2 + k] * phi * du * du;
          }
        }
    }
    return q;
  }

  static bool Dual() { return GetParam() == FilterKind::kDual; }
  double Ideal(double x_m, double y_m) const {
    const double x = x_m / kSpacing_m, y = y_m / kSpacing_m, middle = 0.5 * basis.cells;
    return Dual() ? basis.DualValue(x) * basis.DualValue(y)
                  : basis.Value(x + middle) * basis.Value(y + middle);
  }

  const Basis basis = Basis::Make(Dual() ? BasisKind::kQuadratic : BasisKind::kBspline2);
  lightfield::LightField field;
  lightfield::Weights weights;
  LagSums lags;
  PrintSensitivity sensitivity{GetParam(), basis, kSpacing_m, kScale};
};

// Central differences of the quadrature: its own error is about 1e-4 of Q, 2e-3 of that of the
// steep and signed dual function (40 midpoints a spacing, kinks in the slopes).
TEST_P(Print, DerivativesAreThoseOfQuadrature) {
  const auto ideal = [&](double x, double y) { return Ideal(x, y); };
  const double q = Quantity(ideal), h = 1e-3 * kSpacing_m,
               tolerance = (Dual() ? 2e-3 : 2e-4) * std::abs(q);
  EXPECT_NEAR(sensitivity.Density(lags), q, tolerance);
  const auto [plus, minus] = sensitivity.DensityOfPrints(lags);
  EXPECT_NEAR(plus, Quantity([&](double x, double y) { return std::max(Ideal(x, y), 0.0); }),
              tolerance);
  EXPECT_NEAR(minus, Quantity([&](double x, double y) { return std::min(Ideal(x, y), 0.0); }),
              tolerance);
  const auto shifted = [&](double dx, double dy) {
    return Quantity([=, this](double x, double y) { return Ideal(x - dx, y - dy); });
  };
  const lightfield::Vec2 shift = sensitivity.Shift(lags);
  EXPECT_NEAR(shift.x * kSpacing_m, (shifted(h, 0) - shifted(-h, 0)) / 2e-3, tolerance);
  EXPECT_NEAR(shift.y * kSpacing_m, (shifted(0, h) - shifted(0, -h)) / 2e-3, tolerance);
  // Small shifts are of first order; larger ones those of quadrature at the same nodes.
  EXPECT_NEAR(sensitivity.ShiftVariance(lags, 1e-4 * h) / std::pow(1e-4 * h, 2),
              shift.x * shift.x + shift.y * shift.y,
              1e-3 * (shift.x * shift.x + shift.y * shift.y));
  const double step = 0.05 * kSpacing_m;
  double square = 0;
  for (const int k : {-1, 0, 1})
    for (const int l : {-1, 0, 1}) {
      const double off = shifted(k * std::sqrt(3.0) * step, l * std::sqrt(3.0) * step) - q;
      square += (k ? 1.0 : 4.0) / 6 * (l ? 1.0 : 4.0) / 6 * off * off;
    }
  EXPECT_NEAR(std::sqrt(sensitivity.ShiftVariance(lags, step)), std::sqrt(square), tolerance);
  const auto stretch = sensitivity.Stretch(lags);
  for (int entry = 0; entry < 4; ++entry) {
    const auto stretched = [&](double by) {
      return Quantity([=, this](double x, double y) {
        const double move = by * (entry % 2 ? y : x);
        return entry < 2 ? Ideal(x - move, y) : Ideal(x, y - move);
      });
    };
    EXPECT_NEAR(stretch[entry], (stretched(1e-3) - stretched(-1e-3)) / 2e-3, tolerance) << entry;
  }
  const auto peaks = Dual() ? basis.DualPeaks() : std::array<double, 2>{1 / kScale, 1};
  const auto toned = [&](double gamma) {
    return Quantity([=, this](double x, double y) {
      const double phi = Ideal(x, y), peak = phi > 0 ? peaks[0] : peaks[1];
      return std::copysign(peak * std::pow(std::abs(phi) / peak, 1 + gamma), phi);
    });
  };
  EXPECT_NEAR(sensitivity.Gamma(lags), (toned(1e-3) - toned(-1e-3)) / 2e-3, tolerance);
}

// Independent grain on squares of a tenth of a spacing: variance = sum over squares of (Q of that
// square alone)^2.
TEST_P(Print, GrainAddsInSquares) {
  constexpr int kSquares = 30;
  const double size = kSpacing_m / 10;
  double variance = 0;
  for (int j = 0; j < kSquares; ++j)
    for (int i = 0; i < kSquares; ++i) {
      const double x0 = -1.5 * kSpacing_m + i * size, y0 = -1.5 * kSpacing_m + j * size;
      const double alone = Quantity([=, this](double x, double y) {
        return x >= x0 && x < x0 + size && y >= y0 && y < y0 + size ? Ideal(x, y) : 0;
      });
      variance += alone * alone;
    }
  // The squares average Phi S over a tenth of a spacing: 1 % of its variation.
  EXPECT_NEAR(sensitivity.Grain(lags) * size, std::sqrt(variance), 0.01 * std::sqrt(variance));
}

INSTANTIATE_TEST_SUITE_P(Filters, Print, testing::Values(FilterKind::kBasis, FilterKind::kDual));

}  // namespace
}  // namespace luxfield::reconstruct
