#include "tests/vm/attribute.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace luxfield::vm {
namespace {

// Opens, calls `transfer`, closes; a transfer that ends below zero throws.
template <typename Transfer>
ssize_t With(const std::filesystem::path& path, int flags, Transfer&& transfer) {
  const int file = open(path.c_str(), flags | O_CLOEXEC);
  if (file < 0) throw std::system_error(errno, std::generic_category(), path);
  const ssize_t moved = transfer(file);
  const int error = errno;
  close(file);
  if (moved < 0) throw std::system_error(error, std::generic_category(), path);
  return moved;
}

}  // namespace

void WriteAttribute(const std::filesystem::path& path, const std::string& value) {
  const std::string line = value + "\n";
  With(path, O_WRONLY, [&](int file) { return write(file, line.data(), line.size()); });
}

std::string ReadAttribute(const std::filesystem::path& path) {
  std::array<char, 4096> text;
  const ssize_t size =
      With(path, O_RDONLY, [&](int file) { return read(file, text.data(), text.size()); });
  std::string value(text.data(), static_cast<std::size_t>(size));
  while (value.ends_with('\n')) value.pop_back();
  return value;
}

}  // namespace luxfield::vm
