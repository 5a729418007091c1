#include "luxfield/rig/homography.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"

namespace luxfield::rig {
namespace {

using lightfield::Vec2;

constexpr std::uint64_t kSeed = 2704;
constexpr double kEps = std::numeric_limits<double>::epsilon();

// A map whose W stays within a factor of 3 over the unit square.
Homography RandomMap(std::uint32_t n) {
  core::Random random(kSeed, 0, n);
  const auto any = [&](double size) { return size * (2 * random.Uniform() - 1); };
  return Homography(
      {1 + any(0.3), any(0.3), any(2), any(0.3), -1 + any(0.3), any(2), any(0.25), any(0.25), 1});
}

Vec2 RandomPoint(std::uint32_t n) {
  core::Random random(kSeed, 1, n);
  const double x = random.Uniform();
  return {x, random.Uniform()};
}

void ExpectNear(Vec2 a, Vec2 b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
}

TEST(Homography, TakesCornersWhereTheyBelong) {
  const std::array<Vec2, 4> corners{{{-3, 2}, {4, 2.5}, {3.5, -2}, {-2.5, -1}}};
  const Homography map = Homography::FromCorners(640, 480, corners);
  // Coordinates of up to 4, some ten operations: below 40 epsilon.
  ExpectNear(map.Map({0, 0}), corners[0], 40 * kEps);
  ExpectNear(map.Map({640, 0}), corners[1], 40 * kEps);
  ExpectNear(map.Map({640, 480}), corners[2], 40 * kEps);
  ExpectNear(map.Map({0, 480}), corners[3], 40 * kEps);
}

TEST(Homography, OfARectangleIsAffine) {
  const Homography map = Homography::FromCorners(4, 2, {{{1, 5}, {9, 5}, {9, 1}, {1, 1}}});
  EXPECT_EQ(map, Homography({2, 0, 1, 0, -2, 5, 0, 0, 1}));
  const PlaneDerivative d = map.Derivative({3, 1});
  ExpectNear(d.by_x, {2, 0}, 0);
  ExpectNear(d.by_y, {0, -2}, 0);
  EXPECT_EQ(map.AreaFactor({3, 1}), -4);
}

// (x, y) -> (x, y) / (1 + k x), whose derivatives are known in closed form.
TEST(Homography, DerivativeOfAPerspectiveIsTheClosedForm) {
  const double k = 0.25, x = 1.5, y = -0.75, w = 1 + k * x;
  const Homography map({1, 0, 0, 0, 1, 0, k, 0, 1});
  const PlaneDerivative d = map.Derivative({x, y});
  ExpectNear(d.by_x, {1 / (w * w), -k * y / (w * w)}, 4 * kEps);
  ExpectNear(d.by_y, {0, 1 / w}, 4 * kEps);
  EXPECT_NEAR(map.AreaFactor({x, y}), 1 / (w * w * w), 4 * kEps);
  ExpectNear(map.Inverse().Map({0.4, 0.2}), {0.4 / 0.9, 0.2 / 0.9}, 8 * kEps);
}

TEST(Homography, ComposesAndInverts) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  for (std::uint32_t n = 0; n < 200; ++n) {
    const Homography a = RandomMap(2 * n), b = RandomMap(2 * n + 1);
    const Vec2 p = RandomPoint(n);
    const Homogeneous between = b.Lift(p), end = (a * b).Lift(p);
    if (std::abs(end.w) < 0.1 || std::abs(between.w) < 0.1) continue;
    // Coordinates of up to 30 over W of at least 0.1: 1e3 epsilon at most.
    ExpectNear((a * b).Map(p), a.Map(b.Map(p)), 1e3 * kEps);
    ExpectNear(b.Inverse().Map(b.Map(p)), p, 1e3 * kEps);
    ExpectNear(b.Adjugate().Map(b.Map(p)), p, 1e3 * kEps);
    ExpectNear((b * b.Inverse()).Map(p), p, 1e3 * kEps);
    EXPECT_DOUBLE_EQ(b.Normalised()(2, 2), 1);
    ExpectNear(b.Normalised().Map(p), b.Map(p), 1e3 * kEps);
    EXPECT_NEAR((a * b).Determinant(), a.Determinant() * b.Determinant(), 1e3 * kEps);
  }
}

TEST(Homography, DerivativeIsThatOfDifferences) {
  constexpr double kStep = 1e-5;
  for (std::uint32_t n = 0; n < 50; ++n) {
    const Homography map = RandomMap(n);
    const Vec2 p = RandomPoint(n);
    const PlaneDerivative d = map.Derivative(p);
    const auto slope = [&](Vec2 step) {
      return (0.5 / kStep) * (map.Map(p + kStep * step) - map.Map(p + (-kStep) * step));
    };
    // The third derivative times step^2 / 6, and rounding over the step.
    ExpectNear(d.by_x, slope({1, 0}), 1e-8);
    ExpectNear(d.by_y, slope({0, 1}), 1e-8);
    const double area = d.by_x.x * d.by_y.y - d.by_x.y * d.by_y.x;
    EXPECT_NEAR(map.AreaFactor(p), area, 1e-12 * (1 + std::abs(area)));
  }
}

TEST(Homography, SingularOnesAreRefused) {
  // A third row that is the sum of the others, to rounding: thirds have no exact digits.
  const Homography flat(
      {1.0 / 3, 0.7, 1e3, 0.1, 1.0 / 7, 2, 1.0 / 3 + 0.1, 0.7 + 1.0 / 7, 1e3 + 2});
  EXPECT_TRUE(flat.Singular());
  try {
    flat.Inverse();
    ADD_FAILURE() << "a singular map was inverted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("singular"));
  }
  EXPECT_TRUE(Homography({0, 0, 0, 0, 0, 0, 0, 0, 0}).Singular());
  EXPECT_TRUE(Homography({NAN, 0, 0, 0, 1, 0, 0, 0, 1}).Singular());
  EXPECT_TRUE(Homography({HUGE_VAL, 0, 0, 0, 1, 0, 0, 0, 1}).Singular());
  // A sensor of pixels of a micrometre, a metre beside the axis, is none.
  EXPECT_FALSE(Homography({1e-6, 0, 1, 0, -1e-6, -1, 0, 0, 1}).Singular());
  EXPECT_THROW(Homography::FromCorners(2, 2, {{{0, 0}, {1, 0}, {2, 0}, {0, 1}}}), InputError);
  EXPECT_THROW(Homography::FromCorners(2, 2, {{{0, 0}, {0, 0}, {0, 0}, {0, 0}}}), InputError);
}

}  // namespace
}  // namespace luxfield::rig
