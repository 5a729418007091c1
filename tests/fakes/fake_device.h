// Devices for tests, at the other end of a serial line.
#pragma once

#include <string>
#include <string_view>

namespace luxfield::fakes {

// A device in its own time, which only Advance lets pass.
class FakeDevice {
 public:
  virtual ~FakeDevice() = default;
  virtual void Receive(std::string_view bytes) = 0;
  virtual void Advance(double seconds) = 0;
  // What it has said since the last call.
  virtual std::string Transmit() = 0;
  // Whether it will do anything without being told.
  virtual bool active() const = 0;
  // What happens to devices: named events such as "power cycle". False for one it does not know.
  virtual bool Suffer(std::string_view event) = 0;
};

}  // namespace luxfield::fakes
