// Colour spaces, against published matrices.
#include "luxfield/core/primaries.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/error.h"

namespace luxfield::core {
namespace {

void ExpectNear(const Matrix3& m, const Matrix3& expected, double tolerance) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(m[i][j], expected[i][j], tolerance) << i << j;
}

// IEC 61966-2-1 prints the first to four places; B. Lindbloom's tables hold the Bradford-adapted
// matrix of ProPhoto, D50 to D65 (there to XYZ, here times the inverse of the first).
TEST(Primaries, MatricesAreThePublishedOnes) {
  ExpectNear(XyzFromRgb(kRec709),
             {{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}},
             6e-5);
  // Rec. 2020 to Rec. 709, ITU-R BT.2087: the same white, no adaptation.
  const Primaries rec2020 = {{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, kD65};
  ExpectNear(Rec709FromRgb(rec2020),
             {{{1.6605, -0.5876, -0.0728}, {-0.1246, 1.1329, -0.0083}, {-0.0182, -0.1006, 1.1187}}},
             1e-4);
  // ACES AP0 (white 0.32168 0.33767) to Rec. 709, Bradford: the Academy's ACES-to-Rec.709 matrix.
  const Primaries aces = {{0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}, {0.32168, 0.33767}};
  ExpectNear(Rec709FromRgb(aces),
             {{{2.5217, -1.1341, -0.3876}, {-0.2765, 1.3727, -0.0962}, {-0.0154, -0.1530, 1.1684}}},
             4e-4);
}

TEST(Primaries, WhiteStaysWhite) {
  for (const Primaries& p :
       {kRec709, Primaries{{0.64, 0.33}, {0.29, 0.60}, {0.15, 0.06}, {0.3333, 0.3333}},
        Primaries{{0.7347, 0.2653}, {0.1596, 0.8404}, {0.0366, 0.0001}, {0.3457, 0.3585}}}) {
    const Rgb white = Apply(Rec709FromRgb(p), {1, 1, 1});
    for (const double value : white) EXPECT_NEAR(value, 1, 1e-12);
  }
  const Rgb d65 = Rec709FromXyz({0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290});
  for (const double value : d65) EXPECT_NEAR(value, 1, 1e-12);
}

TEST(Primaries, WhatSpansNoColoursIsRefused) {
  EXPECT_THROW(XyzFromRgb({{0.3, 0.3}, {0.3, 0.3}, {0.15, 0.06}, kD65}), InputError);
  EXPECT_THROW(XyzFromRgb({{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3, 0}}), InputError);
  EXPECT_THROW(XyzFromRgb({{NAN, 0.33}, {0.30, 0.60}, {0.15, 0.06}, kD65}), InputError);
}

TEST(Primaries, IntoGamutKeepsLuminanceAndHue) {
  const Rgb inside = {0.1, 0, 3};
  EXPECT_EQ(IntoGamut(inside), inside);
  const Rgb outside = {2, 0.5, -0.3}, mixed = IntoGamut(outside);
  EXPECT_NEAR(Luminance(mixed), Luminance(outside), 1e-12);
  EXPECT_NEAR(mixed[2], 0, 1e-12);
  const double grey = Luminance(outside);
  EXPECT_NEAR((mixed[0] - grey) / (mixed[1] - grey), (outside[0] - grey) / (outside[1] - grey),
              1e-12);
  EXPECT_EQ(IntoGamut({-1, -1, -1}), Rgb{});
  EXPECT_EQ(IntoGamut({NAN, 1, 1}), Rgb{});
}

}  // namespace
}  // namespace luxfield::core
