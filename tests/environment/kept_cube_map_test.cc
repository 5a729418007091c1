// A cube map from the cache is the one that is made, to the bit.
#include "luxfield/environment/kept_cube_map.h"

#include <gtest/gtest.h>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/environment/environment_map.h"
#include "tests/cache_folder.h"
#include "tests/seed.h"

namespace luxfield::environment {
namespace {

TEST(KeptCubeMap, IsTheSameWithAnyCache) {
  const CacheFolder cache("kept_cube_map");
  core::Image image(16, 8, 3);
  core::Random random(TestSeed(8), 0);
  for (float& x : image.data) x = random.UniformFloat();
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield_kept_sky.exr";
  WriteEnvironmentPicture(file, image, EnvironmentLayout::kLatitudeLongitude);
  const CubeMap made = MakeCubeMap(ReadEnvironmentPicture(file), 6);
  ExpectSameWithAnyCache(
      cache, [&] { return KeptCubeMap(file, {}, 6); },
      [&](const CubeMap& a, const CubeMap& b) {
        EXPECT_EQ(a.face_size, 6);
        EXPECT_EQ(a.data, made.data);
        EXPECT_EQ(b.face_size, 6);
        EXPECT_EQ(b.data, made.data);
      });
  KeptCubeMap(file, {}, 7);
  EXPECT_EQ(cache.Files().size(), 2u);
  KeptCubeMap(file, EnvironmentLayout::kLatitudeLongitude, 7);
  EXPECT_EQ(cache.Files().size(), 3u);
  image.data[5] += 1;
  WriteEnvironmentPicture(file, image, EnvironmentLayout::kLatitudeLongitude);
  EXPECT_NE(KeptCubeMap(file, {}, 6).data, made.data);
  EXPECT_THROW(KeptCubeMap(file.string() + ".absent", {}, 6), InputError);
}

}  // namespace
}  // namespace luxfield::environment
