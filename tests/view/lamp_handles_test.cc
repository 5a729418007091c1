// What hands do to a lamp in the picture, by geometry.
#include "luxfield/view/scene_file/lamp_handles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/random.h"
#include "tests/seed.h"

namespace luxfield::view {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::Vec3;

scene::Camera Camera() {
  return scene::Camera::LookAt({1, -4, 2}, {0.5, 0.25, 0.5}, {0, 0, 1}, 40, 400, 300);
}

Vec3 RandomVector(core::Random& random, double size) {
  return size * Vec3{2 * random.Uniform() - 1, 2 * random.Uniform() - 1, 2 * random.Uniform() - 1};
}

// The pixel that sees a point looks along its direction.
TEST(LampHandles, APointIsSeenByThePixelThatLooksThere) {
  core::Random random(TestSeed(31), 0);
  const scene::Camera camera = Camera();
  for (int i = 0; i < 200; ++i) {
    const Vec3 point = RandomVector(random, 3);
    const auto seen = SeenAt(camera, point);
    ASSERT_EQ(seen.has_value(), Dot(point - camera.position, camera.forward) > 1e-9);
    if (!seen) continue;
    EXPECT_LT(Length(Cross(Normalized(camera.Direction(seen->column, seen->row)),
                           Normalized(point - camera.position))),
              1e-9);
    EXPECT_LT(Length(BesideInPicture(camera, *seen, point) - point), 1e-9);
  }
  EXPECT_FALSE(SeenAt(camera, camera.position - camera.forward));
}

// Two points of a height's distance from each other are a picture's height apart.
TEST(LampHandles, TheHeightIsWhatThePictureSpans) {
  const scene::Camera camera = Camera();
  const Vec3 point{0.2, 1, 0.3}, above = point + HeightAt(camera, point) * camera.up;
  EXPECT_NEAR(SeenAt(camera, point)->row - SeenAt(camera, above)->row, 300, 1e-6);
}

// The nearest point of a line to a ray: no other of the line is nearer, and a point of the line that
// is seen is met itself.
TEST(LampHandles, AlongAnAxisTheNearestPointIsTaken) {
  core::Random random(TestSeed(32), 0);
  const scene::Camera camera = Camera();
  for (int i = 0; i < 200; ++i) {
    const Vec3 origin = RandomVector(random, 1), axis = Normalized(RandomVector(random, 1));
    const auto met = AlongAxis(camera, *SeenAt(camera, origin + 0.3 * axis), origin, axis);
    ASSERT_TRUE(met);
    EXPECT_NEAR(*met, 0.3, 1e-6);
    const PicturePoint pixel{400 * random.Uniform(), 300 * random.Uniform()};
    const Vec3 ray = Normalized(camera.Direction(pixel.column, pixel.row));
    const auto t = AlongAxis(camera, pixel, origin, axis);
    ASSERT_TRUE(t);
    const auto distance = [&](double along) {
      const Vec3 w = origin + along * axis - camera.position;
      return Length(w - Dot(w, ray) * ray);
    };
    EXPECT_LE(distance(*t), distance(*t + 1e-3));
    EXPECT_LE(distance(*t), distance(*t - 1e-3));
  }
  // A line that is looked along has no such point.
  EXPECT_FALSE(AlongAxis(camera, {200, 150}, camera.position, camera.forward));
}

TEST(LampHandles, AnglesAreThoseOfTheRotation) {
  core::Random random(TestSeed(33), 0);
  for (int i = 0; i < 300; ++i) {
    Vec3 degrees = RandomVector(random, 180);
    if (i % 3 == 0) degrees.y = i % 2 ? 90 : -90;
    const scene::Pose rotation = scene::RotationXyz(degrees),
                      again = scene::RotationXyz(AnglesOf(rotation));
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        ASSERT_NEAR(rotation.linear[row][column], again.linear[row][column], 2e-6) << i;
  }
}

TEST(LampHandles, AnAimedLampShinesAtItsTarget) {
  core::Random random(TestSeed(34), 0);
  LampPlacement lamp;
  for (int i = 0; i < 200; ++i) {
    lamp.position = RandomVector(random, 2);
    lamp.rotate_deg = RandomVector(random, 180);
    lamp.look_at = i % 2 ? std::optional(RandomVector(random, 9)) : std::nullopt;
    const Vec3 target =
        i % 10 == 2
            ? lamp.position - scene::RotationXyz(lamp.rotate_deg).Vector({0, 0, 1})  // half a turn
            : lamp.position + RandomVector(random, 5);
    const LampPlacement aimed = Aimed(lamp, target);
    EXPECT_EQ(aimed.look_at.has_value(), lamp.look_at.has_value());
    const auto pose = aimed.WorldFromLuminaire();
    ASSERT_TRUE(pose);
    EXPECT_LT(Length(pose->Vector({0, 0, 1}) - Normalized(target - lamp.position)), 1e-5) << i;
    EXPECT_LT(Length(pose->translation - lamp.position), 1e-12);
  }
  // Upon itself, or along `up`, it stays.
  lamp.look_at = lamp.position + Vec3{0, 1, 0};
  EXPECT_EQ(Aimed(lamp, lamp.position), lamp);
  EXPECT_EQ(Aimed(lamp, lamp.position + Vec3{0, 0, 1}), lamp);
}

// A point before the lamp lands at the mirrored point before the mirrored one, and the lamp's own y
// axis at its reflection.
TEST(LampHandles, AMirroredLampStandsAndShinesAsInTheMirror) {
  core::Random random(TestSeed(35), 0);
  for (int i = 0; i < 200; ++i) {
    LampPlacement lamp;
    lamp.position = RandomVector(random, 2);
    lamp.rotate_deg = RandomVector(random, 180);
    if (i % 2) lamp.look_at = lamp.position + RandomVector(random, 3);
    lamp.up = RandomVector(random, 1);
    const auto axis = static_cast<Axis>(i % 3);
    const double at = random.Uniform();
    const auto pose = lamp.WorldFromLuminaire(),
               mirrored = Mirrored(lamp, axis, at).WorldFromLuminaire();
    ASSERT_TRUE(pose);
    ASSERT_TRUE(mirrored);
    EXPECT_NEAR(mirrored->Determinant(), 1, 1e-6);
    for (const Vec3 point : {Vec3{0, 0, 0}, Vec3{0, 0, 2}, Vec3{0, 1, 3}}) {
      Vec3 expected = pose->Point(point);
      double& coordinate = axis == Axis::kX   ? expected.x
                           : axis == Axis::kY ? expected.y
                                              : expected.z;
      coordinate = 2 * at - coordinate;
      EXPECT_LT(Length(mirrored->Point(point) - expected), 2e-5) << i;
    }
  }
}

}  // namespace
}  // namespace luxfield::view
