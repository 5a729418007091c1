// How whole messages reach an instrument and come back: USBTMC, or lines over a byte stream.
#pragma once

#include <string>
#include <string_view>

#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {

class MessageChannel {
 public:
  virtual ~MessageChannel() = default;
  // For messages to people: "1ab1:0e11 DP8C000001".
  virtual const std::string& name() const = 0;
  virtual void Write(std::string_view message, SteadyTime deadline) = 0;
  // One whole message, its line end left out. HardwareError(kTimeout) at the deadline; the channel
  // is in step again afterwards: a reply that comes late is not taken for the next one's.
  virtual std::string Read(SteadyTime deadline) = 0;
  // From any thread. While it gives way, a Read that waits, and every later one, ends at once with
  // HardwareError(kStopped), in step afterwards as at its deadline.
  virtual void GiveWay(bool give_way) = 0;
};

}  // namespace luxfield::hal
