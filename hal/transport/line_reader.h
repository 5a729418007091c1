// Lines out of a byte stream, for every protocol that ends its messages with a line feed.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {

// Cuts bytes into lines at '\n'; the terminator, and every '\r' beside it, is removed. A line that
// grows beyond `longest` is dropped whole, so that noise cannot fill the memory.
class LineBuffer {
 public:
  explicit LineBuffer(std::size_t longest = 512) : longest_(longest) {}
  void Push(std::string_view bytes);
  std::optional<std::string> Pop();

 private:
  std::size_t longest_;
  std::string partial_;
  bool overlong_ = false;
  std::deque<std::string> lines_;
};

class LineReader {
 public:
  explicit LineReader(ByteStream& stream) : stream_(stream) {}
  // The next line, or nothing if the deadline passes first. Throws what the stream throws.
  std::optional<std::string> Next(SteadyTime deadline);

 private:
  ByteStream& stream_;
  LineBuffer buffer_;
};

}  // namespace luxfield::hal
