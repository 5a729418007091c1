// The scenes of data/scenes/balance/: what `bench balance` is taken over.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "luxfield/scene/scene.h"

namespace luxfield::scene {
namespace {

TEST(BalanceScenes, CoverTheCases) {
  std::map<std::string, Scene> scenes;
  for (const auto& entry :
       std::filesystem::directory_iterator(LUXFIELD_SOURCE_DIR "/data/scenes/balance"))
    if (entry.path().extension() == ".toml")
      scenes.emplace(entry.path().stem().string(), ReadScene(entry.path()));
  EXPECT_EQ(scenes.size(), 11u);
  for (const auto& [name, scene] : scenes) {
    EXPECT_TRUE(!scene.area_lights.empty() || scene.environment) << name;
    EXPECT_LT(scene.geometry.triangles.size(), 10000u) << name;
    if (scene.environment) {
      EXPECT_TRUE(std::filesystem::exists(scene.environment->file)) << name;
    }
  }
  const auto glossy = [&](const std::string& name) {
    std::size_t count = 0;
    const Geometry& geometry = scenes.at(name).geometry;
    for (const auto& triangle : geometry.triangles)
      count += IsGlossy(geometry.materials[triangle.material]);
    return static_cast<double>(count) / static_cast<double>(geometry.triangles.size());
  };
  EXPECT_EQ(glossy("diffuse"), 0);
  EXPECT_EQ(glossy("mirror"), 1);
  // One of the five faces away from all that there is.
  ASSERT_EQ(scenes.at("five-lights").area_lights.size(), 5u);
  const AreaLight& away = scenes.at("five-lights").area_lights[4];
  for (const auto& vertex : scenes.at("five-lights").geometry.vertices) {
    const Vec3 p{vertex.position[0], vertex.position[1], vertex.position[2]};
    if (p.z < 2.8) {
      EXPECT_LT(away.world_from_light.Inverse().Point(p).z, 0);
    }
  }
}

}  // namespace
}  // namespace luxfield::scene
