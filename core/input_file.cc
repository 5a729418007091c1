#include "luxfield/core/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"

namespace luxfield::core {
namespace {

constexpr std::uintmax_t kAnyLength = ~std::uintmax_t{0};
constexpr std::size_t kLongestFromPipe = std::size_t{64} << 20;
constexpr std::chrono::seconds kPipeDeadline{10};

struct Input {
  Descriptor file;
  bool is_pipe;
  std::uintmax_t size;  // of a regular file
};

// The one place where what others wrote is opened. Opening a pipe would wait for its other end, a
// device would be read without end.
Input OpenInput(const std::filesystem::path& path) {
  const auto fail = [&](const std::string& problem, const char* remedy) {
    throw InputError(path.string(), problem, remedy);
  };
  Input input{Descriptor(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)), false, 0};
  struct stat status {};
  if (input.file.get() < 0 && errno == ENXIO)
    fail("is a socket or a device, not a file", "name a file");
  if (input.file.get() < 0 || ::fstat(input.file.get(), &status) != 0)
    fail(fmt::format("cannot open: {}", std::strerror(errno)),
         "check the path and its permissions");
  if (S_ISDIR(status.st_mode)) fail("is a folder, not a file", "name a file");
  input.is_pipe = S_ISFIFO(status.st_mode);
  input.size = static_cast<std::uintmax_t>(status.st_size);
  if (!input.is_pipe && !S_ISREG(status.st_mode)) fail("is a device, not a file", "name a file");
  return input;
}

Input OpenRegular(const std::filesystem::path& path) {
  Input input = OpenInput(path);
  if (input.is_pipe)
    throw InputError(path.string(), "is a pipe, and is read here and there",
                     "write it into a file first");
  return input;
}

// Until the pipe has bytes or its writer is done.
void AwaitPipe(const std::filesystem::path& path, int pipe,
               std::chrono::steady_clock::time_point until) {
  constexpr int kLookEvery_ms = 100;
  for (;;) {
    ThrowIfInterrupted();
    pollfd readable{pipe, POLLIN, 0};
    if (::poll(&readable, 1, kLookEvery_ms) > 0) return;
    if (std::chrono::steady_clock::now() > until)
      throw InputError(
          path.string(),
          fmt::format("is a pipe whose end does not come in {} s", kPipeDeadline.count()),
          "write into it, or name a file");
  }
}

}  // namespace

struct InputStream::Impl {
  std::filesystem::path path;
  Input input;
  std::chrono::steady_clock::time_point until;  // of a pipe
  std::size_t total = 0;

  // Of the next bytes at least one, but at the end.
  std::size_t ReadSome(std::span<char> to) {
    for (;;) {
      if (input.is_pipe) AwaitPipe(path, input.file.get(), until);
      const ssize_t count = ::read(input.file.get(), to.data(), to.size());
      if (count < 0 && (errno == EINTR || (input.is_pipe && errno == EAGAIN))) continue;
      if (count < 0)
        throw InputError(path.string(), fmt::format("cannot read: {}", std::strerror(errno)),
                         "check the disk");
      total += static_cast<std::size_t>(count);
      if (input.is_pipe && total > kLongestFromPipe)
        throw InputError(path.string(), "is a pipe that brings more than 64 MiB",
                         "write it into a file first");
      return static_cast<std::size_t>(count);
    }
  }
};

InputStream::InputStream(const std::filesystem::path& path)
    : impl_(new Impl{path, OpenInput(path), std::chrono::steady_clock::now() + kPipeDeadline}) {}

InputStream::~InputStream() = default;

std::optional<std::uintmax_t> InputStream::size() const {
  if (impl_->input.is_pipe) return std::nullopt;
  return impl_->input.size;
}

std::size_t InputStream::Read(std::span<char> to) {
  std::size_t filled = 0;
  while (filled < to.size()) {
    const std::size_t count = impl_->ReadSome(to.subspan(filled));
    if (count == 0) break;
    filled += count;
  }
  return filled;
}

void ReadInPieces(const std::filesystem::path& path,
                  const std::function<void(std::string_view)>& take) {
  InputStream input(path);
  std::string buffer(1 << 18, '\0');  // stays in the second-level cache
  while (const std::size_t count = input.Read(buffer)) take({buffer.data(), count});
}

std::string ReadFile(const std::filesystem::path& path) { return ReadAtMost(path, kAnyLength); }

std::string ReadAtMost(const std::filesystem::path& path, std::uintmax_t most) {
  std::string bytes;
  const auto check = [&](std::uintmax_t length) {
    if (length > most)
      throw InputError(path.string(),
                       fmt::format("is longer than the {} bytes that are read", most),
                       "name the file that was meant");
  };
  std::error_code unknown;  // the size is only a hint
  if (const auto size = std::filesystem::file_size(path, unknown); !unknown) {
    check(size);
    bytes.reserve(size);
  }
  ReadInPieces(path, [&](std::string_view piece) {
    check(bytes.size() + piece.size());
    bytes.append(piece);
  });
  return bytes;
}

std::string ReadStart(const std::filesystem::path& path, std::size_t most) {
  const Input input = OpenRegular(path);
  std::string bytes(most, '\0');
  std::size_t filled = 0;
  while (filled < most) {
    const ssize_t count = ::read(input.file.get(), bytes.data() + filled, most - filled);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0)
      throw InputError(path.string(), fmt::format("cannot read: {}", std::strerror(errno)),
                       "check the disk");
    if (count == 0) break;
    filled += static_cast<std::size_t>(count);
  }
  bytes.resize(filled);
  return bytes;
}

void RequireRegularFile(const std::filesystem::path& path) { OpenRegular(path); }

}  // namespace luxfield::core
