// A bad line: what cables, hubs and noise do to bytes, on purpose and repeatably.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>

#include "luxfield/core/random.h"
#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {

// Probabilities per byte, or per call where the text says so; 0 is off.
struct LineFaults {
  double drop = 0;
  double duplicate = 0;
  double garble = 0;    // one bit of the byte flips
  double truncate = 0;  // per call: the rest of its bytes is lost
  double delay = 0;     // per call: it waits up to longest_delay_s, never past its deadline
  double longest_delay_s = 0.01;
  double hang = 0;  // per call: from here on nothing passes any more, in either direction
};

// The sequence of faults depends on the seed and on the sequence of calls per direction.
class FaultyStream : public ByteStream {
 public:
  FaultyStream(std::unique_ptr<ByteStream> stream, const LineFaults& reading,
               const LineFaults& writing, std::uint64_t seed);

  const std::string& name() const override { return stream_->name(); }
  std::size_t Read(std::span<char> buffer, SteadyTime deadline) override;
  void Write(std::string_view bytes, SteadyTime deadline) override;

 private:
  // One direction.
  struct Line {
    LineFaults faults;
    core::Random random;
    std::mutex mutex;
    std::string waiting;  // read, but damaged into more bytes than the caller had room for
  };
  std::string Damage(Line& line, std::string_view bytes);
  void MeetFate(Line& line, SteadyTime deadline);

  std::unique_ptr<ByteStream> stream_;
  Line reading_, writing_;
  std::atomic<bool> hung_ = false;
};

}  // namespace luxfield::hal
