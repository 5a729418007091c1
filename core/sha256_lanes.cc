#include "luxfield/core/sha256_lanes.h"

#if defined(__x86_64__)

#include <cstring>

#define LUXFIELD_LANES static inline __attribute__((always_inline))

namespace luxfield::core {

// A word of every message; GCC's and Clang's own vectors, of which they know that AVX-512 rotates
// and combines three operands bit by bit in one instruction.
using Words = std::uint32_t __attribute__((vector_size(4 * kSha256Lanes)));
using Bytes = std::uint8_t __attribute__((vector_size(4 * kSha256Lanes)));

// FIPS 180-4, 4.2.2.
constexpr std::uint32_t kRound[64] = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

LUXFIELD_LANES Words Rotated(Words x, int n) { return (x >> n) | (x << (32 - n)); }

// 4.1.2, by the standard's names.
LUXFIELD_LANES Words Ch(Words x, Words y, Words z) { return z ^ (x & (y ^ z)); }
LUXFIELD_LANES Words Maj(Words x, Words y, Words z) { return (x & y) | (z & (x | y)); }
LUXFIELD_LANES Words Sum0(Words x) { return Rotated(x, 2) ^ Rotated(x, 13) ^ Rotated(x, 22); }
LUXFIELD_LANES Words Sum1(Words x) { return Rotated(x, 6) ^ Rotated(x, 11) ^ Rotated(x, 25); }
LUXFIELD_LANES Words Sigma0(Words x) { return Rotated(x, 7) ^ Rotated(x, 18) ^ (x >> 3); }
LUXFIELD_LANES Words Sigma1(Words x) { return Rotated(x, 17) ^ Rotated(x, 19) ^ (x >> 10); }

// Of the words, stored big-endian.
LUXFIELD_LANES Words FromBigEndian(Words x) {
  const Bytes b = (Bytes)x;
  return (Words)__builtin_shufflevector(b, b, 3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12,
                                        19, 18, 17, 16, 23, 22, 21, 20, 27, 26, 25, 24, 31, 30, 29,
                                        28);
}

// The next eight words of each message, transposed: word n of all messages in `to[n]`. A shuffle
// rotates the six bits of (row, column) by one, so that three of them exchange row and column.
LUXFIELD_LANES void Load(const std::array<const unsigned char*, kSha256Lanes>& data,
                         std::size_t offset, Words* to) {
  Words rows[8];
#pragma GCC unroll 8
  for (std::size_t l = 0; l < kSha256Lanes; ++l)
    std::memcpy(&rows[l], data[l] + offset, sizeof rows[l]);
#pragma GCC unroll 3
  for (int shuffle = 0; shuffle < 3; ++shuffle) {
    Words next[8];
#pragma GCC unroll 4
    for (int n = 0; n < 4; ++n) {
      next[2 * n] = __builtin_shufflevector(rows[n], rows[n + 4], 0, 8, 1, 9, 2, 10, 3, 11);
      next[2 * n + 1] = __builtin_shufflevector(rows[n], rows[n + 4], 4, 12, 5, 13, 6, 14, 7, 15);
    }
#pragma GCC unroll 8
    for (int n = 0; n < 8; ++n) rows[n] = next[n];
  }
#pragma GCC unroll 8
  for (int n = 0; n < 8; ++n) to[n] = FromBigEndian(rows[n]);
}

// 6.2.2.
LUXFIELD_LANES void Compress(Sha256LaneStates& states,
                             const std::array<const unsigned char*, kSha256Lanes>& data,
                             std::size_t blocks) {
  Words hash[8];
  std::memcpy(hash, states.word, sizeof hash);
  for (std::size_t block = 0; block < blocks; ++block) {
    Words w[16];
    Load(data, 64 * block, w);
    Load(data, 64 * block + 32, w + 8);
    Words a = hash[0], b = hash[1], c = hash[2], d = hash[3], e = hash[4], f = hash[5], g = hash[6],
          h = hash[7];
#pragma GCC unroll 64
    for (int t = 0; t < 64; ++t) {
      Words& now = w[t % 16];
      if (t >= 16) now += Sigma1(w[(t + 14) % 16]) + w[(t + 9) % 16] + Sigma0(w[(t + 1) % 16]);
      const Words t1 = h + Sum1(e) + Ch(e, f, g) + kRound[t] + now, t2 = Sum0(a) + Maj(a, b, c);
      h = g, g = f, f = e, e = d + t1;
      d = c, c = b, b = a, a = t1 + t2;
    }
    hash[0] += a, hash[1] += b, hash[2] += c, hash[3] += d;
    hash[4] += e, hash[5] += f, hash[6] += g, hash[7] += h;
  }
  std::memcpy(states.word, hash, sizeof hash);
}

__attribute__((target("avx2"))) void Sha256LanesAvx2(
    Sha256LaneStates& states, const std::array<const unsigned char*, kSha256Lanes>& data,
    std::size_t blocks) {
  Compress(states, data, blocks);
}

__attribute__((target("avx512vl"))) void Sha256LanesAvx512(
    Sha256LaneStates& states, const std::array<const unsigned char*, kSha256Lanes>& data,
    std::size_t blocks) {
  Compress(states, data, blocks);
}

}  // namespace luxfield::core

#endif
