#include "luxfield/hal/transport/faulty_stream.h"

#include <algorithm>
#include <thread>

namespace luxfield::hal {

FaultyStream::FaultyStream(std::unique_ptr<ByteStream> stream, const LineFaults& reading,
                           const LineFaults& writing, std::uint64_t seed)
    : stream_(std::move(stream)),
      reading_{reading, core::Random(seed, 0), {}, {}},
      writing_{writing, core::Random(seed, 1), {}, {}} {}

// Delays this call, or ends the conversation.
void FaultyStream::MeetFate(Line& line, SteadyTime deadline) {
  if (line.random.Uniform() < line.faults.hang) hung_ = true;
  if (line.random.Uniform() < line.faults.delay)
    std::this_thread::sleep_until(
        std::min(deadline, SecondsFromNow(line.faults.longest_delay_s * line.random.Uniform())));
}

std::string FaultyStream::Damage(Line& line, std::string_view bytes) {
  const LineFaults& faults = line.faults;
  std::string damaged;
  if (line.random.Uniform() < faults.truncate)
    bytes = bytes.substr(0, line.random() % (bytes.size() + 1));
  for (char c : bytes) {
    if (line.random.Uniform() < faults.garble)
      c = static_cast<char>(static_cast<unsigned char>(c) ^ (1u << (line.random() % 8)));
    const double lot = line.random.Uniform();
    if (lot < faults.drop) continue;
    damaged.append(lot < faults.drop + faults.duplicate ? 2 : 1, c);
  }
  return damaged;
}

std::size_t FaultyStream::Read(std::span<char> buffer, SteadyTime deadline) {
  const std::lock_guard lock(reading_.mutex);
  std::string& waiting = reading_.waiting;
  MeetFate(reading_, deadline);
  while (waiting.empty()) {
    const std::size_t got = stream_->Read(buffer, deadline);
    if (got == 0) return 0;
    if (!hung_) waiting = Damage(reading_, {buffer.data(), got});
  }
  const std::size_t given = std::min(buffer.size(), waiting.size());
  std::copy_n(waiting.begin(), given, buffer.begin());
  waiting.erase(0, given);
  return given;
}

void FaultyStream::Write(std::string_view bytes, SteadyTime deadline) {
  const std::lock_guard lock(writing_.mutex);
  MeetFate(writing_, deadline);
  if (!hung_) stream_->Write(Damage(writing_, bytes), deadline);
}

}  // namespace luxfield::hal
