#include "luxfield/hal/drivers/usbtmc/message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace luxfield::hal::usbtmc {
namespace {

using testing::HasSubstr;

// Recorded from a device by others: dpenkler/linux-usbtmc, issue 8.
TEST(UsbTmcMessage, GoldenVectors) {
  const Bytes query = {0x01, 0x01, 0xfe, 0x00, 0x06, 0x00, 0x00, 0x00, 0x01, 0x00,
                       0x00, 0x00, 0x2a, 0x69, 0x64, 0x6e, 0x3f, 0x0a, 0x00, 0x00};
  EXPECT_EQ(EncodeMessage(1, "*idn?\n"), query);
  const Bytes header = {0x02, 0x02, 0xfd, 0x00, 0x37, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00};
  const ReplyHeader reply = ParseReply(header, 2, 1024);
  EXPECT_EQ(reply.problem, "");
  EXPECT_EQ(reply.size, 0x37u);
  EXPECT_TRUE(reply.end);
}

TEST(UsbTmcMessage, RequestsSayHowMuch) {
  const Bytes request = {0x02, 0xff, 0x00, 0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00};
  EXPECT_EQ(EncodeRequest(255, 1024), request);
  EXPECT_EQ(NextTag(255), 1);
  EXPECT_EQ(NextTag(1), 2);
}

TEST(UsbTmcMessage, WrongRepliesAreNamed) {
  Bytes reply = {0x02, 0x05, 0xfa, 0x00, 0x10, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00};
  EXPECT_EQ(ParseReply(reply, 5, 16).problem, "");
  EXPECT_THAT(ParseReply(reply, 6, 16).problem, HasSubstr("request 5 came for request 6"));
  EXPECT_EQ(ParseReply(reply, 6, 16, true).problem, "");
  EXPECT_THAT(ParseReply(reply, 5, 15).problem, HasSubstr("16 bytes, 15 were asked for"));
  EXPECT_THAT(ParseReply(std::span(reply).first(11), 5, 16).problem, HasSubstr("no header"));
  reply[2] = 0xfb;
  EXPECT_THAT(ParseReply(reply, 5, 16).problem, HasSubstr("contradicts"));
  reply[0] = 3;
  EXPECT_THAT(ParseReply(reply, 5, 16).problem, HasSubstr("message 3"));
}

TEST(UsbTmcMessage, AnyBytesAreParsedWithinTheirBounds) {
  const unsigned seed = 488;
  SCOPED_TRACE(seed);
  std::mt19937 generator(seed);
  for (int trial = 0; trial < 100'000; ++trial) {
    Bytes bytes(generator() % 40);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(generator() % 4 ? generator() : 2);
    const ReplyHeader header = ParseReply(bytes, 2, 64);
    if (header.problem.empty()) {
      ASSERT_LE(header.size, 64u);
    }
  }
}

}  // namespace
}  // namespace luxfield::hal::usbtmc
