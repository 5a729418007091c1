#include "hal/gphoto2/raw_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <random>

#include "core/file.h"
#include "hal/error.h"
#include "hal/gphoto2/shutter_speed.h"
#include "tests/fakes/dng.h"

namespace luxfield::hal::gphoto2 {
namespace {

std::optional<Fault> FaultOf(const std::string& bytes) {
  try {
    DecodeRawFile(bytes, "camera");
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
}

TEST(RawFile, HoldsTheSensorsNumbersOfEveryMosaic) {
  for (const char* cfa : {"RGGB", "BGGR", "GRBG", "GBRG", ""}) {
    fakes::Negative negative{26, 24, {}, cfa, 1.0 / 80};
    std::mt19937 random(17);
    for (int k = 0; k < negative.width * negative.height; ++k)
      negative.dn.push_back(static_cast<std::uint16_t>(random()));
    const RawFile raw = DecodeRawFile(fakes::EncodeDng(negative), "camera");
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

// A foreign camera's file, written by software that is not ours.
TEST(RawFile, ReadsAForeignNegative) {
  const char* folder = std::getenv("LUXFIELD_TEST_DATA");
  const std::filesystem::path path =
      std::filesystem::path(folder ? folder : "../shared/data") / "raw/colorchart.dng";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is absent";
  const RawFile raw = DecodeRawFile(core::ReadFile(path), "camera");
  std::cout << raw.image.width << " x " << raw.image.height << ", " << raw.cfa << ", "
            << raw.exposure_s << " s\n";
  EXPECT_GT(raw.image.width, 100);
}

}  // namespace
}  // namespace luxfield::hal::gphoto2
