// The filter in the kernel, on a socket of the loopback interface.
#include "luxfield/hal/drivers/aravis/stream_filter.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <system_error>

namespace luxfield::hal::aravis {
namespace {

enum Content { kLeader = 1, kTrailer = 2, kPayload = 3, kAllIn = 4, kMultipart = 7 };

class StreamFilter : public testing::TestWithParam<bool> {
 protected:
  static constexpr std::uint32_t kPacketSize = 148, kFrame = 250;

  StreamFilter() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    bind(receiver_, reinterpret_cast<sockaddr*>(&address), size);
    getsockname(receiver_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    connect(sender_, reinterpret_cast<sockaddr*>(&address), size);
  }
  ~StreamFilter() override {
    close(sender_);
    close(receiver_);
  }
  void Attach(std::uint32_t camera = INADDR_LOOPBACK) {
    AttachToPort(port_, FrameFilter({camera, kPacketSize, kFrame}));
  }

  // Numbers of 64 bits, or of 16.
  bool extended() const { return GetParam(); }
  std::size_t head() const { return extended() ? 20 : 8; }
  std::size_t block() const { return kPacketSize - 28 - head(); }
  unsigned blocks() const { return static_cast<unsigned>((kFrame + block() - 1) / block()); }
  std::size_t last_block() const { return kFrame - (blocks() - 1) * block(); }

  // A packet with so many bytes of data (fewer than none: the header's end is missing).
  std::string Packet(Content content, unsigned number, long data, int payload_type = 1) const {
    std::string bytes(std::max<std::size_t>(head() + 64, head() + data), '\0');
    bytes[3] = 7;  // the frame
    const std::size_t number_at = extended() ? 16 : 4;
    for (std::size_t k = 1; k < 4; ++k)
      bytes[number_at + k] = static_cast<char>(number >> 8 * (3 - k));
    bytes[4] = static_cast<char>(content | (extended() ? 0x80 : 0));
    bytes[head() + 2] = static_cast<char>(payload_type >> 8);
    bytes[head() + 3] = static_cast<char>(payload_type);
    return bytes.substr(0, head() + data);
  }
  bool Passes(const std::string& bytes) const {
    send(sender_, bytes.data(), bytes.size(), 0);  // is there when this returns
    std::string came(70000, '\0');
    return recv(receiver_, came.data(), came.size(), MSG_DONTWAIT) >= 0;
  }

  int receiver_ = socket(AF_INET, SOCK_DGRAM, 0), sender_ = socket(AF_INET, SOCK_DGRAM, 0);
  std::uint16_t port_ = 0;
};

TEST_P(StreamFilter, PacketsOfAFramePass) {
  Attach();
  for (const int type : {1, 5, 0x4001}) EXPECT_TRUE(Passes(Packet(kLeader, 0, 36, type))) << type;
  for (unsigned n = 1; n < blocks(); ++n)
    EXPECT_TRUE(Passes(Packet(kPayload, n, static_cast<long>(block())))) << n;
  const auto last = static_cast<long>(last_block());
  EXPECT_TRUE(Passes(Packet(kPayload, blocks(), last)));
  EXPECT_TRUE(Passes(Packet(kPayload, blocks(), static_cast<long>(block())))) << "filled up";
  EXPECT_TRUE(Passes(Packet(kTrailer, blocks() + 1, 8)));
}

TEST_P(StreamFilter, NothingElseDoes) {
  Attach();
  const auto full = static_cast<long>(block()), last = static_cast<long>(last_block());
  for (long data = -static_cast<long>(head()); data < full; ++data) {
    EXPECT_FALSE(Passes(Packet(kPayload, 1, data))) << data;
    if (data < last) {
      EXPECT_FALSE(Passes(Packet(kPayload, blocks(), data))) << data;
    }
    if (data < 36) {
      EXPECT_FALSE(Passes(Packet(kLeader, 0, data))) << data;
    }
    if (data < 8) {
      EXPECT_FALSE(Passes(Packet(kTrailer, blocks() + 1, data))) << data;
    }
  }
  EXPECT_FALSE(Passes(Packet(kPayload, 1, full + 1)));
  EXPECT_FALSE(Passes(Packet(kPayload, 0, full)));
  EXPECT_FALSE(Passes(Packet(kPayload, blocks() + 1, full)));
  EXPECT_FALSE(Passes(Packet(kPayload, 1 << 16, full)));
  EXPECT_FALSE(Passes(Packet(kLeader, 1, 36)));
  EXPECT_FALSE(Passes(Packet(kLeader, 0, 36, 10))) << "of several parts";
  EXPECT_FALSE(Passes(Packet(kTrailer, blocks(), 8)));
  EXPECT_FALSE(Passes(Packet(kTrailer, 0, 8)));
  for (const Content other : {kAllIn, kMultipart, Content(0)})
    EXPECT_FALSE(Passes(Packet(other, 1, full))) << other;
}

TEST_P(StreamFilter, OnlyFromTheCamera) {
  Attach(INADDR_LOOPBACK + 1);
  EXPECT_FALSE(Passes(Packet(kLeader, 0, 36)));
}

TEST_P(StreamFilter, APortThatIsNotOursIsNamed) {
  close(receiver_);
  EXPECT_THROW(Attach(), std::system_error);
}

INSTANTIATE_TEST_SUITE_P(Numbers, StreamFilter, testing::Bool(),
                         [](const auto& test) { return test.param ? "Of64Bits" : "Of16Bits"; });

}  // namespace
}  // namespace luxfield::hal::aravis
