// A mesh from the cache is the one that assimp reads, to the bit; what other files decide is read
// each time.
#include <gtest/gtest.h>

#include <fstream>

#include "luxfield/scene/mesh.h"
#include "tests/cache_folder.h"

namespace luxfield::scene {
namespace {

constexpr char kPly[] =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "property float nx\nproperty float ny\nproperty float nz\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n"
    "0 0 0 0 0 1\n1 0 0.5 0 0 1\n1 1 0 0 0.6 0.8\n0 1 0.25 0 0 1\n4 0 1 2 3\n";

Geometry Read(const std::filesystem::path& file) {
  Geometry geometry;
  AppendMesh(file, Translation({1, 2, 3}), {}, geometry);
  return geometry;
}

TEST(KeptMesh, IsTheSameWithAnyCache) {
  const CacheFolder cache("kept_mesh");
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield_kept.ply";
  std::ofstream(file, std::ios::binary) << kPly;
  ExpectSameWithAnyCache(
      cache, [&] { return Read(file); },
      [](const Geometry& a, const Geometry& b) {
        ASSERT_EQ(a.vertices.size(), 4u);
        ASSERT_EQ(b.vertices.size(), 4u);
        for (std::size_t k = 0; k < 4; ++k) {
          EXPECT_EQ(a.vertices[k].position, b.vertices[k].position);
          EXPECT_EQ(a.vertices[k].normal, b.vertices[k].normal);
          EXPECT_EQ(a.vertices[k].uv, b.vertices[k].uv);
        }
        ASSERT_EQ(a.triangles.size(), 2u);
        ASSERT_EQ(b.triangles.size(), 2u);
        for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ(a.triangles[k].vertex, b.triangles[k].vertex);
        ASSERT_EQ(a.materials.size(), 1u);
        ASSERT_EQ(b.materials.size(), 1u);
        EXPECT_EQ(a.materials[0].name, b.materials[0].name);
        EXPECT_EQ(a.materials[0].albedo, b.materials[0].albedo);
      });
}

// An OBJ's materials are in a file beside it.
TEST(KeptMesh, AnObjIsReadEachTime) {
  const CacheFolder cache("kept_obj");
  const std::filesystem::path folder = testing::TempDir(), file = folder / "luxfield_kept.obj";
  std::ofstream(file) << "mtllib luxfield_kept.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
  for (const float albedo : {0.25f, 0.75f}) {
    std::ofstream(folder / "luxfield_kept.mtl") << "newmtl m\nKd " << albedo << " 0 0\n";
    EXPECT_EQ(Read(file).materials.at(0).albedo[0], albedo);
  }
  EXPECT_TRUE(cache.Files().empty());
}

}  // namespace
}  // namespace luxfield::scene
