#include "luxfield/hal/transport/scripted_stream.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/hal/error.h"

namespace luxfield::hal {

ScriptedStream::ScriptedStream(std::deque<Exchange> script) : script_(std::move(script)) {
  Speak();
}

void ScriptedStream::Speak() {
  while (!script_.empty() && script_.front().expect.empty()) {
    readable_ += script_.front().reply;
    script_.pop_front();
  }
  spoken_.notify_all();
}

std::size_t ScriptedStream::Read(std::span<char> buffer, SteadyTime deadline) {
  std::unique_lock lock(mutex_);
  spoken_.wait_until(lock, deadline, [&] { return !readable_.empty(); });
  const std::size_t got = std::min(buffer.size(), readable_.size());
  std::copy_n(readable_.begin(), got, buffer.begin());
  readable_.erase(0, got);
  return got;
}

void ScriptedStream::Write(std::string_view bytes, SteadyTime) {
  const std::lock_guard lock(mutex_);
  while (!bytes.empty()) {
    const std::string expect = script_.empty() ? std::string() : script_.front().expect;
    const std::size_t count = std::min(bytes.size(), expect.size());
    if (count == 0 || bytes.substr(0, count) != std::string_view(expect).substr(0, count))
      throw HardwareError(Fault::kProtocol, name_, "write",
                          fmt::format("expected {:?}, got {:?}", expect, bytes),
                          "correct the driver or the script");
    bytes.remove_prefix(count);
    script_.front().expect.erase(0, count);
    if (script_.front().expect.empty()) Speak();
  }
}

bool ScriptedStream::finished() const {
  const std::lock_guard lock(mutex_);
  return script_.empty() && readable_.empty();
}

}  // namespace luxfield::hal
