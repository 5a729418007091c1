// Radiance pictures: files of other authors against a foreign decoder, files built here byte by
// byte, and what is refused.
#include "luxfield/core/radiance_hdr.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/primaries.h"
#include "luxfield/core/random.h"
#include "tests/seed.h"
#include "tests/test_data.h"

namespace luxfield::core {
namespace {

using testing::HasSubstr;

std::filesystem::path Scratch(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) /
         ("radiance_hdr_" + std::to_string(::getpid()) + "_" + name);
}

class File {
 public:
  explicit File(const std::string& bytes) : path_(Scratch("file.hdr")) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~File() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::string Header(const std::string& resolution, const std::string& lines = "") {
  return "#?RADIANCE\n" + lines + "FORMAT=32-bit_rle_rgbe\n\n" + resolution + "\n";
}

std::string Pixel(int r, int g, int b, int e) {
  return {static_cast<char>(r), static_cast<char>(g), static_cast<char>(b), static_cast<char>(e)};
}

Image Read(const std::string& bytes) { return ReadRadianceHdr(File(bytes).path()); }

std::string Refusal(const std::string& bytes) {
  const File file(bytes);
  try {
    ReadRadianceHdr(file.path());
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(file.path().string()));
    return error.what();
  }
  return "accepted";
}

// Six pixels whose red mantissa numbers them 10, 20 .. 60: a 3 x 2 picture in any scanline order.
std::string SixPixels() {
  std::string pixels;
  for (int k = 1; k <= 6; ++k) pixels += Pixel(10 * k, 128, 255, 129);
  return pixels;
}

int RedMantissa(const Image& image, int row, int column) {
  return static_cast<int>(image.at(0, row, column) * 128);  // exponent 129: (M + 0.5) / 128
}

TEST(RadianceHdr, AValueIsItsMantissaMidwayInItsStep) {
  const Image image = Read(Header("-Y 1 +X 3") + Pixel(0, 128, 255, 129) + Pixel(255, 1, 0, 0) +
                           Pixel(255, 128, 0, 255));
  ASSERT_EQ(image.width, 3);
  ASSERT_EQ(image.channels, 3);
  EXPECT_EQ(image.at(0, 0, 0), 0.5f / 128);
  EXPECT_EQ(image.at(1, 0, 0), 128.5f / 128);
  EXPECT_EQ(image.at(2, 0, 0), 255.5f / 128);
  for (int channel = 0; channel < 3; ++channel) EXPECT_EQ(image.at(channel, 0, 1), 0);
  EXPECT_EQ(image.at(0, 0, 2), std::ldexp(255.5f, 255 - 136));  // 1.7e38
}

TEST(RadianceHdr, EveryScanlineOrderShowsTheSamePicture) {
  // Where the six pixels belong, written out by hand: [row][column] of a picture 3 wide and 2 high.
  const struct {
    const char* resolution;
    int mantissa[2][3];
  } cases[] = {
      {"-Y 2 +X 3", {{10, 20, 30}, {40, 50, 60}}}, {"-Y 2 -X 3", {{30, 20, 10}, {60, 50, 40}}},
      {"+Y 2 +X 3", {{40, 50, 60}, {10, 20, 30}}}, {"+Y 2 -X 3", {{60, 50, 40}, {30, 20, 10}}},
      {"+X 3 -Y 2", {{10, 30, 50}, {20, 40, 60}}}, {"-X 3 -Y 2", {{50, 30, 10}, {60, 40, 20}}},
      {"+X 3 +Y 2", {{20, 40, 60}, {10, 30, 50}}}, {"-X 3 +Y 2", {{60, 40, 20}, {50, 30, 10}}}};
  for (const auto& c : cases) {
    const Image image = Read(Header(c.resolution) + SixPixels());
    ASSERT_EQ(image.width, 3) << c.resolution;
    ASSERT_EQ(image.height, 2) << c.resolution;
    for (int row = 0; row < 2; ++row)
      for (int column = 0; column < 3; ++column)
        EXPECT_EQ(RedMantissa(image, row, column), c.mantissa[row][column])
            << c.resolution << " row " << row << " column " << column;
  }
}

TEST(RadianceHdr, BothRunLengthCodingsAreDecoded) {
  // 300 pixels: one, then 299 repeats as 43 + 256 * 1, the digits of the old coding.
  const Image old = Read(Header("-Y 1 +X 300") + Pixel(200, 100, 50, 130) + Pixel(1, 1, 1, 43) +
                         Pixel(1, 1, 1, 1));
  for (int column = 0; column < 300; ++column) ASSERT_EQ(old.at(1, 0, column), 100.5f / 64);

  // 10 pixels by component: literals for red, a run for the others, the exponent in two pieces. A
  // count of 128 is a literal, so 128 never means a run.
  std::string coded = Pixel(2, 2, 0, 10);
  coded += '\x0a';
  for (int k = 0; k < 10; ++k) coded += static_cast<char>(20 * k);
  coded += std::string("\x8a\x07", 2) + std::string("\x8a\x63", 2);
  coded += std::string("\x84\x80", 2) + std::string("\x86\x81", 2);
  const Image fresh = Read(Header("-Y 1 +X 10") + coded);
  for (int column = 0; column < 10; ++column) {
    const float step = column < 4 ? 1.0f / 256 : 1.0f / 128;
    EXPECT_EQ(fresh.at(0, 0, column), (20 * static_cast<float>(column) + 0.5f) * step);
    EXPECT_EQ(fresh.at(1, 0, column), 7.5f * step);
    EXPECT_EQ(fresh.at(2, 0, column), 99.5f * step);
  }
  // Four bytes for every pixel: nothing is a run, though one pixel looks like it.
  EXPECT_EQ(Read(Header("-Y 1 +X 2") + Pixel(9, 9, 9, 129) + Pixel(1, 1, 1, 129)).at(0, 0, 1),
            1.5f / 128);
  // A flat pixel may begin with 2, 2 where the third byte has its high bit set.
  std::string flat;
  for (int k = 0; k < 10; ++k) flat += Pixel(2, 2, 200, 129);
  EXPECT_EQ(Read(Header("-Y 1 +X 10") + flat).at(2, 0, 9), 200.5f / 128);
}

TEST(RadianceHdr, ExposuresAndCorrectionsMultiplyAndAreUndone) {
  const Image image = Read(Header("-Y 1 +X 1", "EXPOSURE=4\nEXPOSURE= 0.5\nCOLORCORR=1 2 4\n") +
                           Pixel(128, 128, 128, 129));
  EXPECT_FLOAT_EQ(image.at(0, 0, 0), 128.5f / 128 / 2);
  EXPECT_FLOAT_EQ(image.at(1, 0, 0), 128.5f / 128 / 4);
  EXPECT_FLOAT_EQ(image.at(2, 0, 0), 128.5f / 128 / 8);
  EXPECT_THAT(Refusal(Header("-Y 1 +X 1", "EXPOSURE=1e-30\n") + Pixel(128, 128, 128, 255)),
              HasSubstr("EXPOSURE"));
}

TEST(RadianceHdr, WhatIsNotReadIsRefusedByName) {
  const std::string pixel = Pixel(128, 128, 128, 129);
  const auto with = [&](const std::string& line) {
    return Refusal(Header("-Y 1 +X 1", line + "\n") + pixel);
  };
  EXPECT_EQ(with("# a comment"), "accepted");
  EXPECT_EQ(with("VIEW= -vtv -vp 0 0 0"), "accepted");
  EXPECT_EQ(with("GAMMA=1.0"), "accepted");
  EXPECT_EQ(with("PRIMARIES=0 0 0 0 0 0 0 0"), "accepted");
  EXPECT_EQ(with("PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333"), "accepted");
  EXPECT_EQ(with("PRIMARIES=0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290"), "accepted");
  EXPECT_THAT(with("PRIMARIES=0.708 0.292 0.708 0.292 0.131 0.046 0.3127 0.3290"),
              HasSubstr("0.708"));
  EXPECT_THAT(with("PRIMARIES=0.64 0.33"), HasSubstr("8 numbers"));
  EXPECT_THAT(with("GAMMA=2.2"), HasSubstr("GAMMA = 2.2"));
  EXPECT_THAT(with("FORMAT=32-bit_rle_luv"), HasSubstr("32-bit_rle_luv"));
  for (const char* bad : {"0", "-1", "nan", "inf", "one", "", "1e400"})
    EXPECT_THAT(with(std::string("EXPOSURE=") + bad), HasSubstr("EXPOSURE")) << bad;
  EXPECT_THAT(with("COLORCORR=1 1"), HasSubstr("COLORCORR"));
  EXPECT_THAT(Refusal("P6\n1 1\n"), HasSubstr("#?"));
  EXPECT_THAT(Refusal("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"), HasSubstr("header"));
  for (const char* bad : {"", "-Y 1", "-Y 1 +Y 1", "-Z 1 +X 1", "-Y 0 +X 1", "-Y 1 +X -1",
                          "-Y 1 +X 1 +X 1", "Y 1 X 1", "-Y 99999999999 +X 1"})
    EXPECT_THAT(Refusal(Header(bad) + pixel), HasSubstr("resolution line")) << bad;
  EXPECT_THAT(Refusal(Header("-Y 60000 +X 60000") + pixel), HasSubstr("2^27"));
  EXPECT_THAT(Refusal(Header("-Y 8000 +X 8000") + pixel), HasSubstr("claims 8000 x 8000"));
}

TEST(RadianceHdr, BrokenScanlinesAreNamed) {
  const std::string one = Header("-Y 1 +X 10");
  EXPECT_THAT(Refusal(one + Pixel(2, 2, 0, 11)), HasSubstr("says it has 11 pixels"));
  EXPECT_THAT(Refusal(one + Pixel(2, 2, 0, 10) + std::string("\x8b\x01", 2)),
              HasSubstr("leaves it"));
  EXPECT_THAT(Refusal(one + Pixel(2, 2, 0, 10) + std::string("\x00\x01", 2)),
              HasSubstr("no pixels"));
  EXPECT_THAT(Refusal(one + Pixel(2, 2, 0, 10) + std::string("\x0a\x01", 2)),
              HasSubstr("cut short"));
  EXPECT_THAT(Refusal(one + Pixel(1, 1, 1, 5)), HasSubstr("before its first"));
  EXPECT_THAT(Refusal(one + Pixel(9, 9, 9, 9) + Pixel(1, 1, 1, 10)), HasSubstr("leaves it"));
  EXPECT_THAT(Refusal(one + Pixel(9, 9, 9, 9)), HasSubstr("scanline 0"));
}

// ---- files of other authors -------------------------------------------------------------------

TEST(RadianceHdr, OneAuthorsHdrAndExrOfTheSameGradientAgree) {
  const auto hdr = testdata::Folder() / "hdr_formats/reference_gradient.hdr";
  LUXFIELD_NEEDS_DATA(hdr);
  const Image a = ReadRadianceHdr(hdr);
  const Image b = ReadExrImage(testdata::Folder() / "hdr_formats/reference_gradient.exr");
  ASSERT_EQ(a.width, 512);
  ASSERT_EQ(a.height, 512);
  ASSERT_EQ(b.data.size(), a.data.size());
  double worst = 0, sum_a = 0, sum_b = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    worst = std::max<double>(worst, std::abs(a.data[i] - b.data[i]));
    sum_a += a.data[i];
    sum_b += b.data[i];
  }
  // The writer stores every pixel with exponent 128, in steps of 1/256 (and dark ones as (1, 1, 1,
  // 128), which is no run); the EXR is HALF, 2^-12 below 1. A decoder without the half step is 0.4
  // % low.
  EXPECT_LT(worst, 1.0 / 256 + 0x1p-12);
  EXPECT_NEAR(sum_a / sum_b, 1, 1e-3);
}

