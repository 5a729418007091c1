// Light vectors of rows of points against those of each point alone.
#include "luxfield/lightfield/light_vector_rows.h"

#include <gtest/gtest.h>

#include "tests/lightfield/support.h"

namespace luxfield::lightfield {
namespace {

// All that differs is the order of sums of some hundred terms: 1e-12 of the largest of them.
void ExpectThoseOfPoints(const LightField& field, double y, double z) {
  const std::vector<double> x = {0.9, -0.4, 0.013, 0.013, -0.05, 0, 30, -0.0021};
  const auto row = LightVectorRows(field, x, z).At(y);
  ASSERT_EQ(row.size(), x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const LightVector alone = ClosedFormLightVector(field, {x[k], y, z});
    for (int channel = 0; channel < 3; ++channel)
      EXPECT_LE(Length(row[k].j[channel] - alone.j[channel]),
                1e-12 * (1 + Length(alone.j[channel])))
          << x[k] << ' ' << y << ' ' << z << ' ' << channel;
  }
}

TEST(LightVectorRows, AreThoseOfPoints) {
  for (const BasisKind kind : {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kBspline2})
    for (const int channels : {1, 3}) {
      const LightField field = RandomField(SmallGeometry(Basis::Make(kind), channels), 3, -0.5, 1);
      // Far away, near, on I, between the planes, on and behind F.
      for (const double z : {40.0, 0.5, 0.12, 0.05, 1e-4, 0.0, -1.0})
        for (const double y : {0.0, 0.037, -0.6, 2.0}) ExpectThoseOfPoints(field, y, z);
    }
}

// More functions than texels in a row, and the other way round.
TEST(LightVectorRows, GridAndLatticeOfOtherSizes) {
  LuminaireGeometry g = SmallGeometry(Basis::Make(BasisKind::kBspline2), 3);
  g.grid = BasisGrid::Centred(g.grid.basis, 40, 2, 0.003);
  g.lattice = {1, 3, -0.11, 0.095, 0.2, 0.06};
  ExpectThoseOfPoints(RandomField(g, 5, -0.5, 1), 0.037, 0.5);
  g.grid = BasisGrid::Centred(g.grid.basis, 1, 2, 0.03);
  g.lattice = {50, 3, -0.11, 0.095, 0.0044, 0.06};
  ExpectThoseOfPoints(RandomField(g, 6, -0.5, 1), 0.037, 0.5);
}

TEST(LightVectorRows, NoPointsGiveNone) {
  const LightField field = RandomField(SmallGeometry(Basis::Make(BasisKind::kBox)), 3);
  EXPECT_TRUE(LightVectorRows(field, {}, 1).At(0).empty());
}

}  // namespace
}  // namespace luxfield::lightfield
