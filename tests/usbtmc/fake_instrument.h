// A USBTMC instrument that exists under umockdev only (tests/usb/).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/usb/fake_usb_device.h"

namespace luxfield::hal::usbtmc {

class FakeInstrument {
 public:
  static constexpr std::uint16_t kVendor = usb::FakeUsbDevice::kVendor, kProduct = 0x0001;

  // `answer` gives the reply to a message, empty: none.
  explicit FakeInstrument(std::function<std::string(const std::string&)> answer);
  // On a testbed with other devices, with a product number of its own: 1 to 99.
  FakeInstrument(UMockdevTestbed* testbed, int product,
                 std::function<std::string(const std::string&)> answer);
  FakeInstrument(const FakeInstrument&) = delete;
  FakeInstrument& operator=(const FakeInstrument&) = delete;

  struct Faults {
    bool mute = false;           // it takes requests and never answers
    bool stall_out = false;      // it refuses messages, until its endpoint is cleared
    bool stale_tag = false;      // replies carry the tag of the request before
    std::size_t at_once = 1024;  // payload bytes in one transfer
    bool cut = false;            // transfers end before their payload does
  };
  void Set(const Faults& faults);
  // Lets `action` damage each transfer of a reply, called from umockdev's thread; false: it is
  // lost.
  using Damage = std::function<bool(usb::Bytes& transfer)>;
  void SetDamage(Damage action);
  void Unplug() { usb_.Unplug(); }
  void Plug() { usb_.Plug(); }  // in again

  std::vector<std::string> messages();  // that came, in order
  int clears();                         // INITIATE_CLEAR
  int aborts();                         // INITIATE_ABORT_BULK_IN

 private:
  std::optional<usb::Bytes> Control(const std::uint8_t* request);
  bool Out(const std::uint8_t* bytes, std::size_t size);
  std::optional<usb::Bytes> In(std::size_t room);

  std::function<std::string(const std::string&)> answer_;
  UMockdevTestbed* testbed_;
  // Under the lock of usb_:
  Faults faults_;
  Damage damage_;
  std::string reply_;
  bool requested_ = false;
  std::uint8_t tag_ = 0, tag_before_ = 0;
  std::uint32_t room_ = 0;
  std::vector<std::string> messages_;
  int clears_ = 0, aborts_ = 0;
  usb::FakeUsbDevice usb_;  // last: ends before what its endpoints touch
};

}  // namespace luxfield::hal::usbtmc
