#include "luxfield/photometry/luminance.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <numbers>

#include "luxfield/photometry/answers.h"
#include "tests/photometry/lamps.h"

namespace luxfield::photometry {
namespace {

using lightfield::LightField;
using lightfield::Normalized;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 20261127;

Vec3 Towards(Vec3 eye, Vec3 place) { return Normalized(place - eye); }

TEST(Luminance, OfALambertianSquareIsItsRadianceFromEverywhere) {
  const Lamp lamp = LampOfField(LambertianSquare::Fine());
  for (const Vec3 eye : {Vec3{0, 0, 0.5}, Vec3{0.05, -0.03, 0.3}, Vec3{0.001, 0.002, 0.02}}) {
    const Vec3 w = Towards(eye, {0.0011, -0.0007, 0});
    EXPECT_NEAR(LuminanceValue(lamp, eye, w), LambertianSquare::kRadiance,
                1e-2 * LambertianSquare::kRadiance);  // of single cells and texels
    EXPECT_EQ(LuminanceValue(lamp, eye, Towards(eye, {0.006, 0, 0})), 0);
    EXPECT_EQ(LuminanceValue(lamp, eye, -1 * w), 0);
  }
}

// A cone of view that the square fills sees its radiance, one that holds the square its share.
TEST(Luminance, MeansOverFieldsOfView) {
  const Lamp lamp = LampOfField(LambertianSquare::Fine());
  const Vec3 eye{0, 0, 1}, w{0, 0, -1};
  const double radiance = LambertianSquare::kRadiance;
  EXPECT_NEAR(MeanLuminanceValue(lamp, eye, w, 0.0017), radiance, 1e-3 * radiance);
  const double cone = 2 * std::numbers::pi * (1 - std::cos(0.05 / 2));
  const double share = SolidAngleOfOpening(eye, 0.01, 0.01) / cone;
  EXPECT_NEAR(MeanLuminanceValue(lamp, eye, w, 0.05), share * radiance, 1e-3 * share * radiance);
  const double value = MeanLuminanceValue(lamp, eye, w, 0.011);
  EXPECT_NEAR(Value(lamp, MeanLuminance(lamp, eye, w, 0.011)), value, 1e-6 * value);
}

// A spot of a tenth of a per cent of the lamp's area, anywhere, is found. LUXFIELD_LAMPS=100 hides as many.
TEST(Luminance, TheBrightestPlaceIsFound) {
  core::Random random(kSeed, 0);
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.1;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBox), 30,
                                          30, 0.002);
  g.lattice = {4, 4, -0.08, 0.08, 0.04, 0.04};
  const char* lamps = std::getenv("LUXFIELD_LAMPS");
  for (int trial = 0; trial < (lamps ? std::atoi(lamps) : 8); ++trial) {
    LightField field(g);
    for (float& c : field.data) c = 1;
    const int spot = static_cast<int>(random.Uniform() * g.grid.count());
    for (float& c : field.image(spot, 0)) c = 5;
    const Lamp lamp = LampOfField(field);
    const Vec3 eye{0.1 * random.Uniform(), -0.1 * random.Uniform(), 0.3 + random.Uniform()};
    const Vec3 found = BrightestPlace(lamp, eye, 0.0017);
    const auto centre = g.grid.centre(spot % 30, spot / 30);
    const Vec3 at = eye + (-eye.z / found.z) * found;
    EXPECT_LT(std::hypot(at.x - centre.x, at.y - centre.y), 0.0015) << trial;
  }
}

// A lamp of one texel and one function: around its top rays from the axis are as bright as rounding has it.
TEST(Luminance, AFlatTopIsNotCircledForEver) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          1, 1, 0.02);
  g.lattice = {1, 1, -0.01, 0.01, 0.02, 0.02};
  LightField field(g);
  field.data = {1e6f};
  const Vec3 found = BrightestPlace(LampOfField(field), {0, 0, 1}, 0.011);
  EXPECT_LT(Length(found - Vec3{0, 0, -1}), 1e-3);
}

