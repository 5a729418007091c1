#include "tests/usbtmc/fake_instrument.h"

#include <algorithm>
#include <utility>

namespace luxfield::hal::usbtmc {
namespace {

// One USBTMC/USB488 interface with a bulk endpoint each way of 512 bytes.
const usb::Bytes kInterface = {9, 4, 0,    0, 2,    0xfe, 3, 1, 0,  //
                               7, 5, 0x81, 2, 0x00, 0x02, 0,        //
                               7, 5, 0x02, 2, 0x00, 0x02, 0};

}  // namespace

FakeInstrument::FakeInstrument(std::function<std::string(const std::string&)> answer)
    : FakeInstrument(umockdev_testbed_new(), kProduct, std::move(answer)) {
  g_object_unref(testbed_);  // the other constructor holds it too
}

FakeInstrument::FakeInstrument(UMockdevTestbed* testbed, int product,
                               std::function<std::string(const std::string&)> answer)
    : testbed_(testbed),
      side_(std::move(answer)),
      usb_(testbed, product, kInterface,
           {.control = [this](const std::uint8_t* request) { return Control(request); },
            .out = [this](int, const std::uint8_t* bytes,
                          std::size_t size) { return side_.Out(bytes, size); },
            .in = [this](int, std::size_t room) { return In(room); },
            .clear_halt = [this] { side_.faults.stall_out = false; }}) {}

void FakeInstrument::Set(const Faults& faults) {
  const auto lock = usb_.Lock();
  side_.faults = faults;
}

void FakeInstrument::SetDamage(Damage action) {
  const auto lock = usb_.Lock();
  side_.damage = std::move(action);
}

std::vector<std::string> FakeInstrument::messages() {
  const auto lock = usb_.Lock();
  return side_.messages();
}
int FakeInstrument::clears() {
  const auto lock = usb_.Lock();
  return side_.clears();
}
int FakeInstrument::aborts() {
  const auto lock = usb_.Lock();
  return side_.aborts();
}

std::optional<usb::Bytes> FakeInstrument::Control(const std::uint8_t* request) {
  // String descriptors: the languages, and the serial number "7" in UTF-16.
  if (request[0] == 0x80 && request[1] == 6 && request[3] == 3)
    return request[2] == 0 ? usb::Bytes{4, 3, 9, 4} : usb::Bytes{4, 3, '7', 0};
  return side_.Control(request);
}

std::optional<usb::Bytes> FakeInstrument::In(std::size_t room) {
  auto transfer = side_.In();
  if (transfer) transfer->resize(std::min(transfer->size(), room));
  return transfer;
}

}  // namespace luxfield::hal::usbtmc
