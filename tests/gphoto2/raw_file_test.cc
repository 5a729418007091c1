#include "luxfield/hal/drivers/gphoto2/raw_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "luxfield/core/file.h"
#include "luxfield/hal/drivers/gphoto2/shutter_speed.h"
#include "luxfield/hal/error.h"
#include "tests/fakes/dng.h"
#include "tests/fuzz/seeded.h"
#include "tests/fuzz/shutter_speeds.h"
#include "tests/fuzz/still_camera_file.h"
#include "tests/test_data.h"

namespace luxfield::hal::gphoto2 {
namespace {

constexpr std::size_t kMostPixels = 1 << 24;

std::optional<Fault> FaultOf(const std::string& bytes, std::size_t most_pixels = kMostPixels) {
  try {
    DecodeRawFile(bytes, "camera", most_pixels);
  } catch (const HardwareError& error) {
    return error.fault;
  }
  return {};
}

TEST(ShutterSpeed, IsReadAsCamerasWriteIt) {
  EXPECT_EQ(ParseShutterSpeed("1/60"), 1.0 / 60);
  EXPECT_EQ(ParseShutterSpeed("0.3"), 0.3);
  EXPECT_EQ(ParseShutterSpeed("30"), 30);
  EXPECT_EQ(ParseShutterSpeed("0.0166s"), 0.0166);
  EXPECT_EQ(ParseShutterSpeed("2\""), 2);
  for (const char* text : {"", "bulb", "Auto", "1/", "1/0", "/60", "-1", "0", "x 1/250", "1/60 x",
                           "nan", "inf", "1e400"})
    EXPECT_FALSE(ParseShutterSpeed(text)) << text;
  const std::string huge(300, '9'), tiny = "0." + std::string(200, '0') + "1";
  EXPECT_FALSE(ParseShutterSpeed(huge + "/" + tiny)) << "too long to be a number of seconds";
  EXPECT_FALSE(ParseShutterSpeed(tiny + "/" + huge)) << "too short";
}

TEST(ShutterSpeed, ListsHoldEachOnceFromTheShortest) {
  const auto speeds = ShutterSpeeds({"bulb", "2", "0.5", "1/2", "1/60", "Auto"});
  ASSERT_EQ(speeds.size(), 3u);
  EXPECT_EQ(speeds[0].text, "1/60");
  EXPECT_EQ(speeds[1].text, "0.5");
  EXPECT_EQ(speeds[2].exposure_s, 2);
}

TEST(ShutterSpeed, ListsSurviveASampleOfFuzzing) {
  fuzz::Seeded(fuzz::ShutterSpeedList, {"1/60\n0.3\n30\n0.0166s\n2\"\nbulb\n", "1/8000\n1/2.5"});
}

TEST(RawFile, HoldsTheSensorsNumbersOfEveryMosaic) {
  for (const char* cfa : {"RGGB", "BGGR", "GRBG", "GBRG", ""}) {
    fakes::Negative negative{26, 24, {}, cfa, 1.0 / 80};
    std::mt19937 random(17);
    for (int k = 0; k < negative.width * negative.height; ++k)
      negative.dn.push_back(static_cast<std::uint16_t>(random()));
    const RawFile raw = DecodeRawFile(fakes::EncodeDng(negative), "camera", kMostPixels);
    EXPECT_EQ(raw.image.width, negative.width) << cfa;
    EXPECT_EQ(raw.image.height, negative.height);
    EXPECT_EQ(raw.image.dn, negative.dn);
    EXPECT_EQ(raw.cfa, cfa);
    EXPECT_NEAR(raw.exposure_s, 1.0 / 80, 1e-6);
  }
}

TEST(RawFile, DamagedAndForeignFilesAreRefused) {
  fakes::Negative negative{26, 24, std::vector<std::uint16_t>(26 * 24, 900), "RGGB", 0.1};
  const std::string whole = fakes::EncodeDng(negative);
  EXPECT_EQ(FaultOf(whole.substr(0, whole.size() - 40)), Fault::kIncomplete);
  EXPECT_EQ(FaultOf("\xff\xd8\xff\xe0" + std::string(5000, 'x')), Fault::kProtocol);
  EXPECT_TRUE(FaultOf(""));
}

TEST(RawFile, MoreThanTheLabsPixelsAreRefused) {
  const fakes::Negative negative{26, 24, std::vector<std::uint16_t>(26 * 24, 900), "RGGB", 0.1};
  EXPECT_FALSE(FaultOf(fakes::EncodeDng(negative), 26 * 24));
  EXPECT_EQ(FaultOf(fakes::EncodeDng(negative), 26 * 24 - 1), Fault::kProtocol);
}

TEST(RawFile, SurvivesASampleOfFuzzing) {
  std::vector<std::string> files;
  for (const char* cfa : {"RGGB", ""})
    files.push_back(fakes::EncodeDng({26, 24, std::vector<std::uint16_t>(26 * 24, 900), cfa, 0.1}));
  fuzz::Seeded(fuzz::StillCameraFile, files, 1000);
}

TEST(RawFile, WhatLibRawMakesOfOneSurvivesASampleOfFuzzing) {
  // 20 x 10 pixels from (3, 2) of 24 x 12, 48 bytes a row, and a mosaic of Bayer's.
  const std::string found("\x14\0\x0a\0\x03\0\x02\0\x18\0\x0c\0\x30\0\0\0\x94\x94\x94\x94RGBG\0",
                          25);
  fuzz::Seeded(fuzz::StillCameraPicture, {found});
}

// A foreign camera's file, written by software that is not ours.
TEST(RawFile, ReadsAForeignNegative) {
  const std::filesystem::path path = testdata::Folder() / "raw/colorchart.dng";
  LUXFIELD_NEEDS_DATA(path);
  const RawFile raw = DecodeRawFile(core::ReadFile(path), "camera", kMostPixels);
  std::cout << raw.image.width << " x " << raw.image.height << ", " << raw.cfa << ", "
            << raw.exposure_s << " s\n";
  EXPECT_GT(raw.image.width, 100);
}

}  // namespace
}  // namespace luxfield::hal::gphoto2
