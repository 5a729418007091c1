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
// Headers cannot be true where the library would find another end of an attribute than its stated
// size, or where one is there twice. They need a data window and channels. Neither may compression at
// its best leave more bytes than the file has, nor the pixels take more than 512 MiB and 100 times the
// file's length: 3 MB of zeros unpack to 3 GB. Deep parts, whose pixels have any number of samples,
// are refused.
// Returns where the headers end and the tables of chunk offsets begin.
std::uint64_t CheckExrHeaders(const std::filesystem::path& path);

}  // namespace luxfield::core
