// Soft shadows of a lamp that does not stand about its frame's middle.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/preprocess/patch_light.h"
#include "luxfield/render/lights/patch_shadows.h"
#include "luxfield/render/scene/device_scene.h"
#include "tests/render/brute_force.h"
#include "tests/render/estimator_fixture.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;

// Of receivers beyond an edge askew, all moved along F with the lamp.
std::vector<float> Shares(const Device& device, const Vec3& moved) {
  lightfield::LightField field =
      StructuredLuminaire("rings", {.grid_width = 6, .grid_height = 5}, 20140905);
  field.geometry.grid.u0_m += moved.x;
  field.geometry.grid.v0_m += moved.y;
  field.geometry.lattice.s0_m += moved.x;
  field.geometry.lattice.t1_m += moved.y;
  scene::Geometry geometry;
  AppendQuad(moved + Vec3{-4, -1.5, 0.5}, {8, 3, 0}, {-1.5, 4, 0}, 0, geometry);
  const DeviceBvh bvh = UploadBvh(device, geometry, scene::BuildBvh(geometry));
  LuminaireOnDevice lamp(device, field);
  const auto patches = preprocess::TabulatePatchLight(field);
  lamp.Add(device, {.patches = &patches});
  std::vector<SurfacePoint> points;
  for (int k = 0; k < 60; ++k)
    points.push_back(RoundToFloat(
        {moved + Vec3{0.004 * (k % 7), 0.005 * (k - 30), 1.2}, Normalized(Vec3{0.1, -0.2, -1})}));
  return PatchShadows(device, lamp, {}, bvh, 256)
      .Shares(MakeGBuffer(device, points))
      .Download<float>();
}

TEST(PatchCentre, ShadowsMoveWithTheLamp) {
  const Device device = Device::Open();
  const auto here = Shares(device, {0, 0, 0}), there = Shares(device, {0.25, -0.5, 0});
  double square = 0;
  int partly = 0;
  for (std::size_t k = 0; k < here.size(); ++k) {
    square += std::pow(here[k] - there[k], 2) / static_cast<double>(here.size());
    partly += here[k] > 0.05f && here[k] < 0.95f;
  }
  std::printf("rms %.2g over %d receivers in the penumbra\n", std::sqrt(square), partly);
  EXPECT_GT(partly, 10);
  // Float coordinates of half a metre move an edge by 1e-7 of one; maps by their texels at most.
  EXPECT_LT(std::sqrt(square), 5e-3);
}

}  // namespace
}  // namespace luxfield::render
