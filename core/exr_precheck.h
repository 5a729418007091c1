// What an OpenEXR header claims, held against the length of the file, before the library allocates
// by it. Internal to core/.
#pragma once

#include <cstdint>
#include <filesystem>

namespace luxfield::core {

// No image of ours comes near 2^28 pixels.
inline constexpr double kMaxExrPixelsPerPart = 0x1p28;

// Throws InputError naming the file if it is no OpenEXR file, or if its headers cannot be true for a
// file of this length ("OpenEXR File Layout": magic, version, headers of name\0 type\0 size value,
// offset tables of 8 bytes a chunk). The library would reserve gigabytes first and find out later.
// That is where
//   * it and the library would not agree on where an attribute ends, as of a list of channels that
//     goes on behind the size it states, or an attribute is there twice;
//   * the data window or the channels are missing;
//   * compression at its best would leave more bytes than the file has;
//   * the pixels would take more than 512 MiB and 100 times the file's length: 3 MB of zeros unpack
//     to 3 GB;
//   * parts are deep, whose pixels may have any number of samples.
// Returns where the headers end and the tables of chunk offsets begin.
std::uint64_t CheckExrHeaders(const std::filesystem::path& path);

}  // namespace luxfield::core
