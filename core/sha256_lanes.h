// The compression function of SHA-256 (FIPS 180-4, 6.2.2) on eight messages at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "luxfield/core/sha256.h"

namespace luxfield::core {

// state[n][l]: word n of the hash value of message l.
struct Sha256LaneStates {
  alignas(32) std::uint32_t word[8][kSha256Lanes];
};

// Takes `blocks` blocks of 64 bytes from each of `data` on into the states.
using Sha256LanesCompress = void(Sha256LaneStates& states,
                                 const std::array<const unsigned char*, kSha256Lanes>& data,
                                 std::size_t blocks);

#if defined(__x86_64__)
Sha256LanesCompress Sha256LanesAvx2, Sha256LanesAvx512;  // for processors that have AVX2, AVX512VL
#endif

}  // namespace luxfield::core
