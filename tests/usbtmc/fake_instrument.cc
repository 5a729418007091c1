#include "tests/usbtmc/fake_instrument.h"

#include <algorithm>
#include <cstring>
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
    : answer_(std::move(answer)),
      testbed_(testbed),
      usb_(testbed, product, kInterface,
           {.control = [this](const std::uint8_t* request) { return Control(request); },
            .out = [this](int, const std::uint8_t* bytes,
                          std::size_t size) { return Out(bytes, size); },
            .in = [this](int, std::size_t room) { return In(room); },
            .clear_halt = [this] { faults_.stall_out = false; }}) {}

void FakeInstrument::Set(const Faults& faults) {
  const auto lock = usb_.Lock();
  faults_ = faults;
}

void FakeInstrument::SetDamage(Damage action) {
  const auto lock = usb_.Lock();
  damage_ = std::move(action);
}

std::vector<std::string> FakeInstrument::messages() {
  const auto lock = usb_.Lock();
  return messages_;
}
int FakeInstrument::clears() {
  const auto lock = usb_.Lock();
  return clears_;
}
int FakeInstrument::aborts() {
  const auto lock = usb_.Lock();
  return aborts_;
}

std::optional<usb::Bytes> FakeInstrument::Control(const std::uint8_t* bytes) {
  usb::Bytes answer;
  if (bytes[0] == 0xa1 && bytes[1] == 7) {
    answer.assign(24, 0);
    answer[0] = 1;
  } else if (bytes[0] == 0xa1 && bytes[1] == 5) {
    ++clears_;
    reply_.clear();
    requested_ = false;
    answer = {1};
  } else if (bytes[0] == 0xa1 && bytes[1] == 6) {
    answer = {1, 0};
  } else if (bytes[0] == 0xa2 && bytes[1] == 3) {
    ++aborts_;
    reply_.clear();
    requested_ = false;
    answer = {1, tag_};
  } else if (bytes[0] == 0xa2 && bytes[1] == 4) {
    answer.assign(8, 0);
    answer[0] = 1;
  } else if (bytes[0] == 0xa2 && (bytes[1] == 1 || bytes[1] == 2)) {
    answer.assign(bytes[1] == 1 ? 2 : 8, 0);
    answer[0] = 1;
  } else if (bytes[0] == 0x80 && bytes[1] == 6 && bytes[3] == 3) {
    // String descriptors: the languages, and the serial number "7" in UTF-16.
    answer = bytes[2] == 0 ? usb::Bytes{4, 3, 9, 4} : usb::Bytes{4, 3, '7', 0};
  } else {
    return std::nullopt;
  }
  return answer;
}

bool FakeInstrument::Out(const std::uint8_t* bytes, std::size_t size) {
  if (faults_.stall_out) return false;
  if (size < 12 || (bytes[1] ^ bytes[2]) != 0xff || bytes[1] == 0) return true;
  std::uint32_t length = 0;
  std::memcpy(&length, bytes + 4, 4);
  tag_before_ = std::exchange(tag_, bytes[1]);
  if (bytes[0] == 1 && size == (12 + length + 3) / 4 * 4) {
    messages_.emplace_back(reinterpret_cast<const char*>(bytes) + 12, length);
    reply_ += answer_(messages_.back());
  } else if (bytes[0] == 2) {
    requested_ = true;
    room_ = length;
  }
  return true;
}

std::optional<usb::Bytes> FakeInstrument::In(std::size_t room) {
  if (faults_.mute || !requested_ || reply_.empty()) return std::nullopt;
  const std::size_t size = std::min<std::size_t>({reply_.size(), room_, faults_.at_once});
  const std::uint8_t tag = faults_.stale_tag ? tag_before_ : tag_;
  usb::Bytes transfer = {2, tag, static_cast<std::uint8_t>(~tag), 0};
  for (int shift = 0; shift < 32; shift += 8)
    transfer.push_back(static_cast<std::uint8_t>(size >> shift));
  transfer.insert(transfer.end(), {std::uint8_t{size == reply_.size()}, 0, 0, 0});
  transfer.insert(transfer.end(), reply_.begin(),
                  reply_.begin() + static_cast<std::ptrdiff_t>(size));
  if (faults_.cut) transfer.pop_back();
  reply_.erase(0, size);
  requested_ = false;
  if (damage_ && !damage_(transfer)) return std::nullopt;
  transfer.resize(std::min(transfer.size(), room));
  return transfer;
}

}  // namespace luxfield::hal::usbtmc
