// RAW files of still cameras as the sensor's own numbers, through LibRaw.
#pragma once

#include <string>
#include <string_view>

#include "core/raw_frame.h"

namespace luxfield::hal::gphoto2 {

struct RawFile {
  core::RawFrame image;      // the visible pixels, unscaled and with their black level
  std::string cfa;           // core/cfa.h; empty: no mosaic
  double exposure_s = 0;     // as the file says; 0: it does not
  double temperature_c = 0;  // of the sensor; NaN: the file does not say
};

// Throws HardwareError, in the name of `device`: kIncomplete for a file that is cut off or damaged,
// kProtocol for one that is no picture of a sensor (JPEG, sRAW, demosaiced) or whose mosaic is not
// of Bayer's.
RawFile DecodeRawFile(std::string_view bytes, const std::string& device);

}  // namespace luxfield::hal::gphoto2
