#include "luxfield/view/lighting/stage.h"

#include <algorithm>

namespace luxfield::view {
namespace {

using lightfield::Vec3;

constexpr double kLampHeight_m = 0.75;
constexpr double kFieldOfView_deg = 50;
constexpr double kBehind_m = 40;  // the floor behind the farthest lamp
constexpr double kSide_m = 80;    // half the screen's width, and its height
constexpr double kWall_m = 1.5;   // of the wall's plane from the lamp's axis
constexpr double kWallHeight_m = 3;
constexpr double kFloorAlbedo = 0.25, kWallAlbedo = 0.5, kScreenAlbedo = 0.8;

scene::Material Grey(const char* name, double albedo) {
  scene::Material material;
  material.name = name;
  material.albedo.fill(static_cast<float>(albedo));
  return material;
}

}  // namespace

scene::Pose StageLamp(double distance_m) {
  return scene::LookAt({0, -distance_m, kLampHeight_m}, {0, 1, kLampHeight_m}, {0, 0, 1});
}

scene::Camera StageCamera(double distance_m, int width, int height) {
  const double step = std::clamp(distance_m, 0.25, 12.0);
  const Vec3 eye{-0.6 * step, -distance_m - 0.7 * step, kLampHeight_m + 0.45 * step};
  const Vec3 target{0.05 * step, -0.35 * distance_m, kLampHeight_m - 0.05 * step};
  return scene::Camera::LookAt(eye, target, {0, 0, 1}, kFieldOfView_deg, width, height);
}

scene::Scene Stage(const std::filesystem::path& light_field, double distance_m, int width,
                   int height) {
  scene::Scene stage;
  stage.geometry.materials = {Grey("floor", kFloorAlbedo), Grey("wall", kWallAlbedo),
                              Grey("screen", kScreenAlbedo)};
  const double back = kFarthestScreen_m + kBehind_m;
  scene::AppendQuad({-kSide_m, -back, 0}, {2 * kSide_m, 0, 0}, {0, back, 0}, 0, stage.geometry);
  scene::AppendQuad({kWall_m, -back, 0}, {0, back, 0}, {0, 0, kWallHeight_m}, 1, stage.geometry);
  scene::AppendQuad({-kSide_m, 0, 0}, {2 * kSide_m, 0, 0}, {0, 0, kSide_m}, 2, stage.geometry);
  stage.camera = StageCamera(distance_m, width, height);
  stage.luminaires.push_back({"lamp", light_field, {}, StageLamp(distance_m), 1});
  return stage;
}

}  // namespace luxfield::view
