#include "luxfield/hal/transport/open_port.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "luxfield/hal/error.h"
#include "luxfield/hal/permission.h"
#include "luxfield/hal/transport/descriptor_stream.h"

namespace luxfield::hal {
namespace {

// Closes what a failure leaves open.
class Descriptor {
 public:
  explicit Descriptor(int value) : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return value_; }
  int Release() { return std::exchange(value_, -1); }

 private:
  int value_;
};

std::optional<speed_t> Speed(int baud) {
  switch (baud) {
    case 9600:
      return B9600;
    case 19200:
      return B19200;
    case 38400:
      return B38400;
    case 57600:
      return B57600;
    case 115200:
      return B115200;
    case 230400:
      return B230400;
    case 460800:
      return B460800;
    case 921600:
      return B921600;
    default:
      return {};
  }
}

[[noreturn]] void FailToOpen(const std::string& port, Fault fault, const std::string& problem,
                             const std::string& remedy) {
  throw HardwareError(fault, port, "open", problem, remedy);
}

HardwareError NotAllowed(const std::string& path, int error) {
  return {Fault::kRefused, path, "open", std::strerror(error), kJoinDialout};
}

}  // namespace

std::unique_ptr<ByteStream> OpenSerialPort(const std::string& path, int baud) {
  const auto speed = Speed(baud);
  if (!speed)
    FailToOpen(path, Fault::kRefused, fmt::format("{} baud is not a rate of serial ports", baud),
               "set the device's rate, such as 115200");
  // Non-blocking: without it, open waits for the modem's carrier.
  Descriptor port(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (port.get() < 0) {
    const int error = errno;
    if (error == EACCES) throw NotAllowed(path, error);
    if (error == EBUSY)
      FailToOpen(path, Fault::kRefused, "is in use by another program", "close that program");
    FailToOpen(path, Fault::kDisconnected, std::strerror(error),
               "plug the device in, or correct `port` (`luxfield devices` lists the ports)");
  }
  termios settings{};
  if (::tcgetattr(port.get(), &settings) != 0)
    FailToOpen(path, Fault::kRefused, "is not a serial port", "correct `port`");
  if (::flock(port.get(), LOCK_EX | LOCK_NB) != 0)
    FailToOpen(path, Fault::kRefused, "is in use by another program", "close that program");
  ::ioctl(port.get(), TIOCEXCL);
  ::cfmakeraw(&settings);
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS | HUPCL);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  ::cfsetispeed(&settings, *speed);
  ::cfsetospeed(&settings, *speed);
  if (::tcsetattr(port.get(), TCSANOW, &settings) != 0)
    FailToOpen(path, Fault::kRefused, std::strerror(errno), "try another baud rate");
  return std::make_unique<DescriptorStream>(port.Release(), path);
}

std::string PortRefusal(const std::string& path) {
  return IsForbidden(path) ? NotAllowed(path, EACCES).what() : "";
}

std::unique_ptr<ByteStream> OpenTcp(const std::string& host, const std::string& service,
                                    SteadyTime deadline) {
  const std::string name = "tcp:" + host + ":" + service;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), service.c_str(), &hints, &found); error != 0)
    FailToOpen(name, Fault::kDisconnected, ::gai_strerror(error), "correct host and port");
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, ::freeaddrinfo);
  int last_error = ECONNREFUSED;
  for (const addrinfo* a = found; a; a = a->ai_next) {
    Descriptor socket(
        ::socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol));
    if (socket.get() < 0) continue;
    if (::connect(socket.get(), a->ai_addr, a->ai_addrlen) != 0 && errno != EINPROGRESS) {
      last_error = errno;
      continue;
    }
    if (!WaitFor(socket.get(), POLLOUT, deadline))
      FailToOpen(name, Fault::kTimeout, "no answer", "check address and network");
    socklen_t size = sizeof last_error;
    ::getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &last_error, &size);
    if (last_error != 0) continue;
    const int on = 1;
    ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return std::make_unique<DescriptorStream>(socket.Release(), name);
  }
  FailToOpen(name, Fault::kDisconnected, std::strerror(last_error), "switch the device on");
}

std::unique_ptr<ByteStream> OpenPort(const std::string& port, int baud, SteadyTime deadline) {
  constexpr std::string_view kTcp = "tcp:";
  if (!port.starts_with(kTcp)) return OpenSerialPort(port, baud);
  const auto colon = port.rfind(':');
  if (colon <= kTcp.size())
    FailToOpen(port, Fault::kRefused, "names no port", "write tcp:HOST:PORT");
  return OpenTcp(port.substr(kTcp.size(), colon - kTcp.size()), port.substr(colon + 1), deadline);
}

std::vector<std::string> AttachedSerialPorts() {
  namespace fs = std::filesystem;
  std::vector<std::string> ports;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/dev/serial/by-id", ignored))
    ports.push_back(entry.path().string());
  if (ports.empty())
    for (const auto& entry : fs::directory_iterator("/dev", ignored)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("ttyUSB") || name.starts_with("ttyACM"))
        ports.push_back(entry.path().string());
    }
  std::sort(ports.begin(), ports.end());
  return ports;
}

}  // namespace luxfield::hal
