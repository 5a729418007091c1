// Planes of many points against their points alone.
#include "luxfield/photometry/planes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/photometry/lamps.h"

namespace luxfield::photometry {
namespace {

using lightfield::Dot;
using lightfield::PosedLightField;
using lightfield::RigidPose;
using lightfield::Vec3;

PlaneAsked Plane(Vec3 centre, Vec3 right, Vec3 up) {
  return {"", centre, right, up, 1.3, 0.7, 6, 5};
}

// Frontal; turned by a quarter; a floor and a side wall, which the horizon of points near the lamp
// cuts; oblique; behind the lamp in part.
const std::vector<PlaneAsked> kPlanes = {
    Plane({0.1, -0.2, 1.5}, {1, 0, 0}, {0, 1, 0}),
    Plane({0.1, -0.2, 1.5}, {0, -1, 0}, {1, 0, 0}),
    Plane({0.2, -0.5, 1.1}, {1, 0, 0}, {0, 0, -1}),
    Plane({0.7, 0.1, 0.4}, {0, 0, 1}, {0, 1, 0}),
    Plane({0.3, 0.2, 2}, {0.8, 0, 0.6}, {0.36, 0.8, -0.48}),
    Plane({0, -0.3, 0.1}, {1, 0, 0}, {0, 0, 1}),
};

Lamp TwoFaces() {
  RigidPose turned;  // its x is the lamp's -z, so that other planes are fast
  turned.rotation = {0, 0, 1, 0, 1, 0, -1, 0, 0};
  turned.translation_m = {0.02, -0.01, 0.03};
  const std::vector<PosedLightField> fields = {{"+z", {}, SmoothField()},
                                               {"+x", turned, SmoothField()}};
  return LampOf(fields);
}

TEST(Planes, IlluminanceIsThatOfPoints) {
  for (const Lamp& lamp : {LampOfField(SmoothField()), TwoFaces()})
    for (const PlaneAsked& plane : kPlanes) {
      const auto found = IlluminanceOn(lamp, plane);
      ASSERT_EQ(found.size(), 30u);
      double largest = 0;
      for (const double value : found) largest = std::max(largest, value);
      EXPECT_GT(largest, 0);
      for (int row = 0; row < plane.rows; ++row)
        for (int column = 0; column < plane.columns; ++column)
          EXPECT_NEAR(found[row * plane.columns + column],
                      IlluminanceValue(lamp, plane.Point(column, row), plane.Normal()),
                      1e-11 * largest)
              << row << ' ' << column;
    }
}

TEST(Planes, NoLightIsNotMinusZero) {
  lightfield::LightField dark = SmoothField();
  std::ranges::fill(dark.data, 0.0f);
  const Lamp lamp = LampOfField(dark);
  for (const PlaneAsked& plane : kPlanes)
    for (const double value : IlluminanceOn(lamp, plane)) {
      EXPECT_EQ(value, 0);
      EXPECT_FALSE(std::signbit(value));
    }
}

TEST(Planes, LightVectorsAreThoseOfPoints) {
  const Lamp lamp = TwoFaces();
  for (const PlaneAsked& plane : kPlanes) {
    const auto found = LightVectorsOn(lamp, plane);
    for (int row = 0; row < plane.rows; ++row)
      for (int column = 0; column < plane.columns; ++column) {
        const auto j = LightVectorAt(lamp, plane.Point(column, row));
        const Vec3 alone{Value(lamp, j[0]), Value(lamp, j[1]), Value(lamp, j[2])};
        EXPECT_LE(Length(found[row * plane.columns + column] - alone), 1e-11 * Length(alone));
      }
  }
}

// A quadrature's weights differ from the closed form by some 1e-4 where a horizon cuts.
TEST(Planes, TheMeanIsThatOfThePoints) {
  for (const Lamp& lamp : {LampOfField(SmoothField()), TwoFaces()})
    for (const PlaneAsked& plane : kPlanes) {
      const auto found = IlluminanceOn(lamp, plane);
      const double mean = std::accumulate(found.begin(), found.end(), 0.0) / 30;
      EXPECT_NEAR(Value(lamp, MeanReceivedOn(lamp, plane)), mean, 5e-4 * mean);
    }
  const Lamp lamp = LampOfField(SmoothField());
  const auto found = IlluminanceOn(lamp, kPlanes[0]);
  const double mean = std::accumulate(found.begin(), found.end(), 0.0) / 30;
  EXPECT_NEAR(Value(lamp, MeanReceivedOn(lamp, kPlanes[0])), mean, 1e-10 * mean);
}

TEST(Planes, OtherReceiversTakeInWhatPointsDo) {
  const Lamp lamp = TwoFaces();
  PlaneAsked plane = kPlanes[4];
  for (const ReceiverShape shape :
       {ReceiverShape::kSphere, ReceiverShape::kCylinder, ReceiverShape::kSemicylinder}) {
    plane.receiver = {.shape = shape, .axis = {0, 1, 0}, .facing = {0.6, 0, -0.8}};
    const auto found = ReceivedOn(lamp, plane);
    double sum = 0;
    for (int row = 0; row < plane.rows; ++row)
      for (int column = 0; column < plane.columns; ++column) {
        const double alone =
            Value(lamp, ReceivedAt(lamp, plane.receiver, plane.Point(column, row)));
        EXPECT_NEAR(found[row * plane.columns + column], alone, 1e-12 * alone);
        sum += alone;
      }
    EXPECT_NEAR(Value(lamp, MeanReceivedOn(lamp, plane)), sum / 30, 1e-12 * sum);
  }
}

}  // namespace
}  // namespace luxfield::photometry
