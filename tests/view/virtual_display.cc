#include "tests/view/virtual_display.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <utility>

namespace luxfield::view {

VirtualDisplay::VirtualDisplay(VirtualDisplay&& other) noexcept
    : server_(std::exchange(other.server_, -1)) {}

// The server chooses a free number, and writes it to the pipe when it takes clients.
std::optional<VirtualDisplay> VirtualDisplay::Start() {
  int ends[2];
  if (pipe(ends) != 0) return {};
  const pid_t server = fork();
  if (server == 0) {
    close(ends[0]);
    const int null = open("/dev/null", O_RDWR);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    const std::string number = std::to_string(ends[1]);
    execlp("Xvfb", "Xvfb", "-displayfd", number.c_str(), "-screen", "0", "1600x1200x24",
           "-nolisten", "tcp", nullptr);
    _exit(127);
  }
  close(ends[1]);
  std::string display;
  char character = 0;
  while (read(ends[0], &character, 1) == 1 && character != '\n') display += character;
  close(ends[0]);
  if (display.empty()) {
    waitpid(server, nullptr, 0);
    return {};
  }
  setenv("DISPLAY", (":" + display).c_str(), 1);
  return VirtualDisplay(server);
}

VirtualDisplay::~VirtualDisplay() {
  if (server_ < 0) return;
  kill(server_, SIGTERM);
  waitpid(server_, nullptr, 0);
  unsetenv("DISPLAY");
}

}  // namespace luxfield::view
