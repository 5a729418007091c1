#include "luxfield/hal/transport/line_reader.h"

#include <array>

namespace luxfield::hal {

void LineBuffer::Push(std::string_view bytes) {
  for (const char c : bytes) {
    if (c == '\n') {
      while (!partial_.empty() && partial_.back() == '\r') partial_.pop_back();
      if (!overlong_) lines_.push_back(std::move(partial_));
      partial_.clear();
      overlong_ = false;
    } else if (partial_.size() < longest_) {
      if (c != '\r' || !partial_.empty()) partial_.push_back(c);
    } else {
      overlong_ = true;
    }
  }
}

std::optional<std::string> LineBuffer::Pop() {
  if (lines_.empty()) return {};
  std::string line = std::move(lines_.front());
  lines_.pop_front();
  return line;
}

std::optional<std::string> LineReader::Next(SteadyTime deadline) {
  for (;;) {
    if (auto line = buffer_.Pop()) return line;
    std::array<char, 256> bytes;
    const std::size_t got = stream_.Read(bytes, deadline);
    if (got == 0) return {};
    buffer_.Push({bytes.data(), got});
  }
}

}  // namespace luxfield::hal
