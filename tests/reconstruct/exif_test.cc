// Exif written by the test from the standards' tables (TIFF 6.0, section 2; Exif 2.3, 4.6), in both
// byte orders and every type of number that cameras use.
#include "luxfield/reconstruct/calibrate/response/exif.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

namespace luxfield::reconstruct {
namespace {

class Tiff {
 public:
  explicit Tiff(bool big_endian) : big_endian_(big_endian) {
    bytes_ = big_endian ? "MM" : "II";
    Add(42, 2);
    Add(8, 4);
  }
  void Add(std::uint32_t value, int size) {
    for (int k = 0; k < size; ++k)
      bytes_ += static_cast<char>(value >> 8 * (big_endian_ ? size - 1 - k : k));
  }
  void Entry(std::uint32_t tag, std::uint32_t type, std::uint32_t value) {
    Add(tag, 2);
    Add(type, 2);
    Add(1, 4);
    const int size = type == 3 ? 2 : 4;
    Add(value, size);
    bytes_.append(static_cast<std::size_t>(4 - size), '\xAA');  // what follows a SHORT is any
  }
  std::size_t size() const { return bytes_.size(); }
  const std::string& bytes() const { return bytes_; }

 private:
  bool big_endian_;
  std::string bytes_;
};

// 1/250 s at f/2.8 and this sensitivity, as a SHORT or a LONG.
std::string Exposure(bool big_endian, std::uint32_t iso, std::uint32_t type) {
  Tiff tiff(big_endian);
  tiff.Add(1, 2);
  tiff.Entry(0x8769, 4, 26);  // the Exif directory, behind this one and its link
  tiff.Add(0, 4);
  EXPECT_EQ(tiff.size(), 26u);
  tiff.Add(3, 2);
  tiff.Entry(0x829A, 5, 68);
  tiff.Entry(0x829D, 5, 76);
  tiff.Entry(0x8827, type, iso);
  tiff.Add(0, 4);
  EXPECT_EQ(tiff.size(), 68u);
  for (const std::uint32_t number : {1, 250, 28, 10}) tiff.Add(number, 4);
  return tiff.bytes();
}

TEST(Exif, EveryTypeInBothByteOrders) {
  for (const bool big_endian : {false, true})
    for (const auto& [iso, type] : {std::pair{800u, 3u}, std::pair{204800u, 4u}}) {
      const ExifExposure exif = ReadExif(Exposure(big_endian, iso, type));
      EXPECT_EQ(exif.exposure_s, 1.0 / 250) << big_endian;
      EXPECT_EQ(exif.f_number, 2.8) << big_endian;
      EXPECT_EQ(exif.iso, iso) << big_endian << ' ' << type;
    }
}

// Other segments come before it: JFIF's, and one that is called alike.
TEST(Exif, IsFoundBehindOtherSegments) {
  const std::string tiff = Exposure(true, 800, 3);
  const auto segment = [](char marker, const std::string& data) {
    const std::size_t size = data.size() + 2;
    return std::string{'\xFF', marker, static_cast<char>(size >> 8), static_cast<char>(size)} +
           data;
  };
  const std::string exif = segment('\xE1', std::string("Exif\0\0", 6) + tiff);
  const std::string jfif = segment('\xE0', std::string("JFIF\0\1\1\0\0\1\0\1\0\0", 14));
  const std::string xmp = segment('\xE1', "http://ns.adobe.com/xap/1.0/");
  for (const std::string& before : {std::string(), jfif, xmp, jfif + xmp})
    EXPECT_EQ(ReadExif("\xFF\xD8" + before + exif + "\xFF\xDA").iso, 800);
  EXPECT_FALSE(ReadExif("\xFF\xD8" + jfif + "\xFF\xDA" + exif).iso) << "behind the picture";
}

}  // namespace
}  // namespace luxfield::reconstruct
