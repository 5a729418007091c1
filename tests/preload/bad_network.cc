// Preloaded into a camera's process: what a network does to the datagrams it sends.
// LUXFIELD_NETWORK = drop, delay, duplicate, truncate or hang; LUXFIELD_NETWORK_SEED = a number. A
// damaged datagram fails its checksum, and is dropped by the system that receives it.
#include <dlfcn.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <chrono>
#include <cstdlib>
#include <mutex>
#include <random>
#include <string>
#include <thread>

namespace {

struct Network {
  std::string kind = std::getenv("LUXFIELD_NETWORK") ? std::getenv("LUXFIELD_NETWORK") : "";
  std::minstd_rand random{static_cast<unsigned>(
      std::getenv("LUXFIELD_NETWORK_SEED") ? std::atoi(std::getenv("LUXFIELD_NETWORK_SEED")) : 1)};
  bool hung = false;
  std::mutex mutex;

  // Whether this datagram meets its fate.
  bool Strikes(double probability) {
    return std::uniform_real_distribution<>()(random) < probability;
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

}  // namespace

extern "C" ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  using Function = ssize_t(int, const msghdr*, int);
  static const auto next = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, "sendmsg"));
  Network& network = TheNetwork();
  const std::lock_guard lock(network.mutex);
  const ssize_t size = SizeOf(*message);
  if (network.kind == "hang" && network.Strikes(0.0003)) network.hung = true;
  if (network.hung || (network.kind == "drop" && network.Strikes(0.01))) return size;
  if (network.kind == "delay" && network.Strikes(0.05))
    std::this_thread::sleep_for(std::chrono::milliseconds(network.random() % 20));
  if (network.kind == "duplicate" && network.Strikes(0.05)) next(socket, message, flags);
  if (network.kind == "truncate" && message->msg_iovlen == 1 && network.Strikes(0.01)) {
    iovec part = message->msg_iov[0];
    part.iov_len = network.random() % (part.iov_len + 1);
    msghdr cut = *message;
    cut.msg_iov = &part;
    next(socket, &cut, flags);
    return size;
  }
  return next(socket, message, flags);
}
