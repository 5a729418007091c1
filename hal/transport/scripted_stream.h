// A peer that follows a script: recorded conversations, played back to a driver.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>

#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {

// What the driver has to write, to the byte, and what it then gets to read. An empty `expect` is
// said without being asked.
struct Exchange {
  std::string expect, reply;
};

class ScriptedStream : public ByteStream {
 public:
  explicit ScriptedStream(std::deque<Exchange> script);

  const std::string& name() const override { return name_; }
  // Waits until the deadline where the script waits for the driver.
  std::size_t Read(std::span<char> buffer, SteadyTime deadline) override;
  // HardwareError(kProtocol), with both texts, at the first byte that is not in the script.
  void Write(std::string_view bytes, SteadyTime deadline) override;

  // Whether all of it has been written and read.
  bool finished() const;

 private:
  void Speak();

  std::string name_ = "script";
  mutable std::mutex mutex_;
  std::condition_variable spoken_;
  std::deque<Exchange> script_;
  std::string readable_;
};

}  // namespace luxfield::hal
