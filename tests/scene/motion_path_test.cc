// Where camera and lamps are between their keys, by closed forms.
#include "luxfield/scene/motion_path.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "luxfield/core/error.h"

namespace luxfield::scene {
namespace {

namespace fs = std::filesystem;
using lightfield::Length;
using lightfield::Vec3;
using testing::HasSubstr;

class MotionPathTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = fs::path(testing::TempDir()) / fmt::format("luxfield_path_{}.toml", getpid());
    scene_.camera = scene::Camera::LookAt({1, -4, 2}, {0, 0, 0}, {0, 0, 1}, 40, 400, 300);
    for (const char* name : {"left", "row", "row"})
      scene_.luminaires.push_back(
          {name, {}, {}, scene::LookAt({0, 0, 1}, {0, 5, 1}, {0, 0, 1}), 0.5});
    placement_.camera = scene_.camera;
    for (const auto& lamp : scene_.luminaires)
      placement_.lamps.push_back({lamp.world_from_luminaire, lamp.scale});
  }
  void TearDown() override { fs::remove(file_); }

  MotionPath Read(const std::string& text) {
    std::ofstream(file_) << text;
    return ReadMotionPath(file_);
  }
  // What the reader, or the first placing, says of a text.
  std::string Refused(const std::string& text) {
    try {
      placement_ = PlacementAt(Read(text), 0, scene_);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }

  fs::path file_;
  scene::Scene scene_;
  Placement placement_;
};

std::string CameraKeyAt(double t_s, Vec3 position, Vec3 look_at) {
  return fmt::format("[[camera]]\nt_s = {}\nposition = [{}, {}, {}]\nlook_at = [{}, {}, {}]\n", t_s,
                     position.x, position.y, position.z, look_at.x, look_at.y, look_at.z);
}

// p(t) = p0 + v t + a t^2 / 2, met exactly from keys at uneven times.
TEST_F(MotionPathTest, ConstantAccelerationIsMetExactly) {
  const auto at = [](double t) { return Vec3{1 + 2 * t - 0.5 * t * t, -4 + t, 2 + 0.25 * t * t}; };
  std::string text = "up = [0, 0, 1]\n";
  for (const double t : {0.5, 1.0, 2.5, 4.0}) text += CameraKeyAt(t, at(t), {0, 10, 0});
  const MotionPath path = Read(text);
  EXPECT_DOUBLE_EQ(path.duration_s, 4);
  for (double t = 0.5; t <= 4; t += 0.125) {
    placement_ = PlacementAt(path, t, scene_);
    EXPECT_LT(Length(placement_.camera.position - at(t)), 1e-12) << t;
    EXPECT_LT(Length(lightfield::Normalized(Vec3{0, 10, 0} - at(t)) - placement_.camera.forward),
              1e-12);
  }
  EXPECT_EQ(placement_.camera.width, 400);
  EXPECT_DOUBLE_EQ(placement_.camera.vertical_fov_deg, 40);
}

TEST_F(MotionPathTest, OutsideOfTheKeysValuesStay) {
  const MotionPath path =
      Read(CameraKeyAt(1, {1, 2, 3}, {0, 0, 0}) + CameraKeyAt(2, {4, 5, 6}, {0, 0, 0}) +
           CameraKeyAt(3, {9, 5, 6}, {0, 0, 0}));
  placement_ = PlacementAt(path, 0, scene_);
  EXPECT_LT(Length(placement_.camera.position - Vec3{1, 2, 3}), 1e-15);
  placement_ = PlacementAt(path, 7, scene_);
  EXPECT_LT(Length(placement_.camera.position - Vec3{9, 5, 6}), 1e-15);
}

// Through the keys, and without a jump of the velocity there.
TEST_F(MotionPathTest, TheVelocityHasNoJumpAtAKey) {
  const MotionPath path =
      Read(CameraKeyAt(0, {0, 1, 0}, {0, 9, 0}) + CameraKeyAt(1, {5, 1, 0}, {0, 9, 0}) +
           CameraKeyAt(4, {-2, 1, 0}, {0, 9, 0}) + CameraKeyAt(5, {0, 1, 0}, {0, 9, 0}));
  const auto x = [&](double t) {
    placement_ = PlacementAt(path, t, scene_);
    return placement_.camera.position.x;
  };
  constexpr double kStep_s = 1e-5;
  EXPECT_DOUBLE_EQ(x(1), 5);
  EXPECT_DOUBLE_EQ(x(4), -2);
  for (const double t : {1.0, 4.0})
    EXPECT_NEAR((x(t + kStep_s) - x(t)) / kStep_s, (x(t) - x(t - kStep_s)) / kStep_s, 1e-3) << t;
}

TEST_F(MotionPathTest, ALampMovesTurnsAndIsDimmed) {
  const MotionPath path = Read(R"(frames_per_s = 10
duration_s = 2
[[luminaire]]
name = "left"
[[luminaire.key]]
t_s = 0
position = [0, 0, 1]
rotate_deg = [-90, 0, 0]
scale = 1
[[luminaire.key]]
t_s = 2
position = [2, 0, 1]
rotate_deg = [-90, 0, 40]
scale = 0
)");
  EXPECT_EQ(path.frame_count(), 21);
  EXPECT_DOUBLE_EQ(path.time_s(5), 0.5);
  placement_ = PlacementAt(path, 0.5, scene_);
  const scene::Pose pose = scene::Translation({0.5, 0, 1}) * scene::RotationXyz({-90, 0, 10});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(placement_.lamps[0].world_from_luminaire.linear[i][j], pose.linear[i][j], 1e-12);
  EXPECT_LT(Length(placement_.lamps[0].world_from_luminaire.translation - Vec3{0.5, 0, 1}), 1e-12);
  EXPECT_DOUBLE_EQ(placement_.lamps[0].scale, 0.75);
  EXPECT_DOUBLE_EQ(placement_.lamps[1].scale, 0.5);
}

TEST_F(MotionPathTest, ALampWithPositionsAloneKeepsItsDirectionAndItsLight) {
  placement_ = PlacementAt(
      Read("[[luminaire]]\nname = \"left\"\n[[luminaire.key]]\nt_s = 0\nposition = [3, 1, 2]\n"), 0,
      scene_);
  EXPECT_EQ(placement_.lamps[0].world_from_luminaire.linear,
            scene_.luminaires[0].world_from_luminaire.linear);
  EXPECT_DOUBLE_EQ(placement_.lamps[0].world_from_luminaire.translation.x, 3);
  EXPECT_DOUBLE_EQ(placement_.lamps[0].scale, 0.5);
}

TEST_F(MotionPathTest, WhatMakesNoSenseIsRefusedByName) {
  const std::string lamp = "[[luminaire]]\nname = \"left\"\n",
                    key = "[[luminaire.key]]\nt_s = 0\nposition = [0, 0, 0]\n";
  EXPECT_THAT(Refused(""), HasSubstr("moves nothing"));
  EXPECT_THAT(Refused(lamp), HasSubstr("has no keys"));
  EXPECT_THAT(Refused(lamp + key + key), HasSubstr("t_s"));
  EXPECT_THAT(Refused(lamp + key + "look_at = [0, 0, 0]\n"), HasSubstr("\"left\" stands at the"));
  EXPECT_THAT(Refused(lamp + key + "look_at = [0, 0, 4]\n"), HasSubstr("looks along up"));
  EXPECT_THAT(Refused(lamp + key + "look_at = [0, 4, 0]\nrotate_deg = [0, 0, 0]\n"),
              HasSubstr("contradicts look_at"));
  EXPECT_THAT(Refused(lamp + key + "scale = 1\n[[luminaire.key]]\nt_s = 1\nposition = [0, 0, 1]\n"),
              HasSubstr("other fields"));
  EXPECT_THAT(Refused(lamp + key + "colour = 1\n"), HasSubstr("colour"));
  EXPECT_THAT(Refused("[[luminaire]]\nname = \"lft\"\n" + key), HasSubstr("\"lft\" is not in"));
  EXPECT_THAT(Refused("[[luminaire]]\nname = \"row\"\n" + key), HasSubstr("array"));
  EXPECT_THAT(Refused("frames_per_s = 0\n" + lamp + key), HasSubstr("frames_per_s"));
  EXPECT_THAT(Refused("frames_per_s = 1000\nduration_s = 80000\n" + lamp + key),
              HasSubstr("more than 1000000 frames"));
  EXPECT_THAT(Refused(CameraKeyAt(0, {1, 1, 1}, {1, 1, 1})), HasSubstr("the camera stands"));
}

}  // namespace
}  // namespace luxfield::scene
