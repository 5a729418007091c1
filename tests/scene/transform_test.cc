#include "luxfield/scene/transform.h"

#include <gtest/gtest.h>

#include "luxfield/core/random.h"

namespace luxfield::scene {
namespace {

void ExpectNear(Vec3 a, Vec3 b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(Transform, EulerAnglesTurnAboutXThenYThenZ) {
  ExpectNear(RotationXyz({90, 0, 0}).Vector({0, 1, 0}), {0, 0, 1}, 1e-15);
  ExpectNear(RotationXyz({0, 90, 0}).Vector({0, 0, 1}), {1, 0, 0}, 1e-15);
  ExpectNear(RotationXyz({0, 0, 90}).Vector({1, 0, 0}), {0, 1, 0}, 1e-15);
  ExpectNear(RotationXyz({90, 0, 90}).Vector({0, 1, 0}), {0, 0, 1}, 1e-15);  // x first
  ExpectNear(RotationXyz({90, 0, 90}).Vector({0, 0, 1}), {1, 0, 0}, 1e-15);
}

TEST(Transform, LookAtShinesAtItsTargetWithYUp) {
  const Pose pose = LookAt({1, 2, 3}, {1, 7, 3}, {0, 0, 1});
  ExpectNear(pose.Point({0, 0, 5}), {1, 7, 3}, 1e-15);
  ExpectNear(pose.Vector({0, 1, 0}), {0, 0, 1}, 1e-15);
  ExpectNear(pose.Vector({1, 0, 0}), {-1, 0, 0},
             1e-15);  // up x z: right as a receiver sees the lamp
  EXPECT_NEAR(LookAt({1, 2, 3}, {-4, 0.5, 9}, {0.2, 1, 0.3}).Determinant(), 1, 1e-14);
}

TEST(Transform, InverseUndoes) {
  const Transform t = Translation({1, -2, 3}) * RotationXyz({10, 20, 30}) * Scaling({2, 0.5, -3});
  ExpectNear(t.Inverse().Point(t.Point({0.3, -0.7, 1.1})), {0.3, -0.7, 1.1}, 1e-14);
  EXPECT_NEAR(t.Determinant(), -3, 1e-14);
}

// A normal stays perpendicular to the transformed tangents and on the side of the transformed
// outside point.
TEST(Transform, NormalsSurviveNonUniformScaleAndMirroring) {
  constexpr int kSeed = 4;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  const auto unit = [&] {
    return lightfield::Normalized({random.Normal(), random.Normal(), random.Normal()});
  };
  for (int i = 0; i < 100; ++i) {
    const Vec3 normal = unit();
    const Vec3 tangent = lightfield::Normalized(lightfield::Cross(normal, unit()));
    const Transform t = RotationXyz({random.Uniform() * 360, random.Uniform() * 360, 20}) *
                        Scaling({0.1 + random.Uniform(), 3, i % 2 ? -0.5 : 0.5}) *
                        RotationXyz({0, 70, 10});
    const Vec3 transformed = t.Normal(normal);
    EXPECT_NEAR(lightfield::Length(transformed), 1, 1e-14);
    EXPECT_NEAR(lightfield::Dot(transformed, t.Vector(tangent)), 0, 1e-13);
    EXPECT_NEAR(lightfield::Dot(transformed, t.Vector(lightfield::Cross(normal, tangent))), 0,
                1e-13);
    EXPECT_GT(lightfield::Dot(transformed, t.Vector(normal)), 0);
  }
}

}  // namespace
}  // namespace luxfield::scene
