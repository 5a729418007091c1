// Preloaded into a camera's process: what a network, or the camera's own firmware, does to what it
// sends. LUXFIELD_NETWORK = drop, delay, duplicate, truncate, garble, hang (silent for good) or
// stall (silent for a while); LUXFIELD_NETWORK_SEED = a number.
//
// Datagrams (GigE Vision): a damaged one fails its checksum, and is dropped by the system that
// receives it; nothing else guards pixels. So `garble` stands for firmware that errs, and changes
// answers of the control channel alone, a bit each.
//
// Packets of a stream (PTP/IP), each sent with one call: TCP loses and damages nothing, so to drop
// or to truncate one is to cut the connection before or within it. `garble` changes a bit of a
// packet's head, where its numbers are: a RAW file's pixels have no check.
#include <arpa/inet.h>
#include <dlfcn.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <random>
#include <string>
#include <thread>

namespace {

using Clock = std::chrono::steady_clock;

struct Network {
  std::string kind = std::getenv("LUXFIELD_NETWORK") ? std::getenv("LUXFIELD_NETWORK") : "";
  std::minstd_rand random{static_cast<unsigned>(
      std::getenv("LUXFIELD_NETWORK_SEED") ? std::atoi(std::getenv("LUXFIELD_NETWORK_SEED")) : 1)};
  bool hung = false;
  Clock::time_point silent_until;
  std::mutex mutex;

  bool Is(const char* name) const { return kind == name; }
  // Whether this datagram or packet meets its fate.
  bool Strikes(double probability) {
    return std::uniform_real_distribution<>()(random) < probability;
  }
  // Silent now, for good or for a while.
  bool Silent(double probability) {
    if (Is("hang") && Strikes(probability)) hung = true;
    if (Is("stall") && Strikes(probability))
      silent_until = Clock::now() + std::chrono::milliseconds(500 + random() % 3500);
    return hung || Clock::now() < silent_until;
  }
  std::chrono::milliseconds Delay() { return std::chrono::milliseconds(random() % 20); }
  void FlipABit(std::string& bytes, std::size_t within) {
    within = std::min(within, bytes.size());
    if (within > 0) bytes[random() % within] ^= static_cast<char>(1u << random() % 8);
  }
};

Network& TheNetwork() {
  static Network network;
  return network;
}

ssize_t SizeOf(const msghdr& message) {
  ssize_t size = 0;
  for (std::size_t k = 0; k < message.msg_iovlen; ++k)
    size += static_cast<ssize_t>(message.msg_iov[k].iov_len);
  return size;
}

// GigE Vision's control channel answers from this port.
bool IsControl(int socket) {
  constexpr std::uint16_t kControlPort = 3956;
  sockaddr_in address{};
  socklen_t size = sizeof address;
  return getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
         address.sin_family == AF_INET && ntohs(address.sin_port) == kControlPort;
}

}  // namespace

extern "C" ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  using Function = ssize_t(int, const msghdr*, int);
  static const auto next = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, "sendmsg"));
  Network& network = TheNetwork();
  const std::lock_guard lock(network.mutex);
  const ssize_t size = SizeOf(*message);
  if (network.Silent(0.002) || (network.Is("drop") && network.Strikes(0.01))) return size;
  if (network.Is("delay") && network.Strikes(0.05)) std::this_thread::sleep_for(network.Delay());
  if (network.Is("duplicate") && network.Strikes(0.05)) next(socket, message, flags);
  const bool truncated = network.Is("truncate") && network.Strikes(0.01);
  const bool garbled = network.Is("garble") && IsControl(socket) && network.Strikes(0.01);
  if (message->msg_iovlen == 1 && (truncated || garbled)) {
    const iovec& whole = message->msg_iov[0];
    std::string bytes(static_cast<const char*>(whole.iov_base), whole.iov_len);
    if (truncated) bytes.resize(network.random() % (bytes.size() + 1));
    if (garbled) network.FlipABit(bytes, bytes.size());
    iovec part{bytes.data(), bytes.size()};
    msghdr changed = *message;
    changed.msg_iov = &part;
    next(socket, &changed, flags);
    return size;
  }
  return next(socket, message, flags);
}

extern "C" ssize_t send(int socket, const void* data, size_t size, int flags) {
  using Function = ssize_t(int, const void*, size_t, int);
  static const auto next = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, "send"));
  Network& network = TheNetwork();
  const std::lock_guard lock(network.mutex);
  constexpr double kOften = 0.05, kSeldom = 0.0005;
  if (network.Silent(kSeldom)) {
    if (network.hung) return static_cast<ssize_t>(size);
    std::this_thread::sleep_until(network.silent_until);
  }
  if (network.Is("delay") && network.Strikes(kOften)) std::this_thread::sleep_for(network.Delay());
  if (network.Is("duplicate") && network.Strikes(kSeldom)) next(socket, data, size, flags);
  const bool truncated = network.Is("truncate") && network.Strikes(kSeldom);
  if (truncated || (network.Is("drop") && network.Strikes(kSeldom))) {
    if (truncated) next(socket, data, network.random() % size, flags);
    shutdown(socket, SHUT_RDWR);
    return static_cast<ssize_t>(size);
  }
  if (network.Is("garble") && network.Strikes(kSeldom)) {
    constexpr std::size_t kHead = 32;
    std::string bytes(static_cast<const char*>(data), size);
    network.FlipABit(bytes, kHead);
    return next(socket, bytes.data(), size, flags);
  }
  return next(socket, data, size, flags);
}