// A scanline of a known file, decoded from its bytes here: the header ends where its text says, and
// the first scanline is coded by component.
TEST(RadianceHdr, TheFirstScanlineOfAKnownFileIsItsBytes) {
  const auto path = testdata::Folder() / "env/pmndrs__sky.hdr";
  LUXFIELD_NEEDS_DATA(path);
  const std::string bytes = ReadFile(path);
  const std::string text = "-Y 512 +X 1024\n";
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes.at(at)); };
  std::size_t at = bytes.find(text) + text.size();
  ASSERT_EQ(bytes.substr(at, 4), std::string("\x02\x02\x04\x00", 4));
  at += 4;
  std::vector<int> component[4];
  for (auto& values : component)
    while (values.size() < 1024) {
      const int count = byte(at++);
      if (count > 128)
        values.insert(values.end(), count - 128, byte(at++));
      else
        for (int k = 0; k < count; ++k) values.push_back(byte(at++));
    }
  const Image image = ReadRadianceHdr(path);
  ASSERT_EQ(image.width, 1024);
  ASSERT_EQ(image.height, 512);
  for (int column = 0; column < 1024; ++column)
    for (int channel = 0; channel < 3; ++channel)
      ASSERT_EQ(image.at(channel, 0, column),
                (component[channel][column] + 0.5) * std::pow(2.0, component[3][column] - 136));
}

