#include "luxfield/hal/safety/watchdog.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/hal/real_time.h"
#include "luxfield/hal/transport/descriptor_stream.h"

namespace luxfield::hal {
namespace {

constexpr double kLate_s = 0.1;
constexpr double kDeath_s = 5;  // for the kernel to end a process that was killed

// Waits for beats; false where none came in time, true where the other end is closed.
bool AwaitEnd(int socket, double silence_s) {
  for (;;) {
    const SteadyTime due = SecondsFromNow(silence_s);
    if (!WaitFor(socket, POLLIN, due)) {
      // Where this process got no time itself, the other may not have had any either.
      if (SecondsFromNow(-kLate_s) > due) continue;
      return false;
    }
    std::array<char, 64> beats;
    const ssize_t got = ::read(socket, beats.data(), beats.size());
    if (got == 0 || (got < 0 && errno != EINTR)) return true;
  }
}

[[noreturn]] void Watch(int socket, pid_t watched, double silence_s,
                        const Watchdog::MakeSafe& make_safe) {
  ::setsid();
  // Whoever reads what the program prints does not wait for its watchdog.
  if (const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC); null >= 0) {
    ::dup2(null, STDIN_FILENO);
    ::dup2(null, STDOUT_FILENO);
  }
  RaisePriority(pthread_self());  // a busy machine must not look like a hanging one
  const bool died = AwaitEnd(socket, silence_s);
  if (!died) {
    // Its devices are free once it is dead. It is our parent: the number is nobody else's.
    if (::getppid() == watched) ::kill(watched, SIGKILL);
    AwaitEnd(socket, kDeath_s);
  }
  make_safe(died ? "died" : "hangs");
  ::_exit(0);
}

}  // namespace

Watchdog::Watchdog(MakeSafe make_safe, const WatchdogTimes& times)
    : times_(times), expected_(SecondsFromNow(kUnbounded_s)) {
  const auto fail = [](const char* what) {
    throw DeviceError(fmt::format("watchdog: {}: {}; end other programs and start again", what,
                                  std::strerror(errno)));
  };
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) fail("no socket");
  std::fflush(nullptr);  // or the child would print it again
  // Blocked in the watchdog for good.
  sigset_t signals, before;
  ::sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGTSTP})
    ::sigaddset(&signals, signal);
  ::pthread_sigmask(SIG_BLOCK, &signals, &before);
  const pid_t self = ::getpid();
  child_ = ::fork();
  if (child_ == 0) {
    ::close(ends[0]);
    try {
      Watch(ends[1], self, times_.silence_s, make_safe);
    } catch (...) {
      ::_exit(1);
    }
  }
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  socket_ = ends[0];
  ::close(ends[1]);
  if (child_ < 0) {
    ::close(socket_);
    fail("no process");
  }
  thread_ = std::thread([this] { Beat(); });
  real_time_ = RaisePriority(thread_.native_handle());
}

Watchdog::~Watchdog() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ending_changed_.notify_all();
  thread_.join();
  // Before the socket closes, which it would take for a death. Killed, since it may be stopped.
  ::kill(child_, SIGKILL);
  ::waitpid(child_, nullptr, 0);
  ::close(socket_);
}

void Watchdog::Expect(double within_s) {
  const SteadyTime until = SecondsFromNow(within_s + times_.patience_s);
  const std::lock_guard lock(mutex_);
  expected_ = until;
}

void Watchdog::Beat() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    if (std::chrono::steady_clock::now() < expected_ &&
        ::send(socket_, "", 1, MSG_NOSIGNAL | MSG_DONTWAIT) < 0 && errno != EINTR)
      alive_ = false;
    ending_changed_.wait_for(lock, std::chrono::duration<double>(times_.beat_s));
  }
}

}  // namespace luxfield::hal
