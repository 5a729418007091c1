// GenICam pixel formats of one sample a pixel as 16-bit numbers (PFNC 2.4; GigE Vision 2.0).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/session/raw_frame.h"

namespace luxfield::hal::aravis {

enum class Packing {
  kBytes,           // 8 bits
  kWords,           // up to 16 bits, little-endian, in the low bits of a word
  kTwelvePacked,    // GigE Vision's Mono12Packed: 3 bytes, the middle one holds both low nibbles
  kTwelveLsbFirst,  // PFNC's Mono12p: a continuous stream of bits
};

struct PixelFormat {
  std::string_view name;  // as the camera spells it
  int bits = 0;
  Packing packing = Packing::kBytes;
};

// Mono and Bayer formats of 8 to 16 bits; absent for any other. Bayer frames stay mosaics.
std::optional<PixelFormat> FindPixelFormat(std::string_view name);
// "Mono8, Mono10, ...", for messages.
std::string PixelFormatNames();

// Bytes of one row without padding; rows of packed formats are padded to whole bytes.
std::size_t BytesPerRow(const PixelFormat& format, int width);

// Rows of `stride` bytes each. Throws InputError where `bytes` holds less than height rows.
session::RawFrame Unpack(const PixelFormat& format, std::span<const std::uint8_t> bytes, int width,
                         int height, std::size_t stride);

}  // namespace luxfield::hal::aravis