TEST(RadianceHdr, MutatedAndTruncatedFilesEndInAPictureOrAnInputError) {
  Random random(TestSeed(61), 0);
  std::string whole = Header("-Y 12 +X 40", "EXPOSURE=2\nPRIMARIES=0 0 0 0 0 0 0 0\n");
  for (int row = 0; row < 12; ++row) {
    if (row % 2) {
      for (int column = 0; column < 40; ++column)
        whole += Pixel(random() % 200 + 10, random() % 256, random() % 256, 120 + random() % 20);
    } else {
      whole += Pixel(2, 2, 0, 40);
      for (int component = 0; component < 4; ++component) {
        whole += static_cast<char>(128 + 30);
        whole += static_cast<char>(130);
        whole += static_cast<char>(10);
        for (int k = 0; k < 10; ++k) whole += static_cast<char>(random());
      }
    }
  }
  ASSERT_EQ(Refusal(whole), "accepted");
  for (std::size_t length = 0; length < whole.size(); length += 7)
    EXPECT_NE(Refusal(whole.substr(0, length)), "accepted") << length;
  EXPECT_NE(Refusal(whole.substr(0, whole.size() - 1)), "accepted");
  int refused = 0;
  for (int k = 0; k < 1500; ++k) {
    std::string bytes = whole;
    for (int hit = 0; hit < 1 + static_cast<int>(random() % 4); ++hit)
      bytes[random() % (k % 2 ? bytes.size() : 110)] = static_cast<char>(random());
    refused += Refusal(bytes) != "accepted";
  }
  EXPECT_GT(refused, 300);
  EXPECT_LT(refused, 1500);
}

