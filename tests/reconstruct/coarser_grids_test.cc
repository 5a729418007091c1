// Closed forms of what a grid of twice the spacing loses. Whether that is what a grid loses of
// lamps is `bench budget`'s source "basis, estimated" (tests/bench/bench_budget_test.cc).
#include "luxfield/reconstruct/budget/coarser_grids.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/lightfield/light_vector.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;
using lightfield::Vec3;

LightField Field(BasisKind kind, int width, int height) {
  LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind), width, height, 0.02);
  g.lattice = {4, 4, -0.2, 0.2, 0.1, 0.1};
  return LightField(g);
}

std::vector<Term> Ray(Vec2 u, Vec2 s) {
  return {{1, {[=](const LuminaireGeometry& g) { return RadianceWeights(g, u, s); }, s}}};
}
std::vector<Term> IrradianceAt(Vec3 p, Vec3 n) {
  return {{1, {[=](const LuminaireGeometry& g) { return IrradianceWeights(g, p, n); }, {}}}};
}
std::vector<Term> Flux() { return {{1, {lightfield::FluxWeights, {}}}}; }

std::optional<double> SigmaOf(const LightField& field, const std::vector<Term>& terms,
                              FilterKind filter = FilterKind::kBasis) {
  return CoarserGridSigmas(field, filter, {&terms})[0];
}

// A row of boxes, one high: a box of twice the side holds two of them along u, from the left one or
// the right one on, and darkness along v. So a ray through box i, whose loss falls as h, has
//
//   d^2 = 1/2 sum over both neighbours j of (L_i - (L_i + L_j) / 4)^2
TEST(CoarserGrids, BoxesTakeTheMeanOfNeighbours) {
  LightField field = Field(BasisKind::kBox, 5, 1);
  const double value[] = {1, 4, 2, 7, 3};
  for (int i = 0; i < 5; ++i)
    for (float& c : field.image(i, 0)) c = static_cast<float>(value[i]);
  const Vec2 s{0.05, -0.05};
  for (int i = 0; i < 5; ++i) {
    const Vec2 u = field.geometry.grid.centre(i, 0);
    const double unit = Radiance(field, u, s)[0] / value[i];
    double square = 0;
    for (const int j : {i - 1, i + 1}) {
      const double other = j >= 0 && j < 5 ? value[j] : 0;
      square += 0.5 * std::pow(value[i] - 0.25 * (value[i] + other), 2);
    }
    EXPECT_NEAR(SigmaOf(field, Ray(u, s)).value() / unit, std::sqrt(square), 1e-5) << i;
  }
}

// Boxes keep the flux, and B-splines keep it but for what their solve loses two functions beyond
// the light.
TEST(CoarserGrids, FluxIsKept) {
  for (const auto kind : {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kBspline2}) {
    LightField field = Field(kind, 7, 6);
    for (int m = 0; m < field.geometry.grid.count(); ++m)
      for (float& c : field.image(m, 0)) c = static_cast<float>(1 + m % 5);
    EXPECT_LT(SigmaOf(field, Flux()).value(), 0.03 * TotalFlux(field)[0]);
  }
}

// Behind dual filters of `bilinear` <Phi*, 1> = 1: a plateau stays as it is.
TEST(CoarserGrids, DualFiltersOfBilinearKeepPlateaus) {
  LightField field = Field(BasisKind::kBilinear, 13, 13);
  for (float& c : field.data) c = 2;
  const auto ray = Ray({0.003, -0.004}, {0.05, 0.05});
  EXPECT_LT(SigmaOf(field, ray, FilterKind::kDual).value(),
            1e-5 * Radiance(field, {0.003, -0.004}, {0.05, 0.05})[0]);
}

TEST(CoarserGrids, NothingIsSaidWhereAHorizonCutsTheirSupports) {
  LightField field = Field(BasisKind::kBspline2, 4, 4);
  for (float& c : field.data) c = 1;
  // Seen from 0.4 m the supports reach to 0.06 m beside the axis, those of the coarser grids to
  // more than 0.1; the horizon of a receiver that looks aside passes F in between.
  const Vec3 p{0, 0, 0.4};
  const Vec3 n = lightfield::Normalized(Vec3{1, 0, -0.09 / 0.4});
  ASSERT_FALSE(HorizonCutsSupport(field.geometry, p, n));
  EXPECT_FALSE(SigmaOf(field, IrradianceAt(p, n)).has_value());
  EXPECT_GT(SigmaOf(field, IrradianceAt(p, {0, 0, -1})).value(), 0);
}

}  // namespace
}  // namespace luxfield::reconstruct
