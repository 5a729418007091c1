#include <gtest/gtest.h>

#include <filesystem>

#include "luxfield/core/random.h"
#include "luxfield/reconstruct/calibrate/response/merge_stack.h"

namespace luxfield::reconstruct {
namespace {

// Every value of every plane is another one.
MergedPicture Numbered(int channels) {
  const core::Image empty(5, 3, channels);
  MergedPicture merged{empty, empty, empty, {}, {0.25, 1}, {}};
  core::Random random(20261124, 0);
  for (std::size_t k = 0; k < merged.radiance.data.size(); ++k) {
    merged.radiance.data[k] = static_cast<float>(random.Uniform());
    merged.sigma.data[k] = static_cast<float>(random.Uniform());
    merged.count.data[k] = static_cast<float>(k);
    merged.mask.push_back(static_cast<std::uint32_t>(100 + k));
  }
  return merged;
}

TEST(MergedPictureFile, KeepsEveryPlaneBitByBit) {
  for (const int channels : {1, 3}) {
    const MergedPicture merged = Numbered(channels);
    const auto path = std::filesystem::path(testing::TempDir()) /
                      ("luxfield_merged_" + std::to_string(channels) + ".exr");
    WriteMergedPicture(path, merged, {{"seed", "20261124"}});
    EXPECT_TRUE(IsMergedPicture(path));
    const MergedPicture again = ReadMergedPicture(path);
    EXPECT_EQ(again.radiance.channels, channels);
    EXPECT_EQ(again.radiance.data, merged.radiance.data);
    EXPECT_EQ(again.sigma.data, merged.sigma.data);
    EXPECT_EQ(again.count.data, merged.count.data);
    EXPECT_EQ(again.mask, merged.mask);
    std::filesystem::remove(path);
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
