// What prints of planned filters measure of a sampled lamp.
#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include "luxfield/planning/planned_filters.h"

namespace luxfield::planning {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;

// Prints are scaled to let all light through at the peak of the basis: the quadratic B-spline's is
// 3/4 along each axis, the bilinear one's 1.
TEST(PlannedFilters, PrintsAreClearAtThePeak) {
  const PlannedFilters spline{
      false, BasisGrid::Centred(Basis::Make(BasisKind::kBspline2), 2, 2, 0.02), {}};
  EXPECT_DOUBLE_EQ(spline.print_scale(), 16.0 / 9);
  const PlannedFilters bilinear{
      false, BasisGrid::Centred(Basis::Make(BasisKind::kBilinear), 2, 2, 0.02), {}};
  EXPECT_DOUBLE_EQ(bilinear.print_scale(), 1);
  PlannedFilters dual = spline;
  dual.dual = true;
  EXPECT_DOUBLE_EQ(dual.print_scale(), 1);
  ASSERT_EQ(spline.print_factors().size(), 1u);
  EXPECT_DOUBLE_EQ(spline.print_factors()[0], 9.0 / 16);
}

// A lattice within that of the samples: its images are theirs, some columns and rows on.
TEST(PlannedFilters, ImagesOfALatticeWithinTheSamplesAreTheirs) {
  SampledLamp samples;
  samples.delta_m = 0.25;
  samples.cell_m = 0.01;
  samples.lit = {-0.04, 0.04, -0.04, 0.04};
  samples.cells_u = samples.cells_v = 8;
  samples.lattice = {7, 6, -0.07, 0.06, 0.02, 0.02};
  for (int texel = 0; texel < 42; ++texel)
    for (int cell = 0; cell < 64; ++cell)
      samples.flux_density.push_back(static_cast<float>(1 + texel + 0.1 * (cell % 7)));
  PlannedFilters filters{false, BasisGrid::Centred(Basis::Make(BasisKind::kBspline2), 2, 1, 0.02),
                         samples.lattice};
  const auto whole = FilterImages(samples, filters);
  constexpr int kColumn0 = 3, kRow0 = 2;
  filters.lattice = {3,
                     2,
                     samples.lattice.s0_m + kColumn0 * samples.lattice.ds_m,
                     samples.lattice.t1_m - kRow0 * samples.lattice.dt_m,
                     0.02,
                     0.02};
  const auto part = FilterImages(samples, filters);
  ASSERT_EQ(part[0].size(), 2u * 6);
  for (int m = 0; m < 2; ++m)
    for (int row = 0; row < 2; ++row)
      for (int column = 0; column < 3; ++column)
        EXPECT_EQ(part[0][m * 6 + row * 3 + column],
                  whole[0][m * 42 + (row + kRow0) * 7 + column + kColumn0])
            << m << ' ' << row << ' ' << column;
}

}  // namespace
}  // namespace luxfield::planning
