// Pictures of more rays than are traced at once.
#include <gtest/gtest.h>

#include "luxfield/render/scene/device_scene.h"

namespace luxfield::render {
namespace {

using scene::Vec3;

// Of every row the point where its ray meets the plane: rows are traced some at a time.
TEST(GBufferRows, EveryRowSeesWhatItLooksAt) {
  scene::Geometry geometry;
  geometry.materials.emplace_back();
  scene::AppendQuad({-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, 0, geometry);
  const auto camera = scene::Camera::LookAt({1, -2, 3}, {0, 0.5, 0}, {0, 0, 1}, 20, 2048, 150);
  constexpr int kFirstRow = 2, kRows = 147;
  const auto device = Device::Open();
  GBuffer gbuffer(device, camera.width, kRows);
  PrimaryVisibility(device)
      .Render(UploadScene(device, geometry), camera, kFirstRow, {0.5, 0.5}, gbuffer, {16, 4})
      .Wait();
  const auto position = gbuffer.position.Download<cl_float4>();
  for (int row = 0; row < kRows; ++row)
    for (const int column : {0, 1000, camera.width - 1}) {
      const Vec3 direction = camera.Direction(column + 0.5, kFirstRow + row + 0.5);
      ASSERT_LT(direction.z, 0);
      const Vec3 expected = camera.position - (camera.position.z / direction.z) * direction;
      const cl_float4& found = position[static_cast<std::size_t>(row) * camera.width + column];
      ASSERT_EQ(found.s[3], 1) << row;
      // Some roundings of coordinates of a few metres.
      ASSERT_LT(lightfield::Length(Vec3{found.s[0], found.s[1], found.s[2]} - expected), 1e-4)
          << row;
    }
}

}  // namespace
}  // namespace luxfield::render
