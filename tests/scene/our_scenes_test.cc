// The scenes of data/scenes/: what the benches and the pictures of the README are taken over.
#include <gtest/gtest.h>

#include "luxfield/scene/scene.h"

namespace luxfield::scene {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;

Vec3 ToVec3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

class OurScenes : public testing::TestWithParam<std::string> {
 protected:
  const Scene scene_ = ReadScene(LUXFIELD_SOURCE_DIR "/data/scenes/" + GetParam() + ".toml");
};

TEST_P(OurScenes, HaveLampsOfRunLamps) {
  ASSERT_FALSE(scene_.luminaires.empty());
  for (const auto& luminaire : scene_.luminaires)
    EXPECT_EQ(luminaire.light_field.parent_path().lexically_normal(),
              std::filesystem::path(LUXFIELD_SOURCE_DIR "/out/lamps"));
}

TEST_P(OurScenes, HoldDiffuseAndGlossyThings) {
  Geometry geometry = scene_.geometry;
  std::size_t glossy = 0;
  for (const auto& triangle : geometry.triangles)
    glossy += IsGlossy(geometry.materials[triangle.material]);
  EXPECT_GT(glossy, 0u);
  EXPECT_LT(glossy, geometry.triangles.size());
  MakeLambertian(geometry);
  for (std::size_t k = 0; k < geometry.materials.size(); ++k) {
    EXPECT_FALSE(IsGlossy(geometry.materials[k]));
    EXPECT_EQ(geometry.materials[k].albedo, scene_.geometry.materials[k].albedo);
  }
}

// A mesh whose smooth normals lie in its facets, or point to the other side from one corner to the
// next, shades wrong.
TEST_P(OurScenes, SmoothNormalsFollowTheFacets) {
  const Geometry& geometry = scene_.geometry;
  std::size_t smooth = 0, wrong = 0;
  for (std::size_t k = 0; k < geometry.triangles.size(); ++k) {
    const Vec3 a = ToVec3(geometry.corner(k, 0)), b = ToVec3(geometry.corner(k, 1)),
               c = ToVec3(geometry.corner(k, 2));
    const Vec3 facet = Cross(b - a, c - a);
    const double area = Length(facet);
    if (area < 1e-9) continue;  // the tip of a fan
    int front = 0, back = 0;
    for (const auto corner : geometry.triangles[k].vertex) {
      const Vec3 normal = ToVec3(geometry.vertices[corner].normal);
      if (Length(normal) == 0) continue;
      EXPECT_NEAR(Length(normal), 1, 1e-4);
      const double cosine = Dot(normal, facet) / area;
      front += cosine > 0.05;
      back += cosine < -0.05;
    }
    if (front + back == 0) continue;
    ++smooth;
    wrong += (front && back) || front + back < 3;
  }
  EXPECT_GT(smooth, 1000u);
  EXPECT_LT(wrong, smooth / 100);
}

INSTANTIATE_TEST_SUITE_P(All, OurScenes, testing::Values("garage", "wall", "street", "hall"),
                         [](const auto& scene) { return scene.param; });

}  // namespace
}  // namespace luxfield::scene
