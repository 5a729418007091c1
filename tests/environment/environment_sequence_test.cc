// Sequences: their order, the frames that come out, and what is refused at which frame.
#include "luxfield/environment/environment_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "luxfield/core/error.h"
#include "luxfield/core/radiance_hdr.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/environment_resampling.h"
#include "tests/lightfield/support.h"

namespace luxfield::environment {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using enum EnvironmentLayout;

core::Image Frame(int k, int height = 8) {
  core::Image image(2 * height, height, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = static_cast<float>(1000 * k + int(i % 37));
  return image;
}

std::filesystem::path Folder() {
  const auto folder = lightfield::UniquePath("_sequence");
  std::filesystem::create_directories(folder);
  return folder;
}

std::vector<std::string> Names(const std::vector<std::filesystem::path>& paths) {
  std::vector<std::string> names;
  for (const auto& path : paths) names.push_back(path.filename().string());
  return names;
}

std::string Message(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(EnvironmentSequence, NumbersInNamesCountAsNumbers) {
  const std::vector<std::string> order = {"",
                                          "a",
                                          "a0",
                                          "a00",
                                          "a1b",
                                          "a01c",
                                          "a2",
                                          "a9",
                                          "a10",
                                          "a10x",
                                          "a99999999999999999999",
                                          "a100000000000000000000",
                                          "b1"};
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t k = 0; k < order.size(); ++k)
      EXPECT_EQ(NaturallyBefore(order[i], order[k]), i < k) << order[i] << " " << order[k];
}

TEST(EnvironmentSequence, AFolderIsSortedAndAListIsNot) {
  const auto folder = Folder();
  for (const int k : {10, 9, 100})
    core::WriteExrImage(folder / fmt::format("sky_{}.exr", k), Frame(k));
  core::WriteRadianceHdr(folder / "sky_1.HDR", Frame(1));
  std::ofstream(folder / "notes.txt") << "not a frame\n";
  EXPECT_THAT(Names(ListEnvironmentFrames(folder)),
              ElementsAre("sky_1.HDR", "sky_9.exr", "sky_10.exr", "sky_100.exr"));
  std::ofstream(folder / "some.txt") << "# two of them\r\n\r\n  sky_10.exr \r\nsky_9.exr\n";
  EXPECT_THAT(Names(ListEnvironmentFrames(folder / "some.txt")),
              ElementsAre("sky_10.exr", "sky_9.exr"));
}

TEST(EnvironmentSequence, EveryFrameIsItsFileResampled) {
  const auto folder = Folder();
  for (int k = 0; k < 12; ++k) core::WriteExrImage(folder / fmt::format("{}.exr", k), Frame(k, 16));
  for (const int read_ahead : {1, 3, 40}) {
    EnvironmentSequence sequence(folder, {{}, 8, read_ahead});
    EXPECT_EQ(sequence.frames().size(), 12u);
    EXPECT_EQ(sequence.layout(), kLatitudeLongitude);
    EXPECT_EQ(sequence.width(), 32);
    EXPECT_EQ(sequence.face_size(), 8);
    const CubeResampler resampler(kLatitudeLongitude, TexelRegistration::kCells, 32, 16, 8);
    CubeMap cube;
    for (int pass = 0; pass < 2; ++pass) {
      for (int k = 0; k < 12; ++k) {
        ASSERT_TRUE(sequence.Next(cube));
        EXPECT_EQ(cube.data, resampler(Frame(k, 16)).data) << k;
      }
      EXPECT_FALSE(sequence.Next(cube));
      EXPECT_FALSE(sequence.Next(cube));
      sequence.Rewind();
    }
    // Rewound in the middle, and left there.
    ASSERT_TRUE(sequence.Next(cube));
    ASSERT_TRUE(sequence.Next(cube));
    sequence.Rewind();
    ASSERT_TRUE(sequence.Next(cube));
    EXPECT_EQ(cube.data, resampler(Frame(0, 16)).data);
    sequence.Rewind(10);
    for (const int k : {10, 11}) {
      ASSERT_TRUE(sequence.Next(cube));
      EXPECT_EQ(cube.data, resampler(Frame(k, 16)).data) << k;
    }
    EXPECT_FALSE(sequence.Next(cube));
  }
}

TEST(EnvironmentSequence, AFrameThatDiffersIsRefusedByNameAtItsTurn) {
  const auto folder = Folder();
  for (int k = 0; k < 3; ++k) core::WriteExrImage(folder / fmt::format("{}.exr", k), Frame(k));
  core::WriteExrImage(folder / "3.exr", Frame(3, 10));
  EnvironmentSequence sequence(folder);
  EXPECT_EQ(sequence.face_size(), 4);
  CubeMap cube;
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(sequence.Next(cube));
  for (int again = 0; again < 2; ++again) {
    const std::string message = Message([&] { sequence.Next(cube); });
    EXPECT_THAT(message, HasSubstr((folder / "3.exr").string()));
    EXPECT_THAT(message, HasSubstr("20 x 10"));
    EXPECT_THAT(message, HasSubstr("16 x 8"));
  }
  // A damaged frame, a bad value and another layout as well.
  std::ofstream(folder / "3.exr") << "nothing";
  sequence.Rewind();
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(sequence.Next(cube));
  EXPECT_THAT(Message([&] { sequence.Next(cube); }), HasSubstr("3.exr"));
  core::Image negative = Frame(3);
  negative.data[5] = -1;
  core::WriteExrImage(folder / "3.exr", negative);
  sequence.Rewind();
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(sequence.Next(cube));
  EXPECT_THAT(Message([&] { sequence.Next(cube); }), HasSubstr("channel R holds -1"));
  core::Image square(8, 8, 3);
  WriteEnvironmentPicture(folder / "3.exr", square, kMirrorBall);
  sequence.Rewind();
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(sequence.Next(cube));
  EXPECT_THAT(Message([&] { sequence.Next(cube); }), HasSubstr("mirror-ball"));
}

TEST(EnvironmentSequence, WhatIsNoSequenceIsRefused) {
  const auto folder = Folder();
  EXPECT_THAT(Message([&] { EnvironmentSequence s(folder); }), HasSubstr("no frames"));
  EXPECT_THAT(Message([&] { EnvironmentSequence s(folder / "absent"); }), HasSubstr("absent"));
  std::ofstream(folder / "list.txt") << "# nothing\n";
  EXPECT_THAT(Message([&] { EnvironmentSequence s(folder / "list.txt"); }), HasSubstr("no frames"));
  std::ofstream(folder / "list.txt") << "\nabsent.exr\n";
  const auto message = Message([&] { EnvironmentSequence s(folder / "list.txt"); });
  EXPECT_THAT(message, HasSubstr("line 2"));
  EXPECT_THAT(message, HasSubstr("absent.exr"));
  core::WriteExrImage(folder / "0.exr", Frame(0));
  EXPECT_THAT(Message([&] { EnvironmentSequence s(folder, {{}, 0, 0}); }), HasSubstr("at least 1"));
  EXPECT_THAT(Message([&] { EnvironmentSequence s(folder, {kCube, 0, 1}); }), HasSubstr("0.exr"));
}

}  // namespace
}  // namespace luxfield::environment
