// Coarse intensities against the flux and the exact far field, and where they are 0.
#include "luxfield/preprocess/intensity_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "tests/seed.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;

// Images of a beam exp(-(s - aim)^2 / (2 width^2)), wider than supports and texels.
LightField Beam(int channels, lightfield::Vec2 aim, double width) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.1;
  geometry.grid = lightfield::BasisGrid::Centred(Basis::Make(BasisKind::kBspline2), 3, 2, 0.005);
  geometry.lattice = {48, 40, -0.12, 0.1, 0.005, 0.005};
  geometry.channels = channels;
  LightField field(geometry);
  for (int m = 0; m < geometry.grid.count(); ++m)
    for (int channel = 0; channel < channels; ++channel)
      for (std::size_t k = 0; k < geometry.plane_size(); ++k) {
        const auto s = geometry.lattice.centre(static_cast<int>(k) / geometry.lattice.width,
                                               static_cast<int>(k) % geometry.lattice.width);
        const double square = std::pow(s.x - aim.x, 2) + std::pow(s.y - aim.y, 2);
        field.image(m, channel)[k] =
            static_cast<float>((1 + m + channel) * 1e4 * std::exp(-square / (2 * width * width)));
      }
  return field;
}

TEST(IntensityTableTest, HoldsTheFlux) {
  for (const int channels : {1, 3}) {
    const LightField field = Beam(channels, {0.02, -0.03}, 0.03);
    const auto flux = TotalFlux(field);
    const double luminance =
        channels == 1 ? flux[0] : 0.2126 * flux[0] + 0.7152 * flux[1] + 0.0722 * flux[2];
    // Magnitudes are float32.
    EXPECT_NEAR(BuildIntensityTable(field, "beam").Flux(), luminance, 1e-6 * luminance);
  }
}

// A bin's mean of J is the far field there, smoothed by the bin and by the difference of a box over a
// quarter of a cell and a texel from both boxes: half the second derivative times the variances,
// which are (h / 4 + d)^2 / 12 - (h / 4)^2 / 12 - d^2 / 12 = h d / 24 and bin^2 / 12.
TEST(IntensityTableTest, IsTheFarFieldOfBins) {
  const double width = 0.04;
  const LightField field = Beam(1, {0.02, -0.03}, width);
  const IntensityTable table = BuildIntensityTable(field, "beam");
  ASSERT_EQ(table.columns, field.geometry.lattice.width);
  const auto& g = field.geometry;
  const double h = g.grid.spacing_m / g.delta_m, d = g.lattice.ds_m / g.delta_m,
               variance = h * d / 24 + table.bin.x * table.bin.x / 12,
               bend = std::pow(g.delta_m / width, 2) + 4;
  double largest = 0, worst = 0;
  for (int row = 4; row < table.rows - 4; ++row)
    for (int column = 4; column < table.columns - 4; ++column) {
      const double x = table.low.x + (column + 0.5) * table.bin.x,
                   y = table.low.y + (row + 0.5) * table.bin.y;
      const double expected =
          FarFieldIntensity(field, {x, y, 1})[0] * std::pow(1 + x * x + y * y, -1.5);
      const double mean = table.BinFlux(row, column) / (table.bin.x * table.bin.y);
      worst = std::max(worst, std::abs(mean - expected));
      largest = std::max(largest, expected);
    }
  std::printf("worst difference %.3g of the peak, bound %.3g\n", worst / largest, variance * bend);
  EXPECT_GT(largest, 0);
  // Both axes; the second derivative of a Gaussian is at most its peak over sigma^2, that of the
  // cos^4 = (1 + x^2 + y^2)^-2 beside it four times the peak more.
  EXPECT_LT(worst, variance * bend * largest);
}

// Every ray from a support to a texel of its image that is lit lies in a bin above 0, and only such
// directions do.
TEST(IntensityTableTest, IsZeroOnlyWhereNoLightGoes) {
  LightField field = Beam(1, {0, 0}, 0.03);
  std::fill(field.data.begin(), field.data.end(), 0.0f);
  const auto& g = field.geometry;
  const int row = 7, column = 31, image = 4;
  field.image(image, 0)[static_cast<std::size_t>(row) * g.lattice.width + column] = -2;
  const IntensityTable table = BuildIntensityTable(field, "point");
  EXPECT_GT(table.Flux(), 0);
  core::Random random(TestSeed(20260701), 0);
  const int i = image % g.grid.width, j = image / g.grid.width;
  const double size = g.grid.basis.cells * g.grid.spacing_m;
  lightfield::Vec2 low{1e9, 1e9}, high{-1e9, -1e9};
  for (int k = 0; k < 1000; ++k) {
    const double u = g.grid.u0_m + i * g.grid.spacing_m + size * random.Uniform(),
                 v = g.grid.v0_m + j * g.grid.spacing_m + size * random.Uniform(),
                 s = g.lattice.s_of_column(column + random.Uniform()),
                 t = g.lattice.t_of_row(row + random.Uniform());
    const double x = (s - u) / g.delta_m, y = (t - v) / g.delta_m;
    low = {std::min(low.x, x), std::min(low.y, y)};
    high = {std::max(high.x, x), std::max(high.y, y)};
    const int bin_column = static_cast<int>((x - table.low.x) / table.bin.x),
              bin_row = static_cast<int>((y - table.low.y) / table.bin.y);
    ASSERT_GT(table.BinFlux(bin_row, bin_column), 0) << x << " " << y;
  }
  for (int r = 0; r < table.rows; ++r)
    for (int c = 0; c < table.columns; ++c) {
      const double x = table.low.x + c * table.bin.x, y = table.low.y + r * table.bin.y;
      const bool outside = x > high.x + table.bin.x || x + 2 * table.bin.x < low.x ||
                           y > high.y + table.bin.y || y + 2 * table.bin.y < low.y;
      EXPECT_TRUE(!outside || table.BinFlux(r, c) == 0) << r << " " << c;
    }
}

TEST(IntensityTableTest, WhatIsNotFiniteIsNamed) {
  LightField field = Beam(1, {0, 0}, 0.03);
  field.image(2, 0)[5] = std::numeric_limits<float>::quiet_NaN();
  try {
    BuildIntensityTable(field, "lamp.lf.exr");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("lamp.lf.exr"), std::string::npos);
  }
}

}  // namespace
}  // namespace luxfield::preprocess
