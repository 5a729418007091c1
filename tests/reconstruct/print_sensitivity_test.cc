#include "reconstruct/print_sensitivity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "core/random.h"

namespace luxfield::reconstruct {
namespace {

constexpr std::uint64_t kSeed = 7;
constexpr double kSpacing_m = 0.02, kScale = 16.0 / 9;

// Q = sum w E with E behind a print T about its axis, by midpoints: no Gram function in sight.
class Print : public testing::Test {
 protected:
  Print() {
    lightfield::LuminaireGeometry g;
    g.delta_m = 0.3;
    g.grid = lightfield::BasisGrid::Centred(
        lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 4, 3, kSpacing_m);
    g.lattice = {2, 1, -0.02, 0.01, 0.02, 0.02};
    field = lightfield::LightField(g);
    core::Random random(kSeed, 0);
    std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
    for (float& c : field.data) c = static_cast<float>(random.Uniform());
    for (std::size_t k = 0; k < field.data.size(); ++k) weights.push_back(random.Uniform() - 0.4);
    for (int m = 0; m < g.grid.count(); ++m) lags += SumLags(field, weights, m);
  }

  using Transmittance =
      std::function<double(double x_m, double y_m)>;  // about the axis, over scale
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

  static double Ideal(double x_m, double y_m) {
    static const auto basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
    return basis.Value(x_m / kSpacing_m + 1.5) * basis.Value(y_m / kSpacing_m + 1.5);
  }

  lightfield::LightField field;
  lightfield::Weights weights;
  LagSums lags;
  PrintSensitivity sensitivity{lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                               kSpacing_m, kScale};
};

// Central differences of the quadrature: its own error is about 1e-4 of Q (40 midpoints a spacing,
// kinks in the slopes).
TEST_F(Print, DerivativesAreThoseOfQuadrature) {
  const double q = Quantity(Ideal), h = 1e-3 * kSpacing_m, tolerance = 2e-4 * std::abs(q);
  EXPECT_NEAR(sensitivity.Density(lags), q, tolerance);
  const auto shifted = [&](double dx, double dy) {
    return Quantity([=](double x, double y) { return Ideal(x - dx, y - dy); });
  };
  const lightfield::Vec2 shift = sensitivity.Shift(lags);
  EXPECT_NEAR(shift.x * kSpacing_m, (shifted(h, 0) - shifted(-h, 0)) / 2e-3, tolerance);
  EXPECT_NEAR(shift.y * kSpacing_m, (shifted(0, h) - shifted(0, -h)) / 2e-3, tolerance);
  const auto toned = [&](double gamma) {
    return Quantity([=](double x, double y) {
      const double t = kScale * Ideal(x, y);
      return t > 0 ? std::pow(t, 1 + gamma) / kScale : 0;
    });
  };
  EXPECT_NEAR(sensitivity.Gamma(lags), (toned(1e-3) - toned(-1e-3)) / 2e-3, tolerance);
}

// Independent grain on squares of a tenth of a spacing: variance = sum over squares of (Q of that
// square alone)^2.
TEST_F(Print, GrainAddsInSquares) {
  constexpr int kSquares = 30;
  const double size = kSpacing_m / 10;
  double variance = 0;
  for (int j = 0; j < kSquares; ++j)
    for (int i = 0; i < kSquares; ++i) {
      const double x0 = -1.5 * kSpacing_m + i * size, y0 = -1.5 * kSpacing_m + j * size;
      const double alone = Quantity([=](double x, double y) {
        return x >= x0 && x < x0 + size && y >= y0 && y < y0 + size ? Ideal(x, y) : 0;
      });
      variance += alone * alone;
    }
  // The squares average Phi S over a tenth of a spacing: 1 % of its variation.
  EXPECT_NEAR(sensitivity.Grain(lags) * size, std::sqrt(variance), 0.01 * std::sqrt(variance));
}

}  // namespace
}  // namespace luxfield::reconstruct
