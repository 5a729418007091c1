// Every basis against its definition: the formulas of docs/theory.md 2 evaluated here by dense
// composite quadrature in double.
#include "luxfield/lightfield/basis.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"

namespace luxfield::lightfield {
namespace {

// The functions as the theory prints them, on their support [0, n).
double Printed(BasisKind kind, double a, double x) {
  switch (kind) {
    case BasisKind::kBox:
      return x >= 0 && x < 1 ? 1 : 0;
    case BasisKind::kBilinear:
      return std::max(0.0, 1 - std::abs(x - 1));
    case BasisKind::kQuadratic: {
      const double r = std::abs(x - 1);
      return r <= 1 ? (1 - r) * (1 - a * r) : 0;
    }
    case BasisKind::kBspline2:
      if (x < 0 || x >= 3) return 0;
      if (x < 1) return x * x / 2;
      if (x < 2) return (-2 * x * x + 6 * x - 3) / 2;
      return (3 - x) * (3 - x) / 2;
  }
  return NAN;
}

// Composite Simpson on 1/64 steps aligned with the knots, plus the two ragged ends: an independent
// rule, exact for cubics.
double Simpson(double x0, double x1, const std::function<double(double)>& f) {
  double sum = 0, x = x0;
  while (x < x1) {
    const double next = std::min(x1, (std::floor(x * 64 + 1e-9) + 1) / 64);
    // Nudged inside, so that a jump on the border counts for its own side only.
    const double e = 1e-13;
    sum += (next - x) / 6 * (f(x + e) + 4 * f(0.5 * (x + next)) + f(next - e));
    x = next;
  }
  return sum;
}

std::vector<Basis> AllBases() {
  return {Basis::Make(BasisKind::kBox),
          Basis::Make(BasisKind::kBilinear),
          Basis::Make(BasisKind::kQuadratic, 0.5),
          Basis::Make(BasisKind::kQuadratic, -1),
          Basis::Make(BasisKind::kQuadratic, 1),
          Basis::Make(BasisKind::kQuadratic, 0),
          Basis::Make(BasisKind::kBspline2)};
}

TEST(Basis, ValuesAreThePrintedFormulas) {
  for (const Basis& basis : AllBases())
    for (double x = -0.51; x < 3.6; x += 0.0137)
      EXPECT_NEAR(basis.Value(x), Printed(basis.kind, basis.a, x), 1e-15)
          << basis.name() << " a=" << basis.a << " x=" << x;
}

TEST(Basis, ValueOutsideTheSupportOrNotANumberIsZero) {
  for (const Basis& basis : AllBases())
    for (const double x : {-1e300, -1e-300, 3.0, 1e300, double{NAN}, double{INFINITY}})
      EXPECT_EQ(basis.Value(x), 0) << basis.name() << ' ' << x;
}

TEST(Basis, IntegralsAndMomentsMatchQuadrature) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  for (const Basis& basis : AllBases())
    for (int k = 0; k < 200; ++k) {
      double x0 = 5 * random.Uniform() - 1, x1 = 5 * random.Uniform() - 1;
      if (x0 > x1) std::swap(x0, x1);
      const double origin = 4 * random.Uniform() - 2;
      const auto printed = [&](double x) { return Printed(basis.kind, basis.a, x); };
      // Simpson's nudge of 1e-13 costs as much where the function has a slope.
      EXPECT_NEAR(basis.Integral(x0, x1), Simpson(x0, x1, printed), 1e-12);
      EXPECT_NEAR(basis.FirstMoment(x0, x1, origin),
                  Simpson(x0, x1, [&](double x) { return (x - origin) * printed(x); }), 1e-11);
    }
}

TEST(Basis, TinyIntervalsKeepTheirRelativePrecision) {
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  const double x = 0.75, dx = 0x1p-40;
  EXPECT_NEAR(basis.Integral(x, x + dx) / (dx * Printed(basis.kind, 0, x)), 1, 4e-12);
  EXPECT_EQ(basis.Integral(x, x), 0);
}

TEST(Basis, TotalsAndPeaks) {
  EXPECT_NEAR(Basis::Make(BasisKind::kBox).TotalIntegral(), 1, 1e-15);
  EXPECT_NEAR(Basis::Make(BasisKind::kBilinear).TotalIntegral(), 1, 1e-15);
  EXPECT_NEAR(Basis::Make(BasisKind::kQuadratic, 0.5).TotalIntegral(), 1 - 0.5 / 3, 1e-15);
  EXPECT_NEAR(Basis::Make(BasisKind::kBspline2).TotalIntegral(), 1, 1e-15);
  EXPECT_EQ(Basis::Make(BasisKind::kBox).Peak(), 1);
  EXPECT_EQ(Basis::Make(BasisKind::kBilinear).Peak(), 1);
  EXPECT_EQ(Basis::Make(BasisKind::kBspline2).Peak(), 0.75);
  for (const double a : {-1.0, 0.0, 0.5, 1.0})
    EXPECT_EQ(Basis::Make(BasisKind::kQuadratic, a).Peak(), 1) << a;
}

TEST(Basis, PartitionOfUnityWhereTheTheorySaysSo) {
  for (double x = 0; x < 1; x += 0.0625) {
    for (const BasisKind kind : {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kBspline2}) {
      const Basis basis = Basis::Make(kind);
      double sum = 0;
      for (int k = 0; k < basis.cells; ++k) sum += basis.Value(x + k);
      EXPECT_NEAR(sum, 1, 1e-15) << basis.name() << ' ' << x;
    }
    for (const double a : {0.0, 0.5, -1.0}) {
      const Basis basis = Basis::Make(BasisKind::kQuadratic, a);
      EXPECT_NEAR(basis.Value(x) + basis.Value(x + 1), 1 - 2 * a * x * (1 - x), 1e-15);
    }
  }
}

TEST(Gram, ClosedForms) {
  const Basis bspline = Basis::Make(BasisKind::kBspline2);
  EXPECT_NEAR(bspline.Gram(0), 11.0 / 20, 1e-15);
  EXPECT_NEAR(bspline.Gram(1), 13.0 / 60, 1e-15);
  EXPECT_NEAR(bspline.Gram(2), 1.0 / 120, 1e-16);
  EXPECT_EQ(bspline.Gram(3), 0);
  const Basis tent = Basis::Make(BasisKind::kBilinear);
  EXPECT_NEAR(tent.Gram(0), 2.0 / 3, 1e-15);
  EXPECT_NEAR(tent.Gram(1), 1.0 / 6, 1e-15);
  EXPECT_EQ(tent.Gram(-2), 0);
  const Basis box = Basis::Make(BasisKind::kBox);
  EXPECT_NEAR(box.Gram(0), 1, 1e-15);
  EXPECT_EQ(box.Gram(1), 0);
}

TEST(Gram, AnyOffsetAndClippingMatchQuadrature) {
  constexpr std::uint64_t kSeed = 12;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  for (const Basis& basis : AllBases())
    for (int k = 0; k < 20; ++k) {
      // Offsets on the 1/64 lattice of the rule, so that it meets every knot of both factors.
      const double offset = std::round(64 * (6 * random.Uniform() - 3)) / 64;
      const double lo = 3 * random.Uniform() - 1, hi = lo + 3 * random.Uniform();
      const auto product = [&](double x) {
        return Printed(basis.kind, basis.a, x) * Printed(basis.kind, basis.a, x - offset);
      };
      // Simpson on 1/64 steps: error h^4 f''''/2880 < 1e-8 for these quartics.
      EXPECT_NEAR(basis.Gram(offset), Simpson(-4, 7, product), 2e-8) << basis.name();
      EXPECT_NEAR(basis.GramClipped(offset, lo, hi), Simpson(lo, hi, product), 2e-8);
    }
}

TEST(Gram, MatricesCarryTheSpacingAndClipAtTheBorder) {
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  const double h = 0.0165;
  const auto full = GramMatrix(basis, 6, h);
  EXPECT_NEAR(full[2 * 6 + 2], h * 11 / 20, 1e-17);
  EXPECT_NEAR(full[2 * 6 + 3], h * 13 / 60, 1e-17);
  EXPECT_NEAR(full[4 * 6 + 2], h / 120, 1e-18);
  // Clipping away nothing changes nothing; clipping the outer two cells leaves only [2, 3] of the
  // first function.
  const auto same = GramMatrixClipped(basis, 6, h, -1, 1);
  for (std::size_t k = 0; k < full.size(); ++k) EXPECT_NEAR(same[k], full[k], 1e-17);
  const auto clipped = GramMatrixClipped(basis, 6, h, 2 * h, 6 * h);
  EXPECT_NEAR(clipped[0], h / 20, 1e-17);  // integral of ((1-f)^2/2)^2
  EXPECT_NEAR(clipped[1], h * 13 / 120, 1e-17);
  EXPECT_NEAR(clipped[2 * 6 + 2], h * 11 / 20, 1e-17);
}

TEST(Gram, InteriorSymbolAndConditionNumberOfTheTheory) {
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  const auto symbol = [&](double w) {
    return basis.Gram(0) + 2 * basis.Gram(1) * std::cos(w) + 2 * basis.Gram(2) * std::cos(2 * w);
  };
  EXPECT_NEAR(symbol(0), 1, 1e-15);
  EXPECT_NEAR(symbol(std::numbers::pi), 16.0 / 120, 1e-15);

  const auto matrix = [&](int n) {
    const auto gram = GramMatrix(basis, n, 1);
    return Eigen::MatrixXd(Eigen::Map<const Eigen::MatrixXd>(gram.data(), n, n));
  };
  const int n = 200;
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix(n)).eigenvalues();
  EXPECT_NEAR(eigenvalues[n - 1] / eigenvalues[0], 7.5, 0.01);  // tends to it as 1/n^2