// ---- other colour spaces ------------------------------------------------------------------------

TEST(RadianceHdr, TristimulusValuesBecomeRec709) {
  // Mantissas of the largest step so that truncation stays below 1/400; exponent 136 is 2^8 / 256.
  const auto read = [](int x, int y, int z) {
    return Read("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n" + Pixel(x, y, z, 136));
  };
  // The D65 white (0.9505, 1, 1.0891) is grey; the matrix of IEC 61966-2-1 by hand for another.
  const Image white = read(209, 220, 239);  // with the half step 209.5 : 220.5 : 239.5
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(white.data[c], 220.5, 1.5);
  const Image colour = read(120, 110, 60);
  EXPECT_NEAR(colour.data[0], 3.2406 * 120.5 - 1.5372 * 110.5 - 0.4986 * 60.5, 0.05);
  EXPECT_NEAR(colour.data[1], -0.9689 * 120.5 + 1.8758 * 110.5 + 0.0415 * 60.5, 0.05);
  EXPECT_NEAR(colour.data[2], 0.0557 * 120.5 - 0.2040 * 110.5 + 1.0570 * 60.5, 0.05);
  // A spectral green is outside of Rec. 709: nothing negative, Y kept.
  const Image green = read(20, 200, 10);
  EXPECT_GE(*std::min_element(green.data.begin(), green.data.end()), 0);
  EXPECT_NEAR(0.2126 * green.data[0] + 0.7152 * green.data[1] + 0.0722 * green.data[2], 200.5, 0.1);
}

