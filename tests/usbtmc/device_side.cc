#include "tests/usbtmc/device_side.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace luxfield::hal::usbtmc {

std::optional<DeviceSide::Bytes> DeviceSide::Control(const std::uint8_t* request) {
  const auto is = [request](int type, int number) {
    return request[0] == type && request[1] == number;
  };
  const auto status = [](std::size_t size) {
    Bytes answer(size, 0);
    answer[0] = 1;  // STATUS_SUCCESS
    return answer;
  };
  if (is(0xa1, 7)) return status(24);
  if (is(0xa1, 6)) return status(2);
  if (is(0xa2, 1)) return status(2);
  if (is(0xa2, 2) || is(0xa2, 4)) return status(8);
  if (!is(0xa1, 5) && !is(0xa2, 3)) return std::nullopt;
  reply_.clear();
  sent_ = 0;
  requested_ = false;
  if (is(0xa1, 5)) {
    ++clears_;
    faults.mute = faults.mute || faults.dies_of_clear;
    return status(1);
  }
  ++aborts_;
  return Bytes{1, tag_};
}

bool DeviceSide::Out(const std::uint8_t* bytes, std::size_t size) {
  if (faults.stall_out) return false;
  if (size < 12 || (bytes[1] ^ bytes[2]) != 0xff || bytes[1] == 0) return true;
  std::uint32_t length = 0;
  std::memcpy(&length, bytes + 4, 4);
  tag_before_ = std::exchange(tag_, bytes[1]);
  if (bytes[0] == 1 && size == (12 + length + 3) / 4 * 4) {
    sent_ = 0;
    messages_.emplace_back(reinterpret_cast<const char*>(bytes) + 12, length);
    reply_ = answer_(messages_.back());  // one that nobody has read is gone, as IEEE 488.2 says
  } else if (bytes[0] == 2) {
    requested_ = true;
    room_ = length;
  }
  return true;
}

DeviceSide::Bytes DeviceSide::Header(std::size_t size, bool end) const {
  const std::uint8_t tag = faults.stale_tag ? tag_before_ : tag_;
  Bytes header = {2, tag, static_cast<std::uint8_t>(~tag), 0};
  for (int shift = 0; shift < 32; shift += 8)
    header.push_back(static_cast<std::uint8_t>(size >> shift));
  header.insert(header.end(), {std::uint8_t{end}, 0, 0, 0});
  return header;
}

std::optional<DeviceSide::Bytes> DeviceSide::InWithOneHeader() {
  if (!requested_ && sent_ == 0) return std::nullopt;
  Bytes transfer;
  if (requested_) {
    transfer = Header(reply_.size(), true);
    sent_ = 0;
    requested_ = false;
  }
  const std::size_t size = std::min(reply_.size() - sent_, faults.at_once);
  const auto begin = reply_.begin() + static_cast<std::ptrdiff_t>(sent_);
  transfer.insert(transfer.end(), begin, begin + static_cast<std::ptrdiff_t>(size));
  sent_ += size;
  if (sent_ == reply_.size()) {
    reply_.clear();
    sent_ = 0;
  }
  if (damage && !damage(transfer)) return std::nullopt;
  return transfer;
}

std::optional<DeviceSide::Bytes> DeviceSide::In() {
  if (faults.mute || reply_.empty()) return std::nullopt;
  if (faults.one_header) return InWithOneHeader();
  if (!requested_) return std::nullopt;
  const std::size_t size = std::min<std::size_t>({reply_.size(), room_, faults.at_once});
  Bytes transfer = Header(size, size == reply_.size());
  transfer.insert(transfer.end(), reply_.begin(),
                  reply_.begin() + static_cast<std::ptrdiff_t>(size));
  if (faults.cut) transfer.pop_back();
  reply_.erase(0, size);
  requested_ = false;
  if (damage && !damage(transfer)) return std::nullopt;
  return transfer;
}

}  // namespace luxfield::hal::usbtmc
