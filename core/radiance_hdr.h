// Radiance pictures (.hdr, .pic, .rgbe): "The RADIANCE File Formats" (G. Ward, LBNL) and "Real
// Pixels" (Ward, Graphics Gems II, 1991, II.5). What is read and what is refused:
// docs/formats/environment.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/core/image.h"

namespace luxfield::core {

// The picture as seen (row 0 on top, column 0 at the left, whatever the file's scanline order),
// three channels of linear Rec. 709 in the radiance of the scene:
//
//   value = (mantissa + 0.5) / 256 * 2^(exponent - 128) / (EXPOSURE COLORCORR)
//
// and 0 where the exponent is 0.
// The half is Radiance's own: its writer truncates, so the middle of the step is unbiased. The
// worst error of the largest channel is 1/256 relative. Values reach 1.7e38: nothing is clipped.
// XYZE pixels are tristimulus values: they become Rec. 709 by the plain matrix. RGB of other
// PRIMARIES than Rec. 709's or Radiance's own is adapted to D65 (Rec709FromRgb). Of both, colours
// outside of Rec. 709 are mixed with grey (IntoGamut).
//
// Throws InputError naming file, field and value: another FORMAT, GAMMA other than 1, PRIMARIES
// that span no colours, no resolution line, more than 2^27 pixels, a run that leaves its scanline,
// a file that ends early.
Image ReadRadianceHdr(const std::filesystem::path& path);

// What the header says of R, G and B. kUnstated: nothing, or eight zeros. Such files, and those of
// Radiance's own primaries, are read as Rec. 709, which gives other luminances than Radiance's
// program would (RadianceLuminance).
enum class HdrPrimaries { kUnstated, kAsRec709, kAsRadiance, kOther, kXyz };
HdrPrimaries ReadHdrPrimaries(const std::filesystem::path& path);

// 0.265 R + 0.670 G + 0.065 B: what Radiance takes for the luminance of its own R, G, B, whose
// primaries are (0.64, 0.33), (0.29, 0.60), (0.15, 0.06) with an equal-energy white ("The RADIANCE
// File Formats"; src/common/color.h).
inline double RadianceLuminance(const Rgb& rgb) {
  return 0.265 * rgb[0] + 0.670 * rgb[1] + 0.065 * rgb[2];
}

// Writes three channels, or one three times, as plain pixels of 4 bytes, atomically: mantissas are
// truncated as the reader's half step expects, so that the largest channel of a pixel comes back
// within 1/256 and the others within 1/256 of the largest. `comments` become header lines "# ...",
// `view`, Radiance's view options, a line "VIEW= ..." where it is not empty.
// Throws InputError for values that are negative, not finite or from 2^127 on: the format has none;
// values below 2^-128 become 0. Throws DeviceError.
void WriteRadianceHdr(const std::filesystem::path& path, const Image& image,
                      const std::vector<std::string>& comments = {}, const std::string& view = {});

}  // namespace luxfield::core