  // White noise in E comes out of C amplified by the root mean square row of G^-1.
  const auto amplification = [&](int size) {
    return matrix(size).inverse().norm() / std::sqrt(size);
  };
  EXPECT_NEAR(amplification(n), 3.518, 0.02);
  EXPECT_NEAR(amplification(11) * amplification(9), 10.7, 0.05);
}

TEST(Dual, IsBiorthogonalToItsFamily) {
  for (const double a : {-1.0, -0.3, 0.0, 0.5, 1.0}) {
    const Basis basis = Basis::Make(BasisKind::kQuadratic, a);
    for (int shift = -2; shift <= 2; ++shift) {
      const double product =
          Simpson(-1, 1, [&](double x) { return basis.DualValue(x) * basis.Value(x + 1 - shift); });
      EXPECT_NEAR(product, shift == 0 ? 1 : 0, 1e-7) << "a=" << a << " shift=" << shift;
    }
  }
  const Basis tent = Basis::Make(BasisKind::kBilinear);
  EXPECT_NEAR(Simpson(-1, 1, [&](double x) { return tent.DualValue(x) * tent.Value(x + 1); }), 1,
              1e-7);
}

TEST(Dual, PeaksOfTheTheory) {
  const Basis basis = Basis::Make(BasisKind::kQuadratic, 0.5);
  double lowest = 0;
  for (double x = 0; x <= 1; x += 1e-4) lowest = std::min(lowest, basis.DualValue(x));
  const double peak = basis.DualValue(0);
  EXPECT_NEAR(peak * peak, 9, 1e-12);
  EXPECT_NEAR(-lowest * peak, 0.919, 1e-3);  // a negative lobe times the positive peak
}

