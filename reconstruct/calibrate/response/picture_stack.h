// Pictures of one scene with different exposure times, as a camera that develops them itself
// delivers them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace luxfield::reconstruct {

struct StackPicture {
  double exposure_s = 0;
  // channels planes of height x width codes, row 0 on top: R, G, B, or grey alone.
  std::vector<std::uint16_t> code;
};

struct PictureStack {
  int width = 0, height = 0, channels = 0;
  int bits = 8;                        // 8 or 16
  std::vector<StackPicture> pictures;  // shortest exposure first

  std::size_t plane_size() const { return static_cast<std::size_t>(width) * height; }
  std::span<const std::uint16_t> plane(std::size_t picture, int channel) const {
    return std::span(pictures[picture].code).subspan(plane_size() * channel, plane_size());
  }
};

// PNG, JPEG or TIFF files of 8 or 16 bits a sample, grey or colour; a fourth channel (opacity) is
// left out, a rotation that Exif asks for is not applied. `exposures_s` holds one time for each
// file; empty: their Exif ExposureTime, and then their FNumber and PhotographicSensitivity, where
// stated, must agree. Throws InputError naming the file: not readable, of another size, depth or
// number of channels than the first, without an exposure time; for fewer than `least` pictures, or
// two with one exposure time.
PictureStack ReadPictureStack(std::span<const std::filesystem::path> files,
                              std::span<const double> exposures_s, int least = 2);

}  // namespace luxfield::reconstruct
