#include "luxfield/hal/drivers/aravis/pixel_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/error.h"

namespace luxfield::hal::aravis {
namespace {

using testing::ElementsAre;
using Bytes = std::vector<std::uint8_t>;

TEST(PixelFormat, WordsAreLittleEndianAndPaddingIsSkipped) {
  const Bytes bytes = {0x34, 0x12, 0xff, 0xff, 9, 9, 0x00, 0x80, 0x01, 0x00};
  const auto frame = Unpack(*FindPixelFormat("Mono16"), bytes, 2, 2, 6);
  EXPECT_THAT(frame.dn, ElementsAre(0x1234, 0xffff, 0x8000, 1));
}

// GigE Vision 2.0, figure of Mono12Packed: byte 0 and byte 2 hold bits 11 to 4 of pixels 0 and 1,
// byte 1 their bits 3 to 0, pixel 0's in the low nibble. PFNC 2.4, Mono12p: the first pixel's bit 0
// is bit 0 of byte 0.
TEST(PixelFormat, BothPackingsOfTwelveBits) {
  const Bytes packed = {0xab, 0x6c, 0x45};  // 0xabc, 0x456
  EXPECT_THAT(Unpack(*FindPixelFormat("Mono12Packed"), packed, 2, 1, 3).dn,
              ElementsAre(0xabc, 0x456));
  const Bytes lsb = {0xbc, 0x6a, 0x45};  // 0xabc, 0x456
  EXPECT_THAT(Unpack(*FindPixelFormat("Mono12p"), lsb, 2, 1, 3).dn, ElementsAre(0xabc, 0x456));
}

TEST(PixelFormat, RowsOfOddWidthEndInWholeBytes) {
  const PixelFormat format = *FindPixelFormat("Mono12p");
  EXPECT_EQ(BytesPerRow(format, 3), 5u);
  const Bytes bytes = {0xbc, 0x6a, 0x45, 0x23, 0x01};
  EXPECT_THAT(Unpack(format, bytes, 3, 1, 5).dn, ElementsAre(0xabc, 0x456, 0x123));
}

TEST(PixelFormat, ShortFramesAreRefused) {
  const Bytes bytes(7);
  EXPECT_THROW(Unpack(*FindPixelFormat("Mono16"), bytes, 2, 2, 4), InputError);
  EXPECT_THROW(Unpack(*FindPixelFormat("Mono8"), bytes, 4, 2, 3), InputError);
  EXPECT_NO_THROW(Unpack(*FindPixelFormat("Mono8"), bytes, 3, 2, 4));
}

TEST(PixelFormat, ColourImagesAreNotRead) {
  EXPECT_FALSE(FindPixelFormat("RGB8Packed"));
  EXPECT_TRUE(FindPixelFormat("BayerRG12"));
}

}  // namespace
}  // namespace luxfield::hal::aravis
