// The bytes of the tev protocol, taken apart by a server written from the protocol's description.
#include "luxfield/render/film/display.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <thread>

#include "luxfield/core/error.h"

namespace luxfield::render {
namespace {

// Listens on a free port of 127.0.0.1, takes one connection and keeps all its bytes.
class Server {
 public:
  Server() : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        ::listen(listener_, 1) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no port for the test");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] {
      const int connection = ::accept(listener_, nullptr, nullptr);
      char block[65536];
      for (ssize_t count; (count = ::read(connection, block, sizeof block)) > 0;)
        bytes_.append(block, static_cast<std::size_t>(count));
      ::close(connection);
    });
  }
  ~Server() {
    if (thread_.joinable()) thread_.join();
    ::close(listener_);
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  const std::string& Bytes() {  // waits until the client is gone
    thread_.join();
    return bytes_;
  }

 private:
  int listener_;
  int port_ = 0;
  std::thread thread_;
  std::string bytes_;
};

class Parser {
 public:
  explicit Parser(const std::string& bytes) : bytes_(bytes) {}
  bool AtEnd() const { return at_ == bytes_.size(); }
  std::size_t at() const { return at_; }
  template <typename T>
  T Get() {
    T value{};
    if (at_ + sizeof value > bytes_.size()) throw std::runtime_error("packet too short");
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string GetText() {
    const std::string text = bytes_.c_str() + at_;
    at_ += text.size() + 1;
    return text;
  }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

TEST(Display, SendsCreateAndUpdatePackets) {
  // 700 x 200 x 3 floats are 1.6 MiB: two packets.
  core::Image image(700, 200, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i) * 0.5f;
  Server server;
  { Display(server.address()).Show("street", image); }
  Parser parser(server.Bytes());

  const auto create_length = parser.Get<std::uint32_t>();
  EXPECT_EQ(parser.Get<std::uint8_t>(), 4);
  EXPECT_EQ(parser.Get<std::uint8_t>(), 1);
  EXPECT_EQ(parser.GetText(), "street");
  EXPECT_EQ(parser.Get<std::int32_t>(), 700);
  EXPECT_EQ(parser.Get<std::int32_t>(), 200);
  EXPECT_EQ(parser.Get<std::int32_t>(), 3);
  for (const char* channel : {"R", "G", "B"}) EXPECT_EQ(parser.GetText(), channel);
  EXPECT_EQ(parser.at(), create_length);

  int next_row = 0, packets = 0;
  while (!parser.AtEnd()) {
    ++packets;
    const std::size_t start = parser.at();
    const auto length = parser.Get<std::uint32_t>();
    EXPECT_LE(length, (1u << 20) + 256);
    EXPECT_EQ(parser.Get<std::uint8_t>(), 6);
    EXPECT_EQ(parser.Get<std::uint8_t>(), 0);
    EXPECT_EQ(parser.GetText(), "street");
    ASSERT_EQ(parser.Get<std::int32_t>(), 3);
    for (const char* channel : {"R", "G", "B"}) EXPECT_EQ(parser.GetText(), channel);
    EXPECT_EQ(parser.Get<std::int32_t>(), 0);
    ASSERT_EQ(parser.Get<std::int32_t>(), next_row);
    EXPECT_EQ(parser.Get<std::int32_t>(), 700);
    const auto rows = parser.Get<std::int32_t>();
    std::int64_t offset[3], stride[3];
    for (auto& value : offset) value = parser.Get<std::int64_t>();
    for (auto& value : stride) value = parser.Get<std::int64_t>();
    std::vector<float> data(static_cast<std::size_t>(rows) * 700 * 3);
    for (auto& value : data) value = parser.Get<float>();
    for (int c = 0; c < 3; ++c)
      for (std::int64_t i = 0; i < rows * 700; ++i)
        ASSERT_EQ(data[static_cast<std::size_t>(offset[c] + i * stride[c])],
                  image.at(c, next_row + static_cast<int>(i / 700), static_cast<int>(i % 700)));
    EXPECT_EQ(parser.at() - start, length);
    next_row += rows;
  }
  EXPECT_EQ(next_row, 200);
  EXPECT_EQ(packets, 2);
}

// A display that hangs up before it has read the picture.
TEST(Display, OneThatStopsListeningIsNamed) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&at), size), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  ASSERT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&at), &size), 0);
  Display display("127.0.0.1:" + std::to_string(ntohs(at.sin_port)));
  ::close(::accept(listener, nullptr, nullptr));
  ::close(listener);
  const core::Image image(64, 64, 3);
  const auto send = [&] {
    for (int k = 0; k < 1000; ++k) display.Update("street", image, 0, 64);
  };
  EXPECT_THAT(send, testing::ThrowsMessage<DeviceError>(testing::HasSubstr("stopped listening")));
}

TEST(Display, SendsOneChannelAsYAndPartsOfPictures) {
  core::Image image(3, 5, 1);
  image.at(0, 3, 2) = 7;
  Server server;
  {
    Display display(server.address());
    display.Update("y", image, 3, 1);
  }
  Parser parser(server.Bytes());
  EXPECT_EQ(parser.Get<std::uint32_t>(), 4u + 1 + 1 + 2 + 4 + 2 + 16 + 8 + 8 + 12);
  parser.Get<std::uint16_t>();
  parser.GetText();
  EXPECT_EQ(parser.Get<std::int32_t>(), 1);
  EXPECT_EQ(parser.GetText(), "Y");
  parser.Get<std::int32_t>();
  EXPECT_EQ(parser.Get<std::int32_t>(), 3);
  EXPECT_EQ(parser.Get<std::int32_t>(), 3);
  EXPECT_EQ(parser.Get<std::int32_t>(), 1);
  EXPECT_EQ(parser.Get<std::int64_t>(), 0);
  EXPECT_EQ(parser.Get<std::int64_t>(), 1);
  parser.Get<std::uint64_t>();
  EXPECT_EQ(parser.Get<float>(), 7);
  EXPECT_TRUE(parser.AtEnd());
}

TEST(Display, BadAddressesAreInputErrorsAndSilenceIsADeviceError) {
  for (const char* bad : {"", ":", "127.0.0.1:", "127.0.0.1:port", "127.0.0.1:99999", "[::1",
                          "[::1]x", "no such host.invalid:1"})
    EXPECT_THROW(Display{bad}, InputError) << bad;
  std::string address;
  {
    Server server;
    address = server.address();
    Display connected(address);
  }
  EXPECT_THAT([&] { Display{address}; },
              testing::ThrowsMessage<DeviceError>(testing::HasSubstr(address)));
}

}  // namespace
}  // namespace luxfield::render
