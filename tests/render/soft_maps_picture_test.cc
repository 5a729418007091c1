// Pictures with soft shadow maps: near those with traced shadows, and where lamps were moved as if
// they had always stood there.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/render/accuracy/soft_maps_error.h"
#include "tests/render/renderer_fixture.h"

namespace luxfield::render {
namespace {

scene::Scene BoxOnFloor(const std::filesystem::path& lamp, const scene::Pose& pose) {
  scene::Luminaire luminaire;
  luminaire.name = "lamp";
  luminaire.light_field = lamp;
  luminaire.world_from_luminaire = pose;
  scene::Scene scene = Floor({luminaire});
  AppendBox(scene::Translation({0, 0, 0.2}) * scene::Scaling({0.4, 0.4, 0.4}), 0, scene.geometry);
  scene.camera.width = 48;
  scene.camera.height = 32;
  return scene;
}

RenderOptions SoftMaps() {
  RenderOptions options;
  options.estimator = "volume";
  options.shadows = Shadows::kSoftMaps;
  return options;
}

TEST(SoftMapsPicture, IsNearTheTracedOneAndFollowsItsLamp) {
  const Device device = Device::Open();
  const auto lamp = WriteLamp("soft_maps", Lamp(3));
  const scene::Pose here = scene::LookAt({0.8, 0.3, 1.5}, {0, 0, 0}, {0, 1, 0}),
                    there = scene::LookAt({-0.6, 0.5, 1.4}, {0, 0, 0}, {0, 1, 0});
  LitScene scene(device, BoxOnFloor(lamp, here)), moved(device, BoxOnFloor(lamp, there));
  const SoftMapsError error = MeasureSoftMaps(scene, SoftMaps());
  std::printf("relative RMSE %.4f, %.3f mean Lab\n", error.rel_error, error.mean_lab);
  EXPECT_GT(error.rel_error, 0);
  EXPECT_LT(error.rel_error, 0.1);
  EXPECT_LT(error.mean_lab, 1.2);

  const Frame frame = Renderer(scene, SoftMaps()).Render();
  EXPECT_EQ(frame.provenance.at("shadows"), "soft-maps");
  EXPECT_EQ(frame.provenance.at("shadow_map_size"), "384");
  for (const float variance : frame.variance.data) ASSERT_EQ(variance, 0);
  auto none = SoftMaps();
  none.shadows = Shadows::kNone;
  EXPECT_GT(core::Compare(Renderer(scene, none).Render().radiance, frame.radiance).rel_rmse,
            3 * error.rel_error);

  scene.PlaceLuminaire(0, {there});
  scene.DropVolumes();
  const Frame after = Renderer(scene, SoftMaps()).Render(),
              fresh = Renderer(moved, SoftMaps()).Render();
  EXPECT_EQ(after.radiance.data, fresh.radiance.data);
  auto sampled = SoftMaps();
  sampled.estimator = "cells";
  EXPECT_THROW(Renderer(scene, sampled), InputError);
}

}  // namespace
}  // namespace luxfield::render
