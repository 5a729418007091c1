// A byte stream over a file descriptor: serial port, pty or socket.
#pragma once

#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {

class DescriptorStream : public ByteStream {
 public:
  // Takes the descriptor over and makes it non-blocking.
  DescriptorStream(int descriptor, std::string name);
  ~DescriptorStream() override;
  DescriptorStream(const DescriptorStream&) = delete;
  DescriptorStream& operator=(const DescriptorStream&) = delete;

  const std::string& name() const override { return name_; }
  std::size_t Read(std::span<char> buffer, SteadyTime deadline) override;
  void Write(std::string_view bytes, SteadyTime deadline) override;

 private:
  [[noreturn]] void Fail(const char* operation, int error) const;

  int descriptor_;
  bool is_socket_ = false;
  std::string name_;
};

// poll(2) for `events` until the deadline, through interruptions by signals. False if the deadline
// came first; a deadline in the past still looks once.
bool WaitFor(int descriptor, short events, SteadyTime deadline);

}  // namespace luxfield::hal
