// Fuzz targets: a file from a still camera, and what LibRaw makes of one.
#pragma once

#include <libraw/libraw.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "luxfield/hal/drivers/gphoto2/decoder_process.h"
#include "luxfield/hal/drivers/gphoto2/raw_file.h"
#include "luxfield/hal/error.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::fuzz {

constexpr std::size_t kMostPixels = 1 << 14;

inline void RequireFrame(const hal::gphoto2::RawFile& raw) {
  const session::RawFrame& image = raw.image;
  if (image.width < 1 || image.height < 1 || image.size() > kMostPixels ||
      image.dn.size() != image.size() || !(raw.cfa.empty() || rig::IsBayer(raw.cfa)) ||
      !std::isfinite(raw.exposure_s) || raw.exposure_s < 0 || std::isinf(raw.temperature_c))
    std::abort();
}

// A file of any content ends in a frame within the bound or a HardwareError, whatever it does to
// LibRaw. That runs in another process: the fuzzer sees of it only what the answer was.
inline void StillCameraFile(std::string_view input) {
  constexpr double kWithin_s = 20;
  try {
    RequireFrame(hal::gphoto2::DecodeApart(
        [&] { return hal::gphoto2::DecodeRawFile(input, "camera", kMostPixels); }, "camera",
        kMostPixels, kWithin_s));
  } catch (const hal::HardwareError&) {
  }
}

// The input stands for what LibRaw found: sizes, mosaic, exposure, temperature, as many pixels as
// the sensor has.
inline void StillCameraPicture(std::string_view input) {
  const auto take = [&](auto& field) {
    const std::size_t size = std::min(sizeof field, input.size());
    std::memcpy(&field, input.data(), size);
    input.remove_prefix(size);
  };
  static LibRaw& raw = *new LibRaw;  // a quarter of a megabyte
  libraw_image_sizes_t& sizes = raw.imgdata.sizes;
  sizes = {};
  raw.imgdata.idata.filters = 0;
  raw.imgdata.other.shutter = 0;
  take(sizes.width);
  take(sizes.height);
  take(sizes.left_margin);
  take(sizes.top_margin);
  take(sizes.raw_width);
  take(sizes.raw_height);
  take(sizes.raw_pitch);
  take(raw.imgdata.idata.filters);
  take(raw.imgdata.idata.cdesc);
  take(raw.imgdata.other.shutter);
  take(raw.imgdata.makernotes.common.SensorTemperature);
  if (std::size_t{sizes.raw_width} * sizes.raw_height > kMostPixels) return;  // refused before
  sizes.raw_pitch %= 4 * sizes.raw_width + 1u;
  std::vector<std::uint16_t> pixels(std::size_t{sizes.raw_pitch} * sizes.raw_height / 2);
  raw.imgdata.rawdata.raw_image = pixels.empty() ? nullptr : pixels.data();
  try {
    RequireFrame(hal::gphoto2::SensorPicture(raw, "camera"));
  } catch (const hal::HardwareError&) {
  }
  raw.imgdata.rawdata.raw_image = nullptr;
}

}  // namespace luxfield::fuzz
