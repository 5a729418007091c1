// Every layout: landmarks, OpenEXR's own functions, inverses, Jacobians, solid angles.
#include "luxfield/environment/environment_layouts.h"

#include <OpenEXR/ImfEnvmap.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/core/random.h"

namespace luxfield::environment {
namespace {

using enum EnvironmentLayout;

constexpr double kPi = std::numbers::pi;
constexpr EnvironmentLayout kAll[] = {kLatitudeLongitude, kAngularMap, kMirrorBall,
                                      kFisheyeHemisphere, kCube};

std::string Name(EnvironmentLayout layout) { return std::string(EnvironmentLayoutName(layout)); }

void ExpectDirection(EnvironmentLayout layout, lightfield::Vec2 p, lightfield::Vec3 w) {
  const auto found = DirectionFromPicture(layout, p);
  ASSERT_TRUE(found) << Name(layout);
  EXPECT_NEAR(lightfield::Length(found->direction - lightfield::Normalized(w)), 0, 2e-8)
      << Name(layout) << ' ' << p.x << ' ' << p.y;
}

// The rule of each layout as the documentation draws it.
TEST(EnvironmentLayouts, LandmarksLieWhereTheRuleSays) {
  ExpectDirection(kLatitudeLongitude, {0.5, 0.5}, {0, -1, 0});
  ExpectDirection(kLatitudeLongitude, {0.25, 0.5}, {1, 0, 0});
  ExpectDirection(kLatitudeLongitude, {0.75, 0.5}, {-1, 0, 0});
  ExpectDirection(kLatitudeLongitude, {0, 0.5}, {0, 1, 0});
  ExpectDirection(kLatitudeLongitude, {0.3, 0}, {0, 0, 1});
  ExpectDirection(kLatitudeLongitude, {0.5, 0.75}, {0, -1, -1});

  ExpectDirection(kAngularMap, {0.5, 0.5}, {0, -1, 0});
  ExpectDirection(kAngularMap, {0.75, 0.5}, {-1, 0, 0});
  ExpectDirection(kAngularMap, {0.5, 0.25}, {0, 0, 1});
  ExpectDirection(kAngularMap, {0.5, 1}, {0, 1, 0});
  ExpectDirection(kAngularMap, {0.625, 0.5}, {-1, -1, 0});

  const double r45 = 0.5 * std::sqrt(0.5);  // sin 45 degrees, in p
  ExpectDirection(kMirrorBall, {0.5, 0.5}, {0, 1, 0});
  ExpectDirection(kMirrorBall, {0.5 + r45, 0.5}, {-1, 0, 0});
  ExpectDirection(kMirrorBall, {0.5, 0.5 - r45}, {0, 0, 1});
  ExpectDirection(kMirrorBall, {0.5, 0}, {0, -1, 0});

  ExpectDirection(kFisheyeHemisphere, {0.5, 0.5}, {0, 0, 1});
  ExpectDirection(kFisheyeHemisphere, {0.5, 0}, {0, 1, 0});
  ExpectDirection(kFisheyeHemisphere, {0, 0.5}, {1, 0, 0});
  ExpectDirection(kFisheyeHemisphere, {0.5, 0.75}, {0, -1, 1});

  const lightfield::Vec3 strip[] = {{1, 0, 0},  {-1, 0, 0}, {0, 0, 1},
                                    {0, 0, -1}, {0, -1, 0}, {0, 1, 0}};
  const lightfield::Vec3 top_left[] = {{1, 1, 1},   {-1, -1, 1}, {-1, -1, 1},
                                       {-1, 1, -1}, {1, -1, 1},  {-1, 1, 1}};
  for (int k = 0; k < 6; ++k) {
    ExpectDirection(kCube, {0.5, (k + 0.5) / 6}, strip[k]);
    ExpectDirection(kCube, {0, (k + 1e-12) / 6}, top_left[k]);
  }
}

TEST(EnvironmentLayouts, WhatIsNotShownIsAbsent) {
  for (const auto disc : {kAngularMap, kMirrorBall, kFisheyeHemisphere})
    EXPECT_FALSE(DirectionFromPicture(disc, {0.01, 0.01})) << Name(disc);
  for (const auto layout : kAll) {
    EXPECT_FALSE(DirectionFromPicture(layout, {-0.01, 0.5}));
    EXPECT_FALSE(DirectionFromPicture(layout, {0.5, 1.01}));
    EXPECT_EQ(PictureFromDirection(layout, {0.1, 0.2, -0.01}).has_value(),
              layout != kFisheyeHemisphere);
    EXPECT_EQ(EnvironmentLayoutFromName(Name(layout)), layout);
  }
  EXPECT_FALSE(EnvironmentLayoutFromName("cross"));
}

// OpenEXR defines its two layouts by code: pixel centres on the borders, +y up.
TEST(EnvironmentLayouts, OpenExrsOwnFunctionsAgree) {
  const auto world = [](Imath::V3f v) { return lightfield::Normalized({v.x, -v.z, v.y}); };
  core::Random random(4, 0);
  const Imath::Box2i wide({0, 0}, {127, 63}), strip({0, 0}, {31, 191});
  for (int k = 0; k < 500; ++k) {
    const Imath::V2f pixel(float(127 * random.Uniform()), float(63 * random.Uniform()));
    const lightfield::Vec3 w = world(Imf::LatLongMap::direction(wide, pixel));
    const auto ours = DirectionFromPicture(kLatitudeLongitude, {pixel.x / 127.0, pixel.y / 63.0});
    EXPECT_NEAR(lightfield::Length(ours->direction - w), 0, 2e-6);

    const int k_face = int(random() % 6);
    const auto face = static_cast<Imf::CubeMapFace>(k_face);
    const Imath::V2f in_face(float(31 * random.Uniform()), float(31 * random.Uniform()));
    const lightfield::Vec3 v = world(Imf::CubeMap::direction(face, strip, in_face));
    const Imath::V2f at = Imf::CubeMap::pixelPosition(face, strip, in_face);
    const auto cube = DirectionFromPicture(
        kCube, {at.x / 31.0, (k_face + (double(at.y) - 32 * k_face) / 31.0) / 6});
    EXPECT_NEAR(lightfield::Length(cube->direction - v), 0, 2e-6) << k_face;
  }
}

TEST(EnvironmentLayouts, InversesAndJacobiansBelongTogether) {
  core::Random random(5, 0);
  for (const auto layout : kAll) {
    int tried = 0;
    while (tried < 400) {
      const lightfield::Vec2 p = {random.Uniform(), random.Uniform()};
      const auto w = DirectionFromPicture(layout, p);
      // Away from seams and the rim, where differences would reach across.
      const double r = std::hypot(2 * p.x - 1, 2 * p.y - 1), in_face = std::fmod(6 * p.y, 1.0);
      if (!w || (layout != kLatitudeLongitude && layout != kCube && r > 0.99) ||
          (layout == kCube && (in_face < 0.01 || in_face > 0.99)))
        continue;
      ++tried;
      EXPECT_NEAR(lightfield::Length(w->direction), 1, 1e-14);
      const auto back = PictureFromDirection(layout, 3 * w->direction);
      ASSERT_TRUE(back);
      EXPECT_NEAR(back->point.x, p.x, 1e-12) << Name(layout);
      EXPECT_NEAR(back->point.y, p.y, 1e-12) << Name(layout);
      EXPECT_NEAR(back->area_per_solid_angle * w->solid_angle_per_area, 1, 1e-10) << Name(layout);
      // Central differences of step h: error h^2 and rounding 1e-16 / h, of curvatures up to about
      // 1e3.
      const double h = 1e-5;
      const auto slope = [&](lightfield::Vec2 step) {
        return (0.5 / h) * (DirectionFromPicture(layout, p + h * step)->direction -
                            DirectionFromPicture(layout, p - h * step)->direction);
      };
      const double signed_density =
          lightfield::Dot(w->direction, lightfield::Cross(slope({1, 0}), slope({0, 1})));
      EXPECT_NEAR(std::abs(signed_density), w->solid_angle_per_area, 2e-5) << Name(layout);
      // Right and down seen from inside turn towards the viewer; a mirror turns that round.
      EXPECT_EQ(signed_density > 0, layout != kMirrorBall) << Name(layout);
    }
  }
}

TEST(EnvironmentLayouts, TexelsFillWhatTheLayoutShows) {
  for (const auto layout : kAll)
    for (const auto registration : {TexelRegistration::kCells, TexelRegistration::kNodes})
      for (const int size : {1, 2, 5, 48}) {
        const int height = layout == kCube ? 6 * size : size;
        const TexelEdges edges = MakeTexelEdges(layout, registration, size, height);
        ASSERT_EQ(edges.x.size(), std::size_t(size) + 1);
        ASSERT_EQ(edges.y.size(), std::size_t(height) + 1);
        double sum = 0;
        for (int row = 0; row < height; ++row)
          for (int column = 0; column < size; ++column) {
            const double angle = PictureRectangleSolidAngle(
                layout, edges.x[column], edges.x[column + 1], edges.y[row], edges.y[row + 1]);
            ASSERT_GE(angle, -1e-15);
            sum += angle;
          }
        EXPECT_NEAR(sum, (layout == kFisheyeHemisphere ? 2 : 4) * kPi, 1e-12)
            << Name(layout) << size;
      }
}

TEST(EnvironmentLayouts, ARectanglesSolidAngleIsItsDensityIntegrated) {
  core::Random random(6, 0);
  for (const auto layout : kAll)
    for (int k = 0; k < 30; ++k) {
      const double x0 = 0.95 * random.Uniform(),
                   y0 = layout == kCube ? (k % 6 + 0.4) / 6 : 0.95 * random.Uniform();
      const double x1 = x0 + 0.05 * random.Uniform(),
                   y1 = y0 + (layout == kCube ? 0.05 : 0.2) * random.Uniform();
      if (y1 > 1) continue;
      constexpr int kSteps = 200;
      double sum = 0;
      for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
          const auto w = DirectionFromPicture(
              layout, {x0 + (x1 - x0) * (i + 0.5) / kSteps, y0 + (y1 - y0) * (j + 0.5) / kSteps});
          if (w) sum += w->solid_angle_per_area;
        }
      const double area = (x1 - x0) * (y1 - y0);
      // Midpoint rule: second order inside; a rim that jumps through the lattice leaves up to a row
      // and a column of cells at the density there (16, the ball's; the other discs' is not above
      // 40).
      const auto corner = [&](double x, double y) { return std::hypot(2 * x - 1, 2 * y - 1) < 1; };
      const bool disc = layout != kCube && layout != kLatitudeLongitude;
      const bool inside =
          !disc || (corner(x0, y0) && corner(x1, y0) && corner(x0, y1) && corner(x1, y1));
      EXPECT_NEAR(PictureRectangleSolidAngle(layout, x0, x1, y0, y1), sum * area / kSteps / kSteps,
                  area * (inside ? 1e-4 : 40.0 * 2 / kSteps))
          << Name(layout);
    }
}

}  // namespace
}  // namespace luxfield::environment
