// USBTMC's messages (USB Test and Measurement Class 1.0, 3.2 and 3.3): pure bytes, no device.
//
// Every message begins with 12 bytes: MsgID, bTag (1 to 255), ~bTag, 0, then by message; numbers
// are little-endian. Payloads are padded with zeros to a multiple of 4.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::hal::usbtmc {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kHeaderBytes = 12;

// DEV_DEP_MSG_OUT; `end`: the message ends with this payload.
Bytes EncodeMessage(std::uint8_t tag, std::string_view payload, bool end = true);
// REQUEST_DEV_DEP_MSG_IN for at most max_size payload bytes.
Bytes EncodeRequest(std::uint8_t tag, std::uint32_t max_size);

// The tag after this one: 1 to 255, never 0.
inline std::uint8_t NextTag(std::uint8_t tag) {
  return tag == 255 ? std::uint8_t{1} : static_cast<std::uint8_t>(tag + 1);
}

// The header of DEV_DEP_MSG_IN.
struct ReplyHeader {
  std::uint32_t size = 0;  // of the payload in this transfer
  bool end = false;        // of the message
  std::string problem;     // empty: it is the answer to the request; else what is wrong
};
// `any_tag`: for instruments that answer with a stale tag. A header that claims more than max_size
// is a problem.
ReplyHeader ParseReply(std::span<const std::uint8_t> transfer, std::uint8_t tag,
                       std::uint32_t max_size, bool any_tag = false);

}  // namespace luxfield::hal::usbtmc