// Of all fields of view that hold a lamp whole, that about its middle.
TEST(Luminance, AWideFieldOfViewIsCentredOnTheLamp) {
  const Lamp lamp = LampOfField(Checkerboard(LambertianSquare::Fine()));
  const Vec3 eye{1, 2, 7};
  EXPECT_LT(Length(BrightestPlace(lamp, eye, 0.1) - Towards(eye, {0, 0, 0})), 1e-12);
}

// A lamp whose coefficients are 1 but for one, as bright as the basis function makes it: its peak within
// a field of view is there, and nothing of it outside.
TEST(Luminance, ThePeakWithinAFieldOfViewIsFound) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.1;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          9, 7, 0.01);
  g.lattice = {40, 40, -0.2, 0.2, 0.01, 0.01};
  LightField field(g);
  for (float& c : field.data) c = 1;
  for (float& c : field.image(g.grid.index(3, 2), 0)) c = 9;
  const Lamp lamp = LampOfField(field);
  const Vec3 eye{0.02, 0.03, 0.8};
  const auto at = g.grid.centre(3, 2);
  const Vec3 spot = Towards(eye, {at.x, at.y, 0});
  // 1 + 8 Phi in the middle of the function, times delta^2 / cos^4.
  const double middle = LuminanceValue(lamp, eye, spot);
  EXPECT_NEAR(middle, 0.01 / std::pow(spot.z, 4) * (1 + 8 * 0.75 * 0.75), 1e-6);
  for (const Vec3 w : {spot, Normalized(spot + Vec3{0.004, -0.003, 0})}) {
    const Vec3 peak = BrightestRay(lamp, eye, w, 0.011);
    EXPECT_GE(LuminanceValue(lamp, eye, peak), middle);
    EXPECT_NEAR(LuminanceValue(lamp, eye, peak), middle, 1e-4 * middle);
    EXPECT_GE(Dot(peak, w), std::cos(0.0055));
    EXPECT_NEAR(Value(lamp, LuminanceTowards(lamp, eye, peak)), LuminanceValue(lamp, eye, peak),
                1e-9);
  }
  // A field of view beside the spot, and one that holds no lamp.
  const Vec3 beside = Normalized(spot + Vec3{0.05, 0, 0});
  EXPECT_LT(LuminanceValue(lamp, eye, BrightestRay(lamp, eye, beside, 0.011)), 0.5 * middle);
  const Vec3 away{1, 0, 0};
  EXPECT_EQ(LuminanceValue(lamp, eye, BrightestRay(lamp, eye, away, 0.011)), 0);
}

TEST(Luminance, SolidAngleOfASquareOpening) {
  // 4 asin(a^2 / (a^2 + d^2)) of a square of side 2 a at d.
  EXPECT_NEAR(SolidAngleOfOpening({0, 0, 0.7}, 1, 1), 4 * std::asin(0.25 / (0.25 + 0.49)), 1e-12);
}

TEST(Glare, PositionIndexIsGuths) {
  EXPECT_EQ(PositionIndex({0, 0, -1}, {0, 1, 0}, {0, 0, -1}), 1);
  // By hand: 45 degrees above the line of sight, and beside it.
  const Vec3 sight{0, 0, -1}, up{0, 1, 0};
  const double above = PositionIndex(sight, up, Normalized(Vec3{0, 1, -1}));
  EXPECT_NEAR(above, std::exp((35.2 - 1.22) * 0.045 + 21e-5 * 45 * 45), 1e-9);
  const double beside = PositionIndex(sight, up, Normalized(Vec3{1, 0, -1}));
  EXPECT_NEAR(beside,
              std::exp((35.2 - 0.31889 * 90 - 1.22 * std::exp(-20)) * 0.045 +
                       (21 + 0.26667 * 90 - 0.002963 * 8100) * 1e-5 * 2025),
              1e-9);
  EXPECT_EQ(PositionIndex(sight, up, Normalized(Vec3{-1, 0, -1})), beside);
}

TEST(Glare, RatingOfAUniformSource) {
  EXPECT_NEAR(UnifiedGlareRating(1e4, 0.01, 1, 40), 8 * std::log10(0.25 / 40 * 1e8 * 0.01), 1e-12);
  EXPECT_NEAR(UnifiedGlareRating(1e4, 0.01, 2, 40), 8 * std::log10(0.25 / 40 * 1e8 * 0.01 / 4),
              1e-12);
}