TEST(RadianceHdr, OtherPrimariesBecomeRec709) {
  const auto read = [](int r, int g, int b) {
    return Read(
        Header("-Y 1 +X 1", "PRIMARIES=0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290\n") +
        Pixel(r, g, b, 136));
  };
  const Image white = read(100, 100, 100);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(white.data[c], 100.5, 1e-3);
  const Image colour = read(120, 110, 90);  // the matrix of ITU-R BT.2087
  EXPECT_NEAR(colour.data[0], 1.6605 * 120.5 - 0.5876 * 110.5 - 0.0728 * 90.5, 0.05);
  EXPECT_NEAR(colour.data[1], -0.1246 * 120.5 + 1.1329 * 110.5 - 0.0083 * 90.5, 0.05);
  EXPECT_NEAR(colour.data[2], -0.0182 * 120.5 - 0.1006 * 110.5 + 1.1187 * 90.5, 0.05);
}

// What is said of a file's colours; and Radiance's weights against those that its primaries give
// (they are rounded to three places).
TEST(RadianceHdr, TellsWhatItsColoursAre) {
  const auto primaries = [](const std::string& line) {
    return ReadHdrPrimaries(File(Header("-Y 1 +X 1", line) + Pixel(1, 2, 3, 128)).path());
  };
  EXPECT_EQ(primaries(""), HdrPrimaries::kUnstated);
  EXPECT_EQ(primaries("PRIMARIES=0 0 0 0 0 0 0 0\n"), HdrPrimaries::kUnstated);
  EXPECT_EQ(primaries("PRIMARIES=0.64 0.33 0.30 0.60 0.15 0.06 0.3127 0.3290\n"),
            HdrPrimaries::kAsRec709);
  EXPECT_EQ(primaries("PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n"),
            HdrPrimaries::kAsRadiance);
  EXPECT_EQ(primaries("PRIMARIES=0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290\n"),
            HdrPrimaries::kOther);
  EXPECT_EQ(
      ReadHdrPrimaries(
          File("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n" + Pixel(1, 2, 3, 128)).path()),
      HdrPrimaries::kXyz);
  const auto xyz = XyzFromRgb({{0.64, 0.33}, {0.29, 0.60}, {0.15, 0.06}, {1 / 3.0, 1 / 3.0}});
  for (std::size_t c = 0; c < 3; ++c) {
    Rgb unit{};
    unit[c] = 1;
    EXPECT_NEAR(RadianceLuminance(unit), xyz[1][c], 5e-4) << c;
  }
}

// ---- writing ----------------------------------------------------------------------------------

TEST(WriteRadianceHdr, ComesBackWithinItsStep) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed, 0);
  Image image(37, 19, 3);
  for (float& value : image.data)
    value = static_cast<float>(std::pow(10.0, -20 + 50 * random.Uniform()));
  for (int c = 0; c < 3; ++c) image.at(c, 3, 4) = 0;
  image.at(0, 5, 6) = 0x1.fffffep126f, image.at(1, 5, 6) = 1, image.at(2, 5, 6) = 0;
  const auto path = Scratch("written.hdr");
  WriteRadianceHdr(path, image, {"a comment"});
  const Image back = ReadRadianceHdr(path);
  ASSERT_EQ(back.width, 37);
  ASSERT_EQ(back.height, 19);
  double bias = 0;
  for (int row = 0; row < 19; ++row)
    for (int column = 0; column < 37; ++column) {
      const float largest =
          std::max({image.at(0, row, column), image.at(1, row, column), image.at(2, row, column)});
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(back.at(c, row, column), image.at(c, row, column), largest / 256);
        if (image.at(c, row, column) == largest && largest > 0)
          bias += (back.at(c, row, column) / largest - 1) / (37 * 19);
      }
    }
  EXPECT_NEAR(bias, 0, 4 * 0.0017 / std::sqrt(37 * 19));  // a step of 1/256 to 1/128 even over it
  EXPECT_EQ(back.at(0, 3, 4), 0);
  EXPECT_NE(ReadFile(path).find("# a comment\n"), std::string::npos);
  std::filesystem::remove(path);
}

TEST(WriteRadianceHdr, RefusesWhatTheFormatHasNoPlaceFor) {
  for (const float bad : {-1e-9f, NAN, INFINITY, 0x1p127f}) {
    Image image(1, 1, 1);
    image.data[0] = bad;
    EXPECT_THROW(WriteRadianceHdr(Scratch("never.hdr"), image), InputError) << bad;
    EXPECT_FALSE(std::filesystem::exists(Scratch("never.hdr")));
  }
}

}  // namespace
}  // namespace luxfield::core