TEST(Basis, ErrorsNameTheValue) {
  EXPECT_THROW(Basis::FromName("cubic"), InputError);
  EXPECT_THROW(Basis::Make(BasisKind::kQuadratic, 1.5), InputError);
  EXPECT_THROW(Basis::Make(BasisKind::kQuadratic, NAN), InputError);
  EXPECT_THROW(Basis::Make(BasisKind::kBspline2).DualValue(0), InputError);
  try {
    Basis::FromName("cubic");
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'cubic'"), std::string::npos);
  }
  for (const Basis& basis : AllBases()) EXPECT_EQ(Basis::FromName(basis.name(), basis.a), basis);
}

TEST(BasisGrid, CentresSupportsAndIndices) {
  const BasisGrid grid = BasisGrid::Centred(Basis::Make(BasisKind::kBspline2), 11, 9, 0.0165);
  EXPECT_EQ(grid.count(), 99);
  EXPECT_EQ(grid.index(10, 8), 98);
  const Vec2 middle = grid.centre(5, 4);
  EXPECT_NEAR(middle.x, 0, 1e-17);
  EXPECT_NEAR(middle.y, 0, 1e-17);
  EXPECT_NEAR(grid.Phi(5, 4, middle), 9.0 / 16, 1e-15);
  EXPECT_NEAR(grid.PhiIntegral(), 0.0165 * 0.0165, 1e-18);
}

}  // namespace
}  // namespace luxfield::lightfield