// The ratings of a table are those of the formula: of an evenly bright square by its own luminance,
// and of its opening too; of a checkerboard the opening is half as bright.
TEST(Glare, TablesAreThoseOfTheFormula) {
  GlareAsked asked;
  asked.below_m = 1.6;
  asked.distances_m = {0.5, 1.2};
  asked.c_deg = {0, 200};
  asked.background = 40;
  asked.threshold = 500;
  asked.opening_m = {LambertianSquare::kSide, LambertianSquare::kSide};
  const GlareAnswer even = AnswerFor(LampOfField(LambertianSquare::Wide()), asked);
  ASSERT_EQ(even.ugr.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    const EyeAsked eye = asked.Eye(k / 2, k % 2);
    EXPECT_NEAR(std::hypot(eye.eye_m.x, eye.eye_m.y), asked.distances_m[k % 2], 1e-12);
    EXPECT_EQ(eye.eye_m.z, 1.6);
    const double omega =
        SolidAngleOfOpening(eye.eye_m, LambertianSquare::kSide, LambertianSquare::kSide);
    const double p = PositionIndex(*eye.line_of_sight, eye.up, Normalized(-1 * eye.eye_m));
    const double expected = UnifiedGlareRating(LambertianSquare::kRadiance, omega, p, 40);
    // 8 log10 of what is 2e-3 off.
    EXPECT_NEAR(even.ugr[k]->value, expected, 0.01) << k;
    EXPECT_NEAR(even.plain_ugr[k]->value, expected, 0.01) << k;
  }
  asked.distances_m = {0.5};
  asked.c_deg = {0};
  const LightField board = Checkerboard(LambertianSquare::Fine());
  const GlareAnswer uneven = AnswerFor(LampOfField(board), asked);
  // Twice the luminance over half of the area: L^2 omega is twice that of the opening.
  EXPECT_NEAR(uneven.ugr[0]->value - uneven.plain_ugr[0]->value, 8 * std::log10(2.0), 0.05);
  asked.below_m = 1.6;
  const GlareAnswer dark = AnswerFor(LampOfField(LightField(board.geometry)), asked);
  EXPECT_FALSE(dark.ugr[0] || dark.plain_ugr[0]);
}

// A small source at theta off the line of sight: k E / theta^2, E on a plane across that line.
TEST(Glare, VeilingLuminanceOfASmallSource) {
  const Lamp lamp = LampOfField(LambertianSquare::Fine());
  const Vec3 eye{0.01, -0.02, 2};
  for (const double degrees : {2.0, 10.0, 30.0, 59.0}) {
    const double theta = degrees * std::numbers::pi / 180;
    const Vec3 to_lamp = Normalized(-1 * eye), across = Normalized(Cross(to_lamp, {0, 1, 0}));
    const Vec3 sight = std::cos(theta) * to_lamp + std::sin(theta) * across;
    const double e = IlluminanceValue(lamp, eye, to_lamp) * std::cos(theta);
    const double expected = 9.86 * (1 + std::pow(60 / 66.4, 4)) * e / degrees / degrees;
    // The source is 0.3 degrees wide: (0.3 / theta)^2 / 4.
    EXPECT_NEAR(Value(lamp, VeilingLuminanceAt(lamp, eye, sight, 60)), expected, 0.01 * expected)
        << degrees;
  }
  for (const double degrees : {0.5, 62.0}) {
    const double theta = degrees * std::numbers::pi / 180;
    const Vec3 to_lamp = Normalized(-1 * eye), across = Normalized(Cross(to_lamp, {0, 1, 0}));
    EXPECT_EQ(Value(lamp, VeilingLuminanceAt(
                              lamp, eye, std::cos(theta) * to_lamp + std::sin(theta) * across, 23)),
              0);
  }
}

TEST(Glare, ThresholdIncrementOfBothRoads) {
  EXPECT_NEAR(ThresholdIncrement(0.2, 1), 13, 1e-12);
  EXPECT_NEAR(ThresholdIncrement(0.2, 10), 19 / std::pow(10, 1.05), 1e-12);
}

}  // namespace
}  // namespace luxfield::photometry
