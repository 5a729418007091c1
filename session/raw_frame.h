// What a camera delivers, and its file: uncompressed single-channel TIFF.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::session {

// A sensor image in native numbers (DN), row 0 on top. Exactly one of the planes is filled: `dn`
// for cameras that count in whole numbers, `value` for an ideal simulated camera without an ADC
// (session.json: camera.bits = 32).
struct RawFrame {
  int width = 0, height = 0;
  std::vector<std::uint16_t> dn;
  std::vector<float> value;

  std::size_t size() const { return static_cast<std::size_t>(width) * height; }
  float at(std::size_t pixel) const {
    return value.empty() ? static_cast<float>(dn[pixel]) : value[pixel];
  }
};

// The frame as the bytes of a TIFF file: little-endian, one strip, no compression, 16-bit unsigned
// (dn) or 32-bit IEEE samples (value). Equal frames give equal bytes: a head of whole blocks of
// SHA-256 and then the pixels as they are in memory. Throws DeviceError for a frame that is not
// `width` x `height`, or of 4 GiB.
std::string EncodeTiff(const RawFrame& frame);
std::string TiffHead(const RawFrame& frame);
std::string_view PixelBytes(const RawFrame& frame);

// The reverse; reads any byte order and strip layout. Throws InputError naming `file` for anything
// else than one complete uncompressed 16-bit unsigned or 32-bit float channel.
RawFrame DecodeTiff(std::string_view bytes, const std::string& file);

// The same of one or three interleaved channels (RGB), a frame each.
std::vector<RawFrame> DecodeTiffChannels(std::string_view bytes, const std::string& file);

}  // namespace luxfield::session
