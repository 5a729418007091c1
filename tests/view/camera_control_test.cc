// What hands do to a camera, by geometry.
#include "luxfield/view/lighting/camera_control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace luxfield::view {
namespace {

using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::Vec3;

scene::Camera Camera() {
  return scene::Camera::LookAt({1, -4, 2}, {0.5, 0.25, 0.5}, {0, 0, 1}, 40, 400, 300);
}

Vec3 PivotOf(const CameraControl& control) {
  return control.camera().position + control.pivot_m() * Normalized(control.camera().forward);
}

// The pixel that shows a point, from the definition of the pinhole.
std::array<double, 2> PixelOf(const scene::Camera& camera, Vec3 point) {
  const Vec3 d = point - camera.position;
  const double half = std::tan(camera.vertical_fov_deg * std::numbers::pi / 360);
  const double aspect = static_cast<double>(camera.width) / camera.height;
  const double forward = Dot(d, camera.forward);
  return {camera.width * (1 + Dot(d, camera.right) / (forward * half * aspect)) / 2,
          camera.height * (1 - Dot(d, camera.up) / (forward * half)) / 2};
}

void ExpectSame(Vec3 a, Vec3 b) { EXPECT_LT(Length(a - b), 1e-9); }

void ExpectOrthonormalAndLevel(const scene::Camera& camera) {
  for (const Vec3 axis : {camera.right, camera.up, camera.forward})
    EXPECT_NEAR(Length(axis), 1, 1e-9);
  EXPECT_NEAR(Dot(camera.right, camera.up), 0, 1e-9);
  EXPECT_NEAR(camera.right.z, 0, 1e-9);
}

TEST(CameraControl, OrbitKeepsThePivotAndItsDistance) {
  CameraControl control(Camera(), 4);
  const Vec3 pivot = PivotOf(control);
  for (int i = 0; i < 20; ++i) {
    control.Orbit(0.3, i < 10 ? 0.1 : -0.2);
    ExpectSame(PivotOf(control), pivot);
    ExpectOrthonormalAndLevel(control.camera());
  }
}

TEST(CameraControl, OrbitToTheRightShowsTheSideThatLiesThere) {
  CameraControl control(Camera(), 4);
  const Vec3 right = control.camera().right, before = control.camera().position;
  control.Orbit(0.1, 0);
  EXPECT_GT(Dot(control.camera().position - before, right), 0);
  const double height = control.camera().position.z;
  control.Orbit(0, 0.1);
  EXPECT_GT(control.camera().position.z, height);
}

TEST(CameraControl, OrbitStopsBeforeTheViewIsUpright) {
  CameraControl control(Camera(), 4);
  control.Orbit(0, 10);
  EXPECT_LT(control.camera().forward.z, -0.99);
  ExpectOrthonormalAndLevel(control.camera());
  control.Orbit(0, -20);
  EXPECT_GT(control.camera().forward.z, 0.99);
  ExpectOrthonormalAndLevel(control.camera());
}

TEST(CameraControl, PanMovesThePivotByThatPartOfThePicture) {
  CameraControl control(Camera(), 4);
  const Vec3 pivot = PivotOf(control);
  control.Pan(-0.25, 0.1);
  const auto [column, row] = PixelOf(control.camera(), pivot);
  EXPECT_NEAR(column, 200 + 0.25 * 300, 1e-6);
  EXPECT_NEAR(row, 150 + 0.1 * 300, 1e-6);
}

TEST(CameraControl, DollyKeepsThePivotAndChangesItsDistance) {
  CameraControl control(Camera(), 4);
  const Vec3 pivot = PivotOf(control);
  control.Dolly(0.5);
  EXPECT_DOUBLE_EQ(control.pivot_m(), 2);
  ExpectSame(PivotOf(control), pivot);
  for (int i = 0; i < 100; ++i) control.Dolly(0.5);
  EXPECT_GT(control.pivot_m(), 0);
}

TEST(CameraControl, TurnKeepsThePlaceAndFlyTheDirection) {
  CameraControl control(Camera(), 4);
  const Vec3 place = control.camera().position;
  control.Turn(0.2, 0.1);
  ExpectSame(control.camera().position, place);
  ExpectOrthonormalAndLevel(control.camera());
  const scene::Camera before = control.camera();
  control.Fly(1, 2, 3);
  ExpectSame(control.camera().position,
             place + before.right + 2.0 * before.up + 3.0 * before.forward);
  ExpectSame(control.camera().forward, before.forward);
}

TEST(CameraControl, UpIsTheAxisThatIsNearestToTheFilesOwn) {
  const auto y_up = scene::Camera::LookAt({0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 40, 400, 300);
  CameraControl control(y_up, 5);
  control.Orbit(0.5, 0.2);
  EXPECT_NEAR(control.camera().right.y, 0, 1e-9);
  EXPECT_GT(control.camera().up.y, 0.5);
}

}  // namespace
}  // namespace luxfield::view
