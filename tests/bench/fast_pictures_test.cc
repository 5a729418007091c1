// Pictures beside their references: that both are of the scene and what tells them apart.
#include "luxfield/bench/fast_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "luxfield/bench/verbs/pictures_report.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/render/accuracy/car2.h"
#include "tests/seed.h"

namespace luxfield::bench {
namespace {

// Two lamps over a glossy floor with a bar that throws a shadow on it.
std::filesystem::path WriteScene(const std::string& luminaires) {
  const auto folder = std::filesystem::path(testing::TempDir()) /
                      ("luxfield_fast_pictures_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  lightfield::WriteLightField(folder / "lamp.lf.exr", render::SyntheticCar2({5, 5, 64, 1}));
  core::WriteFileAtomically(folder / "floor.obj",
                            "v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -0.05 0.5 -1\n"
                            "v 0.05 0.5 -1\nv 0.05 0.5 1\nv -0.05 0.5 1\nf 4 3 2 1\nf 8 7 6 5\n");
  core::WriteFileAtomically(folder / "scene.toml", R"(
[camera]
position = [0, 1.5, 3]
look_at = [0, 0, 0]
up = [0, 1, 0]
vertical_fov_deg = 50
width = 64
height = 48

[[material]]
name = "floor"
albedo = [0.5, 0.5, 0.5]
kind = "ggx"
roughness = 0.4

[[mesh]]
file = "floor.obj"
material = "floor"
)" + luminaires);
  return folder / "scene.toml";
}

constexpr char kLamps[] = R"(
[[luminaire]]
name = "left"
file = "lamp.lf.exr"
position = [-0.4, 2, 0]
look_at = [-0.4, 0, 0]

[[luminaire]]
name = "right"
file = "lamp.lf.exr"
position = [0.4, 2, 0]
look_at = [0.4, 0, 0]
)";

TEST(FastPictures, StandBesideWhatTheyStandFor) {
  FastPicturesOptions options;
  options.scene = WriteScene(kLamps);
  options.width = 64;
  options.height = 48;
  options.samples_per_pixel = 16;
  options.reference_samples = 128;
  options.seed = TestSeed(1);
  const auto pictures = MakeFastPictures(options);
  std::vector<std::string> names;
  for (const FastPicture& picture : pictures) {
    names.push_back(picture.name);
    ASSERT_GT(picture.difference.mean_reference, 0) << picture.name;
    EXPECT_NE(picture.how, picture.reference_how) << picture.name;
  }
  EXPECT_THAT(names, testing::ElementsAre("volume", "soft-maps", "gloss", "cells", "windowed",
                                          "drawn-lights", "ray-batches"));
  // Without noise: what the volume and gloss are made for, over other receivers than theirs.
  EXPECT_LT(pictures[0].difference.rel_rmse, 3 * options.approximation_error);
  EXPECT_EQ(pictures[0].noise, 0);
  EXPECT_LT(pictures[2].difference.rel_rmse, 3 * options.approximation_error);
  // Sampled ones scatter as they state, a shadow's edge at 64 x 48 pixels more or less: by a factor.
  for (const int k : {3, 4, 5}) {
    EXPECT_GT(pictures[k].noise, 0);
    EXPECT_LT(pictures[k].difference.rel_rmse, 2 * pictures[k].noise) << pictures[k].name;
    EXPECT_GT(pictures[k].difference.rel_rmse, pictures[k].noise / 2) << pictures[k].name;
  }
  // The shadow of the bar is there: maps that cast none are off by more.
  EXPECT_LT(pictures[1].difference.rel_rmse, 0.2);
  // The same samples; some rays graze an edge on its other side, in float32.
  EXPECT_LT(pictures[6].difference.rel_rmse, 0.3 * pictures[3].noise);

  const auto folder = options.scene.parent_path() / "pictures";
  const std::string page = core::ReadFile(WriteFastPictures(pictures, folder));
  for (const FastPicture& picture : pictures)
    for (const char* what : {"fast", "reference", "difference"}) {
      const std::string file = picture.name + "-" + what + ".png";
      EXPECT_GT(std::filesystem::file_size(folder / file), 500u);
      EXPECT_THAT(page, testing::HasSubstr(file));
    }
}

TEST(FastPictures, NeedALuminaire) {
  FastPicturesOptions options;
  options.scene = WriteScene("");
  EXPECT_THROW(MakeFastPictures(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
