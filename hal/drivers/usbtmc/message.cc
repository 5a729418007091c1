#include "luxfield/hal/drivers/usbtmc/message.h"

#include <fmt/format.h>

namespace luxfield::hal::usbtmc {
namespace {

constexpr std::uint8_t kMessageOut = 1, kRequestIn = 2, kReplyIn = 2;
constexpr std::uint8_t kEndOfMessage = 1;

Bytes Header(std::uint8_t id, std::uint8_t tag, std::size_t size, std::uint8_t attributes) {
  Bytes bytes = {id, tag, static_cast<std::uint8_t>(~tag), 0};
  for (int shift = 0; shift < 32; shift += 8)
    bytes.push_back(static_cast<std::uint8_t>(size >> shift));
  bytes.insert(bytes.end(), {attributes, 0, 0, 0});
  return bytes;
}

}  // namespace

Bytes EncodeMessage(std::uint8_t tag, std::string_view payload, bool end) {
  Bytes bytes = Header(kMessageOut, tag, payload.size(), end ? kEndOfMessage : std::uint8_t{0});
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  bytes.resize((bytes.size() + 3) / 4 * 4);
  return bytes;
}

Bytes EncodeRequest(std::uint8_t tag, std::uint32_t max_size) {
  return Header(kRequestIn, tag, max_size, 0);
}

ReplyHeader ParseReply(std::span<const std::uint8_t> transfer, std::uint8_t tag,
                       std::uint32_t max_size, bool any_tag) {
  ReplyHeader header;
  if (transfer.size() < kHeaderBytes) {
    header.problem = fmt::format("a reply of {} bytes has no header", transfer.size());
    return header;
  }
  for (std::size_t k = 0; k < 4; ++k)
    header.size |= static_cast<std::uint32_t>(transfer[4 + k]) << (8 * k);
  header.end = transfer[8] & kEndOfMessage;
  if (transfer[0] != kReplyIn)
    header.problem = fmt::format("message {} came instead of a reply", transfer[0]);
  else if ((transfer[1] ^ transfer[2]) != 0xff)
    header.problem = fmt::format("its tag 0x{:02x} contradicts 0x{:02x}", transfer[1], transfer[2]);
  else if (!any_tag && transfer[1] != tag)
    header.problem = fmt::format("the reply to request {} came for request {}", transfer[1], tag);
  else if (header.size > max_size)
    header.problem = fmt::format("a reply of {} bytes, {} were asked for", header.size, max_size);
  return header;
}

}  // namespace luxfield::hal::usbtmc
