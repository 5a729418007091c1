#include "reconstruct/basis_truncation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "core/random.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::LightField;

LightField Field(const Basis& basis, int width, int height) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = BasisGrid::Centred(basis, width, height, 0.02);
  g.lattice = {2, 1, -0.02, 0.01, 0.02, 0.02};
  return LightField(g);
}

// A function of the coarser basis that lies wholly inside, written in the finer one by the
// two-scale relation, which its values confirm: the projection leaves it alone. Coefficients are
// float32.
TEST(Coarsened, KeepsWhatTheCoarserBasisHas) {
  for (const auto kind : {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kBspline2}) {
    const Basis basis = Basis::Make(kind);
    LightField field = Field(basis, 8, 7);
    const auto& grid = field.geometry.grid;
    const std::vector<double> mask = kind == BasisKind::kBox ? std::vector{1.0, 1.0}
                                     : kind == BasisKind::kBilinear
                                         ? std::vector{0.5, 1.0, 0.5}
                                         : std::vector{0.25, 0.75, 0.75, 0.25};
    for (std::size_t b = 0; b < mask.size(); ++b)
      for (std::size_t a = 0; a < mask.size(); ++a)
        for (float& c : field.image(grid.index(static_cast<int>(2 + a), static_cast<int>(b)), 0))
          c = static_cast<float>(mask[a] * mask[b]);
    // It is the function twice as wide indeed.
    for (const double x : {0.3, 1.9, 3.2, 5.5}) {
      const lightfield::Vec2 u{grid.u0_m + (2 + x) * grid.spacing_m, grid.v0_m + grid.spacing_m};
      EXPECT_NEAR(FluxDensity(field, u, {0.001, 0})[0], basis.Value(x / 2) * basis.Value(0.5),
                  1e-6);
    }
    const auto coarse = Coarsened(field, FilterKind::kBasis);
    ASSERT_TRUE(coarse);
    for (std::size_t k = 0; k < field.data.size(); ++k)
      EXPECT_NEAR(coarse->data[k], field.data[k], 1e-6);
  }
}

// What is left out is orthogonal to what is kept: projecting twice changes nothing, and the finest
// structure, alternating signs, goes.
TEST(Coarsened, IsAProjectionThatDropsFineStructure) {
  LightField field = Field(Basis::Make(BasisKind::kBspline2), 9, 7);
  constexpr std::uint64_t kSeed = 3;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  core::Random random(kSeed, 0);
  for (float& c : field.data) c = static_cast<float>(random.Normal());
  const auto once = Coarsened(field, FilterKind::kBasis);
  ASSERT_TRUE(once);
  const auto twice = Coarsened(*once, FilterKind::kBasis);
  for (std::size_t k = 0; k < field.data.size(); ++k)
    EXPECT_NEAR(twice->data[k], once->data[k], 1e-5);

  for (std::size_t k = 0; k < field.data.size(); ++k) {
    const auto m = static_cast<int>(k / 2);
    field.data[k] = (m % 9 + m / 9) % 2 ? 1.0f : -1.0f;
  }
  const auto smooth = Coarsened(field, FilterKind::kBasis);
  EXPECT_LT(std::abs(smooth->image(field.geometry.grid.index(4, 3), 0)[0]), 0.05);
}

// Behind dual filters the projection is oblique, and one all the same.
TEST(Coarsened, IsAProjectionBehindDualFilters) {
  LightField field = Field(Basis::Make(BasisKind::kBilinear), 9, 8);
  core::Random random(5, 0);
  for (float& c : field.data) c = static_cast<float>(random.Normal());
  const auto once = Coarsened(field, FilterKind::kDual);
  ASSERT_TRUE(once);
  const auto twice = Coarsened(*once, FilterKind::kDual);
  double changed = 0;
  for (std::size_t k = 0; k < field.data.size(); ++k) {
    EXPECT_NEAR(twice->data[k], once->data[k], 1e-4);
    changed += std::abs(once->data[k] - field.data[k]);
  }
  EXPECT_GT(changed, 1);
}

// An even lamp of 1 behind dual filters of a = 1/2: C = (integral of B*)^2 = (9/8)^2, which in its
// own basis carries (9/8 5/6)^2 of the flux. Read as `bilinear` it is even.
TEST(KeepingEvenLamps, PutsRightWhatQuadraticLoses) {
  LightField field = Field(Basis::Make(BasisKind::kQuadratic, 0.5), 8, 8);
  for (float& c : field.data) c = 81.0f / 64;
  const LightField smooth = KeepingEvenLamps(field, FilterKind::kDual);
  for (const lightfield::Vec2 u : {lightfield::Vec2{0, 0}, {0.003, -0.007}, {0.011, 0.02}})
    EXPECT_NEAR(FluxDensity(smooth, u, {0.001, 0})[0], 1, 1e-6);
  const BasisTruncation truncation(field, FilterKind::kDual);
  const auto inner = [](const LightField& f) {  // the mean over an inner cell
    double sum = 0;
    for (int k = 0; k < 100; ++k)
      sum +=
          FluxDensity(f, {0.0002 * (k % 10 * 10 + 5), 0.0002 * (k / 10 * 10 + 5)}, {0.001, 0})[0] /
          100;
    return sum;
  };
  EXPECT_NEAR(inner(field), std::pow(9.0 / 8 * 5 / 6, 2), 2e-3);
  EXPECT_GE(truncation.Bound(inner).value(), 1 - std::pow(9.0 / 8 * 5 / 6, 2) - 2e-3);
}

TEST(Coarsened, IsAbsentWhereThereIsNoCoarserBasis) {
  EXPECT_FALSE(Coarsened(Field(Basis::Make(BasisKind::kQuadratic, 0.5), 8, 8), FilterKind::kBasis));
  EXPECT_FALSE(Coarsened(Field(Basis::Make(BasisKind::kBspline2), 3, 8), FilterKind::kBasis));
}

}  // namespace
}  // namespace luxfield::reconstruct
