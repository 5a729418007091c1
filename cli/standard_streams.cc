#include "luxfield/cli/standard_streams.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"

namespace luxfield::cli {
namespace {

struct VisibleStream {
  int descriptor;
  core::VisibleText text;
};
VisibleStream g_out{STDOUT_FILENO, {}}, g_error{STDERR_FILENO, {}};

// What stdio calls with what it has buffered: 0 says that it was not written, errno why. Where
// standard error cannot be written, the exit code alone says what it would.
ssize_t WriteVisible(void* to, const char* bytes, std::size_t count) {
  VisibleStream& stream = *static_cast<VisibleStream*>(to);
  const std::string shown = stream.text.Next({bytes, count});
  for (std::size_t at = 0; at < shown.size();) {
    const ssize_t written = ::write(stream.descriptor, shown.data() + at, shown.size() - at);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && stream.descriptor == STDERR_FILENO) break;
    if (written < 0) return 0;
    at += static_cast<std::size_t>(written);
  }
  return static_cast<ssize_t>(count);
}

std::FILE* Filtered(VisibleStream& stream, int buffering) {
  std::FILE* file = ::fopencookie(&stream, "w", {nullptr, WriteVisible, nullptr, nullptr});
  if (!file) std::_Exit(3);
  std::setvbuf(file, nullptr, buffering, buffering == _IONBF ? 0 : BUFSIZ);
  return file;
}

}  // namespace

void OpenClosedStandardStreams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1 || errno != EBADF) continue;
    // The lowest number that is free is this one: those below it are open by now.
    const int mode = stream == STDERR_FILENO ? O_WRONLY : O_RDONLY;
    if (::open("/dev/null", mode) != stream) std::_Exit(3);
  }
}

void ShowWhatTerminalsObey() {
  stdout = Filtered(g_out, ::isatty(STDOUT_FILENO) ? _IOLBF : _IOFBF);
  stderr = Filtered(g_error, _IONBF);
}

void FlushStandardOutput() {
  errno = 0;
  const std::string cut_off = std::fflush(stdout) == 0 ? g_out.text.Rest() : "";
  if (!cut_off.empty()) std::fputs(cut_off.c_str(), stdout);
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return;
  throw DeviceError(fmt::format(
      "standard output: cannot be written ({}); what was printed is incomplete, files are written "
      "as told: print to a terminal or a file with room",
      errno ? std::strerror(errno) : "an earlier write failed"));
}

}  // namespace luxfield::cli
