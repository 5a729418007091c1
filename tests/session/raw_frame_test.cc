#include "luxfield/session/raw_frame.h"

#include <gtest/gtest.h>

#include "luxfield/core/error.h"
#include "luxfield/core/sha256.h"
#include "tests/session/small_session.h"

namespace luxfield::session {
namespace {

TEST(RawFrame, TiffKeepsEveryBit) {
  RawFrame whole = TestFrame(3, 1), real;
  whole.dn[0] = 65535;
  real.width = 2;
  real.height = 1;
  real.value = {1e-30f, -3.25f};
  EXPECT_EQ(DecodeTiff(EncodeTiff(whole), "t").dn, whole.dn);
  EXPECT_EQ(DecodeTiff(EncodeTiff(real), "t").value, real.value);
  EXPECT_EQ(EncodeTiff(whole), EncodeTiff(whole));
}

TEST(RawFrame, ATiffIsWholeBlocksAndThenThePixelsOfMemory) {
  RawFrame frame = TestFrame(3, 1);
  EXPECT_EQ(TiffHead(frame).size() % core::kSha256Block, 0u);
  EXPECT_EQ(PixelBytes(frame).data(), reinterpret_cast<const char*>(frame.dn.data()));
  EXPECT_EQ(PixelBytes(frame).size(), 2 * frame.size());
  frame.dn.pop_back();
  EXPECT_THROW(TiffHead(frame), DeviceError);
}

TEST(RawFrame, NoTruncationOfATiffIsRead) {
  const std::string bytes = EncodeTiff(TestFrame(1, 0));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(DecodeTiff(std::string_view(bytes).substr(0, size), "t.tif"), InputError) << size;
}

TEST(RawFrame, FlippedBytesOfATiffNeverCrash) {
  const std::string bytes = EncodeTiff(TestFrame(1, 0));
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (const int bit : {0, 3, 7}) {
      std::string bad = bytes;
      bad[at] = static_cast<char>(bad[at] ^ (1 << bit));
      try {
        const RawFrame frame = DecodeTiff(bad, "t.tif");
        EXPECT_EQ(frame.dn.size() + frame.value.size(), frame.size());
      } catch (const InputError&) {
      }
    }
}

}  // namespace
}  // namespace luxfield::session
