#include "luxfield/render/film/display.h"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>

#include "luxfield/core/error.h"

namespace luxfield::render {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little-endian");

enum class PacketType : std::uint8_t { kCreateImage = 4, kUpdateImageV3 = 6 };

class Packet {
 public:
  explicit Packet(PacketType type) {
    Put(std::uint32_t{0});  // the length, known at the end
    Put(type);
  }
  template <typename T>
  void Put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void Put(bool value) { bytes_.push_back(value ? 1 : 0); }
  void PutFloats(std::span<const float> values) {
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  void PutText(const std::string& text) { bytes_.append(text.c_str(), text.size() + 1); }
  void PutChannels(int channels) {
    Put(std::int32_t{channels});
    for (int c = 0; c < channels; ++c) PutText(channels == 1 ? "Y" : std::string(1, "RGB"[c]));
  }
  std::string Finish() {
    const auto length = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &length, sizeof length);
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
};

struct HostAndPort {
  std::string host, port = "14158";
};

HostAndPort ParseAddress(const std::string& address) {
  HostAndPort parsed;
  std::string rest;
  if (address.starts_with('[')) {
    const auto end = address.find(']');
    if (end != std::string::npos) {
      parsed.host = address.substr(1, end - 1);
      rest = address.substr(end + 1);
    }
  } else {
    const auto colon = address.find(':');
    parsed.host = address.substr(0, colon);
    if (colon != std::string::npos) rest = address.substr(colon);
  }
  const bool has_port =
      rest.starts_with(':') && rest.size() > 1 && rest.size() <= 6 &&
      std::all_of(rest.begin() + 1, rest.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (has_port) parsed.port = rest.substr(1);
  if (parsed.host.empty() || (!rest.empty() && !has_port) || std::stoi(parsed.port) > 65535)
    throw InputError(fmt::format(
        "'{}' is no address of a display; write host:port, as in 127.0.0.1:14158", address));
  return parsed;
}

}  // namespace

Display::Display(const std::string& address, double timeout_s) : address_(address) {
  const auto [host, port] = ParseAddress(address);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); code != 0)
    throw InputError(fmt::format("the display's host '{}' is unknown ({}); correct it", host,
                                 ::gai_strerror(code)));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  int error = 0;
  for (const addrinfo* entry = found; entry && socket_ < 0; entry = entry->ai_next) {
    socket_ = ::socket(entry->ai_family, entry->ai_socktype | SOCK_CLOEXEC, entry->ai_protocol);
    if (socket_ < 0) {
      error = errno;
      continue;
    }
    // The send timeout also bounds connect().
    timeval limit{};
    limit.tv_sec = static_cast<time_t>(timeout_s);
    limit.tv_usec = static_cast<suseconds_t>(1e6 * (timeout_s - std::floor(timeout_s)));
    ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    if (::connect(socket_, entry->ai_addr, entry->ai_addrlen) != 0) {
      error = errno;
      ::close(socket_);
      socket_ = -1;
    }
  }
  if (socket_ < 0)
    throw DeviceError(
        fmt::format("no display answers at {} ({}); start tev there, or leave out --display",
                    address, std::strerror(error)));
}

Display::~Display() {
  if (socket_ >= 0) ::close(socket_);
}

void Display::Send(const std::string& packet) {
  std::size_t sent = 0;
  while (sent < packet.size()) {
    const ssize_t count = ::send(socket_, packet.data() + sent, packet.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0)
      throw DeviceError(fmt::format("the display at {} stopped listening ({}); start it again",
                                    address_, std::strerror(errno)));
    sent += static_cast<std::size_t>(count);
  }
}

void Display::Create(const std::string& name, int width, int height, int channels) {
  Packet packet(PacketType::kCreateImage);
  packet.Put(true);
  packet.PutText(name);
  packet.Put(std::int32_t{width});
  packet.Put(std::int32_t{height});
  packet.PutChannels(channels);
  Send(packet.Finish());
}

void Display::Update(const std::string& name, const core::Image& image, int first_row, int rows) {
  const std::size_t row_bytes =
      static_cast<std::size_t>(image.width) * image.channels * sizeof(float);
  const int step = static_cast<int>(
      std::clamp<std::size_t>((std::size_t{1} << 20) / std::max<std::size_t>(row_bytes, 1), 1,
                              static_cast<std::size_t>(image.height)));
  for (int row = first_row; row < first_row + rows; row += step) {
    const int count = std::min(step, first_row + rows - row);
    const std::size_t pixels = static_cast<std::size_t>(count) * image.width;
    Packet packet(PacketType::kUpdateImageV3);
    packet.Put(false);
    packet.PutText(name);
    packet.PutChannels(image.channels);
    for (const int value : {0, row, image.width, count}) packet.Put(std::int32_t{value});
    for (int c = 0; c < image.channels; ++c) packet.Put(static_cast<std::int64_t>(pixels * c));
    for (int c = 0; c < image.channels; ++c) packet.Put(std::int64_t{1});
    for (int c = 0; c < image.channels; ++c)
      packet.PutFloats(image.plane(c).subspan(static_cast<std::size_t>(row) * image.width, pixels));
    Send(packet.Finish());
  }
}

void Display::Show(const std::string& name, const core::Image& image) {
  Create(name, image.width, image.height, image.channels);
  Update(name, image, 0, image.height);
}

}  // namespace luxfield::render
