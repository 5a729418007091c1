// Sums against 128-bit integers and against double and float32 tables, extremes of
// docs/theory.md 12, reference positions.
#include "luxfield/preprocess/tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"

namespace luxfield::preprocess {
namespace {

using lightfield::BasisGrid;
using lightfield::LightField;
__extension__ typedef __int128 Wide;

LightField MakeField(int grid_width, int grid_height, int width, int height, int channels = 1) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid.basis.cells = 3;
  g.grid.width = grid_width;
  g.grid.height = grid_height;
  g.grid.spacing_m = 0.0165;
  g.lattice = {width, height, -0.3, 0.2, 0.6 / width, 0.4 / height};
  g.channels = channels;
  return LightField(g);
}

// Values spread evenly over `decades` in the logarithm.
LightField Noise(int size, double decades, std::uint64_t seed) {
  LightField field = MakeField(1, 1, size, size);
  core::Random random(seed, 0);
  for (float& c : field.data) c = static_cast<float>(std::pow(10.0, -decades * random.Uniform()));
  return field;
}

Tables Build(const LightField& field) {
  return BuildTables(field, "test.lf.exr", std::string(64, 'a'));
}

TEST(Tables, DifferencesAreExactAgainstInt128) {
  // Eight decades: 1e-8 of the largest texel is 2^-44 of the total, whose float32 needs rounding
  // below 2^-38.
  const LightField field = Noise(300, 8, 1);
  const Tables tables = Build(field);
  core::Random random(2, 0);
  for (int trial = 0; trial < 2000; ++trial) {
    const int c0 = static_cast<int>(random.Uniform() * 300),
              r0 = static_cast<int>(random.Uniform() * 300);
    const int c1 = c0 + 1 + static_cast<int>(random.Uniform() * (300 - c0));
    const int r1 = r0 + 1 + static_cast<int>(random.Uniform() * (300 - r0));
    // Units are 2^-e; sum in units of 2^-e * 2^-60, wide enough for every bit of a float.
    Wide exact = 0;
    for (int r = r0; r < r1; ++r)
      for (int c = c0; c < c1; ++c)
        exact += static_cast<Wide>(
            std::ldexp(double{field.image(0, 0)[r * 300 + c]}, tables.exponent[0] + 60));
    const Wide sum = static_cast<Wide>(tables.FixedPointSum(0, c0, r0, c1, r1)) << 60;
    const double error_units = std::ldexp(static_cast<double>(sum - exact), -60);
    ASSERT_LE(std::abs(error_units), 0.5 * (c1 - c0) * (r1 - r0))
        << c0 << " " << r0 << " " << c1 << " " << r1;
  }
}

// The measurement behind the choice of fixed point (tables.h): worst relative error of the mass of
// small windows.
TEST(Tables, FixedPointBeatsFloatAndDouble) {
  constexpr int kSize = 300, kStride = kSize + 1;
  LightField field = MakeField(1, 1, kSize, kSize);
  core::Random random(3, 0);
  for (int r = 0; r < kSize; ++r)
    for (int c = 0; c < kSize; ++c) {
      const double x = (c - 140) / 300.0, y = (r - 150) / 300.0;
      field.image(0, 0)[r * kSize + c] =
          static_cast<float>((1e-8 + std::exp(-(x * x + y * y) / (2 * 0.015 * 0.015)) +
                              1e-3 * std::exp(-(x * x / 0.08 + y * y / 0.01))) *
                             (0.95 + 0.1 * random.Uniform()));
    }
  const Tables tables = Build(field);
  std::vector<float> single(kStride * kStride, 0.0f);
  std::vector<double> twice(kStride * kStride, 0.0);
  for (int r = 0; r < kSize; ++r) {
    float row_single = 0;
    double row_double = 0;
    for (int c = 0; c < kSize; ++c) {
      const float texel = field.image(0, 0)[r * kSize + c];
      const int k = (r + 1) * kStride + c + 1;
      single[k] = single[k - kStride] + (row_single += texel);
      twice[k] = twice[k - kStride] + (row_double += texel);
    }
  }
  for (const int window : {1, 4, 16, 64}) {
    double worst_single = 0, worst_double = 0, worst_fixed = 0;
    for (int trial = 0; trial < 5000; ++trial) {
      const int c = static_cast<int>(random.Uniform() * (kSize - window + 1));
      const int r = static_cast<int>(random.Uniform() * (kSize - window + 1));
      long double exact = 0;
      for (int y = r; y < r + window; ++y)
        for (int x = c; x < c + window; ++x) exact += field.image(0, 0)[y * kSize + x];
      const auto rectangle = [&](const auto& s) {
        return (s[(r + window) * kStride + c + window] - s[(r + window) * kStride + c]) -
               (s[r * kStride + c + window] - s[r * kStride + c]);
      };
      const auto error = [&](double value) {
        return static_cast<double>(std::abs(value - exact) / exact);
      };
      worst_single = std::max(worst_single, error(rectangle(single)));
      worst_double = std::max(worst_double, error(rectangle(twice)));
      worst_fixed =
          std::max(worst_fixed, error(tables.FixedPointToLuminance(
                                    0, tables.FixedPointSum(0, c, r, c + window, r + window))));
    }
    std::printf("window %2d x %-2d worst relative error: float32 %.1e, double %.1e, fixed %.1e\n",
                window, window, worst_single, worst_double, worst_fixed);
    EXPECT_LE(worst_fixed, worst_double);
    EXPECT_LT(worst_fixed, 1e-8);  // half a quantum, 2^-63 of the total, on texels of 1e-11 of it
    if (window <= 4) {
      EXPECT_GT(worst_single, 1.0);
    }
  }
}

TEST(Tables, CdfsAreMonotoneAndEndAtTheTotal) {
  const LightField field = Noise(64, 8, 4);
  const Tables tables = Build(field);
  for (int c = 0; c < 64; ++c) {
    EXPECT_LE(tables.FixedPointSum(0, 0, 0, c, 64), tables.FixedPointSum(0, 0, 0, c + 1, 64));
    for (int r = 0; r < 64; ++r)
      EXPECT_LE(tables.FixedPointSum(0, c, 0, c + 1, r),
                tables.FixedPointSum(0, c, 0, c + 1, r + 1));
  }
  double sum = 0;
  for (const float c : field.data) sum += c;
  EXPECT_NEAR(tables.Total(0), sum, 1e-12 * sum);
}

TEST(Tables, AllZeroImageIsLegalAndLeftOutOfReferences) {
  LightField field = MakeField(2, 1, 8, 4);
  field.image(1, 0)[1 * 8 + 5] = 3;
  const Tables tables = Build(field);
  EXPECT_EQ(tables.Total(0), 0);
  EXPECT_EQ(tables.exponent[0], 0);
  EXPECT_EQ(tables.Total(1), 3);
  ASSERT_EQ(tables.reference.size(), 4u * 3u);
  // Cell 0 of each row is under image 0 alone, the others are under image 1.
  EXPECT_EQ(tables.reference[0].images, 0);
  for (int cell = 1; cell < 4; ++cell) {
    EXPECT_EQ(tables.reference[cell].images, 1);
    EXPECT_NEAR(tables.reference[cell].s_m, field.geometry.lattice.s_of_column(5.5), 1e-7);
    EXPECT_NEAR(tables.reference[cell].t_m, field.geometry.lattice.t_of_row(1.5), 1e-7);
  }
}

TEST(Tables, ReferenceIsTheMeanOfMedians) {
  LightField field = MakeField(2, 1, 10, 10);
  field.image(0, 0)[2 * 10 + 1] = 1;
  field.image(1, 0)[6 * 10 + 7] = 5;
  const Tables tables = Build(field);
  const auto& lattice = field.geometry.lattice;
  EXPECT_EQ(tables.reference[1].images, 2);
  EXPECT_NEAR(tables.reference[1].s_m, 0.5 * (lattice.s_of_column(1.5) + lattice.s_of_column(7.5)),
              1e-7);
  EXPECT_NEAR(tables.reference[1].t_m, 0.5 * (lattice.t_of_row(2.5) + lattice.t_of_row(6.5)), 1e-7);
}

TEST(Tables, OneLitTexelTakesAllAtAnyMagnitude) {
  for (const float value : {std::numeric_limits<float>::denorm_min(), 1e-30f, 1.0f, 1e30f,
                            std::numeric_limits<float>::max()}) {
    LightField field = MakeField(1, 1, 5, 3);
    field.image(0, 0)[7] = value;
    const Tables tables = Build(field);
    EXPECT_EQ(tables.Total(0), value);
    EXPECT_EQ(tables.FixedPointSum(0, 2, 1, 3, 2), tables.FixedPointSum(0, 0, 0, 5, 3));
  }
}

TEST(Tables, DenormalsAreCounted) {
  LightField field = MakeField(1, 1, 4, 4);
  for (float& c : field.data) c = 3 * std::numeric_limits<float>::denorm_min();
  EXPECT_EQ(Build(field).Total(0), 48 * double{std::numeric_limits<float>::denorm_min()});
}

TEST(Tables, ColourCountsLuminance) {
  LightField field = MakeField(1, 1, 2, 2, 3);
  field.image(0, 0)[3] = 1;
  field.image(0, 1)[3] = 2;
  field.image(0, 2)[3] = 4;
  EXPECT_EQ(Build(field).Total(0), static_cast<float>(0.2126 + 2 * 0.7152 + 4 * 0.0722));
}

// Of luminance 0: R and G cancel.
TEST(Tables, NegativeCoefficientsCountByMagnitude) {
  LightField grey = Noise(16, 3, 6), colour = MakeField(1, 1, 2, 2, 3);
  const Tables of_magnitudes = Build(grey);
  for (std::size_t k = 0; k < grey.data.size(); k += 3) grey.data[k] = -grey.data[k];
  EXPECT_EQ(Build(grey).sat, of_magnitudes.sat);
  EXPECT_EQ(Build(grey).reference, of_magnitudes.reference);
  colour.image(0, 0)[3] = 0.7152f;
  colour.image(0, 1)[3] = -0.2126f;
  EXPECT_NEAR(Build(colour).Total(0), 2 * 0.2126 * 0.7152, 1e-7);
}

TEST(Tables, RefusesWhatCannotBeSampled) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity()})
    for (const int channels : {1, 3}) {
      LightField field = MakeField(2, 2, 4, 3, channels);
      field.image(3, channels - 1)[6] = bad;
      try {
        Build(field);
        FAIL() << bad;
      } catch (const InputError& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find("test.lf.exr"), std::string::npos) << message;
        EXPECT_NE(message.find("C.01.01"), std::string::npos) << message;
        EXPECT_NE(message.find("row 1, column 2"), std::string::npos) << message;
        EXPECT_NE(message.find("luxfield reconstruct"), std::string::npos) << message;
      }
    }
}

TEST(Tables, RefusesASumBeyondFloat) {
  LightField field = MakeField(1, 1, 2, 1);
  field.data = {3e38f, 3e38f};
  EXPECT_THROW(Build(field), InputError);
}

TEST(Tables, MismatchedLightFieldIsRefused) {
  const LightField field = Noise(8, 1, 5);
  const Tables tables = Build(field);
  EXPECT_NO_THROW(CheckTables(tables, "x.tab.exr", field.geometry, std::string(64, 'a')));
  EXPECT_THROW(CheckTables(tables, "x.tab.exr", field.geometry, std::string(64, 'b')), InputError);
  EXPECT_THROW(CheckTables(tables, "x.tab.exr", Noise(9, 1, 5).geometry, std::string(64, 'a')),
               InputError);
}

}  // namespace
}  // namespace luxfield::preprocess
