#include "luxfield/core/exr_zip.h"

#include <libdeflate.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <new>

#include "luxfield/core/simd.h"

namespace luxfield::core {
namespace {

// As fast as level 1 on measured light; above it time doubles.
constexpr int kLevel = 4;
// A block that gets hardly smaller stays as it is: noise takes eight times as long to pack, and to
// unpack, as to copy.
constexpr double kWorthShare = 0.95;

typedef std::uint8_t Bytes16 __attribute__((vector_size(16)));

//   t[k] = t[k - 1] + d[k] - 128  (mod 256)
//
// in place, sixteen bytes at a time.
LUXFIELD_SIMD_CLONES void SumDifferences(unsigned char* bytes, std::size_t count) {
  const Bytes16 zero = {};
  std::uint8_t carry = 128;  // of the first nothing is taken off
  std::size_t k = 0;
  for (; k + sizeof(Bytes16) <= count; k += sizeof(Bytes16)) {
    Bytes16 x;
    std::memcpy(&x, bytes + k, sizeof x);
    x += 128;
    x += __builtin_shufflevector(zero, x, 0, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29,
                                 30);
    x += __builtin_shufflevector(zero, x, 0, 0, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28,
                                 29);
    x += __builtin_shufflevector(zero, x, 0, 0, 0, 0, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26,
                                 27);
    x += __builtin_shufflevector(zero, x, 0, 0, 0, 0, 0, 0, 0, 0, 16, 17, 18, 19, 20, 21, 22, 23);
    x += carry;
    std::memcpy(bytes + k, &x, sizeof x);
    carry = x[15];
  }
  for (; k < count; ++k) bytes[k] = carry = static_cast<std::uint8_t>(carry + bytes[k] - 128);
}

LUXFIELD_SIMD_CLONES void Interleave(const unsigned char* even, const unsigned char* odd,
                                     std::size_t count, unsigned char* to) {
  LUXFIELD_INDEPENDENT
  for (std::size_t k = 0; k < count; ++k) {
    to[2 * k] = even[k];
    to[2 * k + 1] = odd[k];
  }
}

LUXFIELD_SIMD_CLONES void TakeDifferences(const unsigned char* bytes, std::size_t half,
                                          unsigned char* to) {
  to[0] = bytes[0];
  to[half] = static_cast<unsigned char>(bytes[1] - bytes[2 * half - 2] + 128);
  LUXFIELD_INDEPENDENT
  for (std::size_t k = 1; k < half; ++k) {
    to[k] = static_cast<unsigned char>(bytes[2 * k] - bytes[2 * k - 2] + 128);
    to[half + k] = static_cast<unsigned char>(bytes[2 * k + 1] - bytes[2 * k - 1] + 128);
  }
}

// Bits that a byte takes of 8, coded by itself: what Huffman codes alone make of these bytes.
double CodedShare(const unsigned char* bytes, std::size_t count) {
  std::array<std::array<std::uint32_t, 256>, 4> counts{};  // side by side: equal bytes do not wait
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4)
    for (std::size_t lane = 0; lane < 4; ++lane) ++counts[lane][bytes[k + lane]];
  for (; k < count; ++k) ++counts[0][bytes[k]];
  double bits = 0;
  for (std::size_t value = 0; value < 256; ++value) {
    const double n = counts[0][value] + counts[1][value] + counts[2][value] + counts[3][value];
    if (n > 0) bits -= n * std::log2(n / static_cast<double>(count));
  }
  return bits / (8 * static_cast<double>(count));
}

// The even bytes, high ones of the pixels among them, and the odd ones are apart.
double CodedShareOfHalves(const unsigned char* halves, std::size_t half) {
  return (CodedShare(halves, half) + CodedShare(halves + half, half)) / 2;
}

}  // namespace

ExrUnzipper::ExrUnzipper(std::size_t most_bytes)
    : inflate_(libdeflate_alloc_decompressor()),
      halves_(std::make_unique_for_overwrite<unsigned char[]>(most_bytes)) {
  if (!inflate_) throw std::bad_alloc();
}

ExrUnzipper::~ExrUnzipper() { libdeflate_free_decompressor(inflate_); }

bool ExrUnzipper::Take(ExrBytes packed, std::size_t bytes) {
  // Without a place for the count, fewer bytes are an error as well.
  if (libdeflate_zlib_decompress(inflate_, packed.data(), packed.size(), halves_.get(), bytes,
                                 nullptr) != LIBDEFLATE_SUCCESS)
    return false;
  SumDifferences(halves_.get(), bytes);
  bytes_ = bytes;
  return true;
}

void ExrUnzipper::Copy(std::size_t first, std::span<unsigned char> to) const {
  Interleave(halves_.get() + first / 2, halves_.get() + (bytes_ + first) / 2, to.size() / 2,
             to.data());
}

ExrZipper::ExrZipper(std::size_t most_bytes)
    : deflate_(libdeflate_alloc_compressor(kLevel)), differences_(most_bytes), packed_(most_bytes) {
  if (!deflate_) throw std::bad_alloc();
}

ExrZipper::~ExrZipper() { libdeflate_free_compressor(deflate_); }

ExrBytes ExrZipper::Pack(ExrBytes bytes) {
  if (bytes.size() < 2) return bytes;
  TakeDifferences(bytes.data(), bytes.size() / 2, differences_.data());
  if (CodedShareOfHalves(differences_.data(), bytes.size() / 2) > kWorthShare) return bytes;
  const std::size_t size = libdeflate_zlib_compress(deflate_, differences_.data(), bytes.size(),
                                                    packed_.data(), bytes.size() - 1);
  return size == 0 ? bytes : ExrBytes(packed_.data(), size);
}

}  // namespace luxfield::core
