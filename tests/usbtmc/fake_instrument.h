// A USBTMC instrument that exists under umockdev only (tests/usb/).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/usb/fake_usb_device.h"
#include "tests/usbtmc/device_side.h"

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

  using Faults = DeviceSide::Faults;
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
  std::optional<usb::Bytes> In(std::size_t room);

  UMockdevTestbed* testbed_;
  DeviceSide side_;         // under the lock of usb_
  usb::FakeUsbDevice usb_;  // last: ends before what its endpoints touch
};

}  // namespace luxfield::hal::usbtmc
