#include "luxfield/hal/drivers/gphoto2/raw_file.h"

#if LUXFIELD_GPHOTO2

#include <fmt/format.h>
#include <libraw/libraw.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "luxfield/hal/error.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::hal::gphoto2 {
namespace {

constexpr char kRemedy[] = "set the camera to full-size RAW ([camera.settings] in lab.toml)";

HardwareError Damaged(const std::string& device, const std::string& problem) {
  return {Fault::kIncomplete, device, "read RAW", problem, "check the cable, then resume"};
}

HardwareError NoSensorPicture(const std::string& device, const std::string& problem) {
  return {Fault::kProtocol, device, "read RAW", problem, kRemedy};
}

std::string MosaicOf(LibRaw& raw, const std::string& device) {
  const unsigned filters = raw.imgdata.idata.filters;
  if (filters == 0) return "";
  std::string cfa;
  if (filters >= 1000)  // below: Foveon, X-Trans, Leaf
    for (const int row : {0, 1})
      for (const int column : {0, 1}) cfa += raw.imgdata.idata.cdesc[raw.COLOR(row, column)];
  if (!rig::IsBayer(cfa))
    throw HardwareError(Fault::kProtocol, device, "read RAW",
                        "the sensor's mosaic is not of Bayer's",
                        "use a camera with a Bayer mosaic");
  return cfa;
}

}  // namespace

RawFile DecodeRawFile(std::string_view bytes, const std::string& device, std::size_t most_pixels) {
  const auto raw = std::make_unique<LibRaw>();  // a quarter of a megabyte
  bool damaged = false;
  raw->set_dataerror_handler(
      [](void* flag, const char*, auto) { *static_cast<bool*>(flag) = true; }, &damaged);
  const auto require = [&](int error) {
    if (error == LIBRAW_FILE_UNSUPPORTED)
      throw NoSensorPicture(device, "the camera sent a file that is no RAW");
    if (error != LIBRAW_SUCCESS || damaged)
      throw Damaged(device, damaged ? "the file is cut off" : LibRaw::strerror(error));
  };
  // The library does not write to what it reads.
  require(raw->open_buffer(const_cast<char*>(bytes.data()), bytes.size()));
  const libraw_image_sizes_t& sizes = raw->imgdata.sizes;
  if (const auto pixels = std::size_t{sizes.raw_width} * sizes.raw_height; pixels > most_pixels)
    throw HardwareError(Fault::kProtocol, device, "read RAW",
                        fmt::format("the file's sensor has {} x {} pixels, {} are expected at most",
                                    sizes.raw_width, sizes.raw_height, most_pixels),
                        "correct camera.size_px in lab.toml");
  require(raw->unpack());
  return SensorPicture(*raw, device);
}

RawFile SensorPicture(LibRaw& unpacked, const std::string& device) {
  const libraw_data_t& data = unpacked.imgdata;
  const libraw_image_sizes_t& sizes = data.sizes;
  if (!data.rawdata.raw_image)
    throw NoSensorPicture(device, "the camera sent a demosaiced or reduced picture");

  if (sizes.width == 0 || sizes.height == 0 || sizes.raw_pitch < 2u * sizes.raw_width ||
      sizes.left_margin + sizes.width > sizes.raw_width ||
      sizes.top_margin + sizes.height > sizes.raw_height)
    throw Damaged(device, "the picture that the file states is not within its sensor");

  RawFile file;
  file.cfa = MosaicOf(unpacked, device);
  const float exposure_s = data.other.shutter;
  file.exposure_s = std::isfinite(exposure_s) && exposure_s > 0 ? exposure_s : 0;
  const float temperature_c = data.makernotes.common.SensorTemperature;
  file.temperature_c = std::isfinite(temperature_c) && temperature_c > -273
                           ? temperature_c
                           : std::numeric_limits<double>::quiet_NaN();
  file.image.width = sizes.width;
  file.image.height = sizes.height;
  file.image.dn.resize(file.image.size());
  for (int row = 0; row < file.image.height; ++row) {
    const auto* from = reinterpret_cast<const std::uint8_t*>(data.rawdata.raw_image) +
                       static_cast<std::size_t>(row + sizes.top_margin) * sizes.raw_pitch;
    std::memcpy(&file.image.dn[static_cast<std::size_t>(row) * file.image.width],
                from + 2 * sizes.left_margin, 2 * static_cast<std::size_t>(file.image.width));
  }
  return file;
}

}  // namespace luxfield::hal::gphoto2

#endif
