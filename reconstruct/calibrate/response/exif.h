// The few Exif fields that an exposure is made of (JEITA CP-3451; TIFF 6.0).
#pragma once

#include <optional>
#include <string_view>

namespace luxfield::reconstruct {

struct ExifExposure {
  std::optional<double> exposure_s;  // ExposureTime, tag 0x829A
  std::optional<double> f_number;    // FNumber, 0x829D
  std::optional<double> iso;         // PhotographicSensitivity, 0x8827
};

// From the bytes of a JPEG (APP1), TIFF or PNG (eXIf) file; fields that are absent, 0 or damaged
// stay empty, other files have none. Offsets outside the file are never followed.
ExifExposure ReadExif(std::string_view file);

}  // namespace luxfield::reconstruct
