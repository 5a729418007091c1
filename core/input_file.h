// How files that others wrote are opened, by ReadFile (core/file.h) too: regular files, and pipes
// where the whole is read. Folders, devices and sockets are refused with an InputError naming the
// path. A pipe, as of `<(command)` in a shell, has to come to its end within 10 s and 64 MiB.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace luxfield::core {

// A file read from front to back, straight to where its bytes are wanted.
class InputStream {
 public:
  explicit InputStream(const std::filesystem::path& path);
  ~InputStream();
  InputStream(const InputStream&) = delete;
  InputStream& operator=(const InputStream&) = delete;

  std::optional<std::uintmax_t> size() const;  // bytes; none of a pipe
  // Fills `to` with the next bytes; how many, fewer at the end of the file alone.
  std::size_t Read(std::span<char> to);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The whole file; InputError if it is longer.
std::string ReadAtMost(const std::filesystem::path& path, std::uintmax_t most);

// Its first bytes, at most so many; pipes are refused.
std::string ReadStart(const std::filesystem::path& path, std::size_t most);

// For files that are opened by other means afterwards; pipes are refused.
void RequireRegularFile(const std::filesystem::path& path);

}  // namespace luxfield::core
