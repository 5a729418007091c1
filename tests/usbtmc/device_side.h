// The instrument's side of USBTMC, behind whatever carries its endpoints: umockdev's usbfs
// (fake_instrument.h) or the kernel's FunctionFS (tests/vm/).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace luxfield::hal::usbtmc {

class DeviceSide {
 public:
  using Bytes = std::vector<std::uint8_t>;

  struct Faults {
    bool mute = false;           // it takes requests and never answers
    bool stall_out = false;      // it refuses messages, until its endpoint is cleared
    bool stale_tag = false;      // replies carry the tag of the request before
    std::size_t at_once = 1024;  // payload bytes in one transfer
    bool cut = false;            // transfers end before their payload does
    // Only the first transfer of a reply has a header, which states all of it; the rest follows by
    // itself, and a request begins it again.
    bool one_header = false;
    bool dies_of_clear = false;  // it is mute after INITIATE_CLEAR
  };

  // `answer` gives the reply to a message, empty: none.
  explicit DeviceSide(std::function<std::string(const std::string&)> answer)
      : answer_(std::move(answer)) {}

  // The answer to the eight bytes of a class request; nothing: it stalls.
  std::optional<Bytes> Control(const std::uint8_t* request);
  // Takes a transfer; false: it stalls.
  bool Out(const std::uint8_t* bytes, std::size_t size);
  // The next transfer of a reply; nothing: none yet.
  std::optional<Bytes> In();

  Faults faults;
  // What damages each transfer of a reply; false: it is lost.
  std::function<bool(Bytes& transfer)> damage;

  const std::vector<std::string>& messages() const { return messages_; }  // that came, in order
  int clears() const { return clears_; }                                  // INITIATE_CLEAR
  int aborts() const { return aborts_; }                                  // INITIATE_ABORT_BULK_IN

 private:
  std::function<std::string(const std::string&)> answer_;
  Bytes Header(std::size_t size, bool end) const;
  std::optional<Bytes> InWithOneHeader();

  std::string reply_;
  std::size_t sent_ = 0;  // of a reply with one header
  bool requested_ = false;
  std::uint8_t tag_ = 0, tag_before_ = 0;
  std::uint32_t room_ = 0;
  std::vector<std::string> messages_;
  int clears_ = 0, aborts_ = 0;
};

}  // namespace luxfield::hal::usbtmc
