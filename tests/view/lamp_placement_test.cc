// Lamps are written back into scene.toml without a change of anything else.
#include "luxfield/view/scene_file/lamp_placement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/scene/scene.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;

constexpr char kText[] = R"(# Two lamps. Für jeden eine Zeile.
[camera]
position = [-1, -1, 1.5]
look_at = [0, 2.5, 0.2]

[[material]]
name = "grey"
albedo = [0.5, 0.4, 0.3]
[[quad]]
corner = [-3, -1, 0]
edge_u = [6, 0, 0]
edge_v = [0, 8, 0]
material = "grey"

[[luminaire]]  # the left one
name = "left"
file = "a.lf.exr"
position = [ 0, 0,
             0.6 ]  # metres
look_at = [0, 5, 0.3]

)";

// And one that is turned by angles, with letters of two bytes behind it.
std::string Text() {
  return std::string(kText) +
         "[[luminaire]]\nfile = \"b.lf.exr\"\nposition = [1, 0, 0.6]  # r\xC3\xA9gl\xC3\xA9\n"
         "rotate_deg = [ -90,0,0 ]\nscale = 2 # twice\n";
}

class LampPlacementTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = fs::path(testing::TempDir()) / ("luxfield_lamps_" + std::to_string(getpid()) + ".toml");
    std::ofstream(file_, std::ios::binary) << Text();
  }
  void TearDown() override { fs::remove(file_); }
  fs::path file_;
};

TEST_F(LampPlacementTest, ReadsWhatTheScenesReaderReads) {
  const auto placements = ReadPlacements(file_);
  const scene::Scene scene = scene::ReadScene(file_);
  ASSERT_EQ(placements.size(), 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto pose = placements[i].WorldFromLuminaire();
    ASSERT_TRUE(pose);
    EXPECT_EQ(placements[i].name, scene.luminaires[i].name);
    EXPECT_EQ(pose->linear, scene.luminaires[i].world_from_luminaire.linear);
    EXPECT_EQ(pose->translation.x, scene.luminaires[i].world_from_luminaire.translation.x);
    EXPECT_EQ(placements[i].scale, scene.luminaires[i].scale);
  }
}

TEST_F(LampPlacementTest, WithoutAChangeEveryByteStays) {
  EXPECT_EQ(WithPlacements(Text(), ReadPlacements(file_), "f"), Text());
}

TEST_F(LampPlacementTest, ChangedValuesStandWhereTheOldOnesStoodAndCommentsStay) {
  auto placements = ReadPlacements(file_);
  placements[0].position = {0.1, -2, 0.75};
  placements[0].scale = 0.5;  // had no key
  placements[1].rotate_deg = {-90, 0, 12.5};
  placements[1].scale = 3;
  SavePlacements(file_, placements);
  const std::string text = core::ReadFile(file_);
  std::string expected = Text();
  const auto replace = [&](const std::string& from, const std::string& to) {
    expected.replace(expected.find(from), from.size(), to);
  };
  replace("[ 0, 0,\n             0.6 ]  # metres\n", "[0.1, -2, 0.75]  # metres\nscale = 0.5\n");
  replace("[ -90,0,0 ]", "[-90, 0, 12.5]");
  replace("scale = 2 # twice", "scale = 3 # twice");
  EXPECT_EQ(text, expected);
  EXPECT_EQ(ReadPlacements(file_), placements);
}

TEST_F(LampPlacementTest, AFileWithOtherLampsIsLeftAlone) {
  auto placements = ReadPlacements(file_);
  placements.pop_back();
  EXPECT_THROW(SavePlacements(file_, placements), InputError);
  placements = ReadPlacements(file_);
  placements[0].name = "right";
  EXPECT_THROW(SavePlacements(file_, placements), InputError);
  EXPECT_EQ(core::ReadFile(file_), Text());
}

TEST_F(LampPlacementTest, ALampThatLooksAtItselfHasNoPose) {
  LampPlacement placement;
  placement.look_at = placement.position;
  EXPECT_FALSE(placement.WorldFromLuminaire());
  placement.look_at = lightfield::Vec3{0, 0, 5};  // along `up`
  EXPECT_FALSE(placement.WorldFromLuminaire());
  placement.look_at = lightfield::Vec3{0, 5, 5};
  EXPECT_TRUE(placement.WorldFromLuminaire());
}

}  // namespace
}  // namespace luxfield::view
