#include "luxfield/hal/transport/descriptor_stream.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "luxfield/hal/error.h"

namespace luxfield::hal {

bool WaitFor(int descriptor, short events, SteadyTime deadline) {
  for (;;) {
    const auto left = std::max(deadline - std::chrono::steady_clock::now(),
                               std::chrono::steady_clock::duration::zero());
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(left);
    const timespec wait{static_cast<time_t>(seconds.count()),
                        static_cast<long>(std::chrono::nanoseconds(left - seconds).count())};
    pollfd request{descriptor, events, 0};
    const int ready = ::ppoll(&request, 1, &wait, nullptr);
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR)
      throw HardwareError(Fault::kDisconnected, "port", "wait", std::strerror(errno),
                          "reconnect the device");
  }
}

DescriptorStream::DescriptorStream(int descriptor, std::string name)
    : descriptor_(descriptor), name_(std::move(name)) {
  ::fcntl(descriptor_, F_SETFL, ::fcntl(descriptor_, F_GETFL) | O_NONBLOCK);
  struct stat status {};
  is_socket_ = ::fstat(descriptor_, &status) == 0 && S_ISSOCK(status.st_mode);
}

DescriptorStream::~DescriptorStream() { ::close(descriptor_); }

void DescriptorStream::Fail(const char* operation, int error) const {
  throw HardwareError(Fault::kDisconnected, name_, operation,
                      error == 0 ? "the other end has closed" : std::strerror(error),
                      "check cable and power, then start again");
}

std::size_t DescriptorStream::Read(std::span<char> buffer, SteadyTime deadline) {
  for (;;) {
    const ssize_t got = ::read(descriptor_, buffer.data(), buffer.size());
    if (got > 0) return static_cast<std::size_t>(got);
    if (got == 0) Fail("read", 0);
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) Fail("read", errno);
    if (!WaitFor(descriptor_, POLLIN, deadline)) return 0;
  }
}

void DescriptorStream::Write(std::string_view bytes, SteadyTime deadline) {
  while (!bytes.empty()) {
    // A socket that its peer has closed must not end the program with a signal.
    const ssize_t put = is_socket_ ? ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL)
                                   : ::write(descriptor_, bytes.data(), bytes.size());
    if (put >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(put));
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) Fail("write", errno);
    if (!WaitFor(descriptor_, POLLOUT, deadline))
      throw HardwareError(Fault::kTimeout, name_, "write",
                          fmt::format("{} bytes were not taken in time", bytes.size()),
                          "check that the device is running");
  }
}

}  // namespace luxfield::hal
