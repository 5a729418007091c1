#include "luxfield/photometry/luminous_area.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/photometry/answers.h"
#include "luxfield/photometry/luminance.h"
#include "tests/photometry/lamps.h"

namespace luxfield::photometry {
namespace {

using lightfield::LightField;
using lightfield::PosedLightField;
using lightfield::Vec3;

constexpr double kThousandth = 1e-3, kThreshold = 500;

std::optional<LuminousArea> AreaSeen(const Lamp& lamp, Vec3 eye, double threshold) {
  return AreaOf(lamp, eye, BrightRays(lamp, eye, threshold));
}

Lamp WithNoise(const LightField& field, double relative) {
  const NoisyField noisy(field, PlainMaps(field.geometry.grid), relative);
  Lamp lamp = LampOfField(field);
  const std::vector<PosedLightField> sigma = {{"", {}, noisy.SigmaOfC()}};
  const std::vector<SolveMaps> maps = {noisy.maps()};
  SetNoise(lamp, sigma, maps, "sigma");
  return lamp;
}

// From far away half of the panel's area times the cosine, and half of its solid angle; the panel is seen
// under 0.3 degrees, whose square over 12 is 2e-6.
TEST(LuminousArea, OfACheckerboardIsHalfOfItTimesTheCosine) {
  const Lamp lamp = LampOfField(Checkerboard(LambertianSquare::Field(16, 7, 0.12)));
  const double half = 0.5 * LambertianSquare::kSide * LambertianSquare::kSide;
  for (const Vec3 eye :
       {Vec3{0, 0, 2}, Vec3{0.01, -0.02, 1.9}, Vec3{0.9, -0.4, 1.7}, Vec3{-2, 3, 1.8}}) {
    const double r = Length(eye), projected = half * eye.z / r;
    const auto area = AreaSeen(lamp, eye, kThreshold);
    ASSERT_TRUE(area);
    EXPECT_NEAR(area->projected_m2.value, projected, kThousandth * projected) << eye.x;
    EXPECT_NEAR(area->solid_angle.value, projected / (r * r), kThousandth * projected / (r * r));
    EXPECT_NEAR(area->luminance.value, LambertianSquare::kRadiance,
                3 * kThousandth * LambertianSquare::kRadiance);
    EXPECT_LT(Length(area->direction - Normalized(-1 * eye)), 2e-4);
  }
  EXPECT_FALSE(AreaSeen(lamp, {0, 0, 2}, 1e9));
}

// Near a panel it is the integral of the cosine over what is bright, of all of a square
//
//   A = integral z / |u - eye| du
TEST(LuminousArea, OfASquareNearby) {
  const Lamp lamp = LampOfField(LambertianSquare::Field(8, 13, 0.1));
  const Vec3 eye{0.006, 0.001, 0.012};
  constexpr int kParts = 400;
  double expected = 0;
  for (int k = 0; k < kParts * kParts; ++k) {
    const double side = LambertianSquare::kSide, x = side * ((k % kParts + 0.5) / kParts - 0.5),
                 y = side * ((k / kParts + 0.5) / kParts - 0.5);
    expected += side * side / (kParts * kParts) * eye.z / Length(Vec3{x, y, 0} - eye);
  }
  const auto area = AreaSeen(lamp, eye, kThreshold);
  EXPECT_NEAR(area->projected_m2.value, expected, kThousandth * expected);
  EXPECT_NEAR(area->solid_angle.value,
              SolidAngleOfOpening(eye, LambertianSquare::kSide, LambertianSquare::kSide),
              kThousandth * area->solid_angle.value);
}

// Of two faces the one that is bright counts with its own distance.
TEST(LuminousArea, OfTheFaceThatShines) {
  const LightField square = LambertianSquare::Field(8, 13, 0.1);
  lightfield::RigidPose farther;
  farther.translation_m = {0, 0, -0.5};
  const std::vector<PosedLightField> fields = {{"near", {}, LightField(square.geometry)},
                                               {"far", farther, square}};
  const auto area = AreaSeen(LampOf(fields), {0, 0, 1}, kThreshold);
  const double expected = LambertianSquare::kSide * LambertianSquare::kSide;
  EXPECT_NEAR(area->projected_m2.value, expected, 2 * kThousandth * expected);
}

// The border of cells is where it is, whatever their luminance: noise does not move it.
TEST(LuminousArea, HardEdgesDoNotMove) {
  const Lamp lamp = WithNoise(Checkerboard(LambertianSquare::Field(8, 7, 0.02)), 1e-3);
  const auto area = AreaSeen(lamp, {0, 0, 2}, 0.5 * LambertianSquare::kRadiance);
  EXPECT_LT(area->solid_angle.u.value(), 1e-3 * area->solid_angle.value);
  EXPECT_LT(area->projected_m2.u.value(), 1e-3 * area->projected_m2.value);
  EXPECT_GT(area->luminance.u.value(), 0);
}

TEST(LuminousArea, NoiseAboveTheThresholdLeavesNoUncertainty) {
  const Vec3 eye{0.02, -0.12, 0.7};
  EXPECT_TRUE(AreaSeen(WithNoise(SmoothField(), 0.002), eye, 9000)->projected_m2.u);
  const auto lost = AreaSeen(WithNoise(SmoothField(), 2), eye, 9000);
  EXPECT_FALSE(lost->solid_angle.u || lost->projected_m2.u || lost->luminance.u);
}

// Thresholds and backgrounds are cd/m^2, which a lamp in W has none of.
TEST(LuminousArea, OfWattsThereIsNone) {
  LightField field = LambertianSquare::Field(4, 7, 0.03);
  field.geometry.unit = lightfield::FluxUnit::kWatt;
  EyeAsked eye;
  eye.eye_m = {0, 0, 1};
  eye.threshold = kThreshold;
  eye.line_of_sight = Vec3{0.1, 0, -0.995};
  eye.up = {0, 1, 0};
  eye.background = 40;
  eye.road_luminance = 1;
  eye.opening_m = {0.1, 0.1};
  const EyeAnswer answer = AnswerFor(LampOfField(field), eye);
  EXPECT_FALSE(answer.area || answer.ugr || answer.plain_ugr || answer.threshold_increment);
  EXPECT_GT(answer.veiling->value, 0);
  GlareAsked table;
  table.below_m = 1;
  table.distances_m = {0.3};
  table.c_deg = {0};
  table.background = 40;
  table.threshold = kThreshold;
  EXPECT_FALSE(AnswerFor(LampOfField(field), table).ugr[0]);
}

}  // namespace
}  // namespace luxfield::photometry
