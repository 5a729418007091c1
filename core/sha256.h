// SHA-256 of several messages at a time; of one, and of a file: core/file.h.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::core {

constexpr std::size_t kSha256Block = 64;  // bytes
constexpr std::size_t kSha256Lanes = 8;   // messages hashed at a time; more take turns

// What is hashed: `head`, a whole number of blocks, and then `body`.
struct Sha256Message {
  std::string_view head, body;
};

// Lower-case hexadecimal SHA-256 of each message, the fastest way that this processor has.
std::vector<std::string> Sha256OfEach(std::span<const Sha256Message> messages);

// Each block of a message needs the one before it, so that vectors are no use to one message; eight
// messages fill them with a word each. Eight take two (AVX-512) or three (AVX2) times as long as
// one does in OpenSSL without SHA instructions, which are faster than either.
enum class Sha256Way { kOneByOne, kAvx2, kAvx512 };
// Those that this processor has; the fastest for eight messages first.
const std::vector<Sha256Way>& Sha256Ways();
// How many of so many messages one thread had better hash together.
std::size_t Sha256Together(std::size_t messages);
// By one of them, however few the messages are.
std::vector<std::string> Sha256OfEach(std::span<const Sha256Message> messages, Sha256Way way);

}  // namespace luxfield::core
