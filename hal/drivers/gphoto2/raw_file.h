// RAW files of still cameras as the sensor's own numbers, through LibRaw.
#pragma once

#include <string>
#include <string_view>

#include "luxfield/session/raw_frame.h"

class LibRaw;

namespace luxfield::hal::gphoto2 {

struct RawFile {
  session::RawFrame image;   // the visible pixels, unscaled and with their black level
  std::string cfa;           // rig/cfa.h; empty: no mosaic
  double exposure_s = 0;     // as the file says; 0: it does not
  double temperature_c = 0;  // of the sensor; NaN: the file does not say
};

// Throws HardwareError, in the name of `device`: kIncomplete for a file that is cut off or damaged,
// kProtocol for one that is no picture of a sensor (JPEG, sRAW, demosaiced), whose mosaic is not
// of Bayer's, or whose sensor has more than `most_pixels`, masked borders included: that is refused
// before memory is taken for them. There are bytes that bring LibRaw and so the process down:
// decoder_process.h.
RawFile DecodeRawFile(std::string_view bytes, const std::string& device, std::size_t most_pixels);

// The last step of it: what a file holds that LibRaw has unpacked. Throws likewise, kIncomplete
// where the visible picture is not within the sensor.
RawFile SensorPicture(LibRaw& unpacked, const std::string& device);

}  // namespace luxfield::hal::gphoto2
