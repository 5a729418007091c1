#include "luxfield/hal/drivers/aravis/pixel_format.h"

#include <fmt/format.h>

#include <array>

#include "luxfield/core/error.h"

namespace luxfield::hal::aravis {
namespace {

constexpr std::array kFormats = {
    PixelFormat{"Mono8", 8, Packing::kBytes},
    PixelFormat{"Mono10", 10, Packing::kWords},
    PixelFormat{"Mono12", 12, Packing::kWords},
    PixelFormat{"Mono14", 14, Packing::kWords},
    PixelFormat{"Mono16", 16, Packing::kWords},
    PixelFormat{"Mono12Packed", 12, Packing::kTwelvePacked},
    PixelFormat{"Mono12p", 12, Packing::kTwelveLsbFirst},
    PixelFormat{"BayerRG8", 8, Packing::kBytes},
    PixelFormat{"BayerGR8", 8, Packing::kBytes},
    PixelFormat{"BayerGB8", 8, Packing::kBytes},
    PixelFormat{"BayerBG8", 8, Packing::kBytes},
    PixelFormat{"BayerRG12", 12, Packing::kWords},
    PixelFormat{"BayerGR12", 12, Packing::kWords},
    PixelFormat{"BayerGB12", 12, Packing::kWords},
    PixelFormat{"BayerBG12", 12, Packing::kWords},
    PixelFormat{"BayerRG16", 16, Packing::kWords},
    PixelFormat{"BayerGR16", 16, Packing::kWords},
    PixelFormat{"BayerGB16", 16, Packing::kWords},
    PixelFormat{"BayerBG16", 16, Packing::kWords},
};

std::uint16_t Sample(const PixelFormat& format, const std::uint8_t* row, std::size_t column) {
  const std::size_t pair = column / 2 * 3;
  const bool odd = column % 2 != 0;
  unsigned value = 0;
  switch (format.packing) {
    case Packing::kBytes:
      value = row[column];
      break;
    case Packing::kWords:
      value = row[2 * column] | row[2 * column + 1] << 8;
      break;
    case Packing::kTwelvePacked:
      value = odd ? row[pair + 2] << 4 | row[pair + 1] >> 4 : row[pair] << 4 | (row[pair + 1] & 15);
      break;
    case Packing::kTwelveLsbFirst:
      value = odd ? row[pair + 1] >> 4 | row[pair + 2] << 4 : row[pair] | (row[pair + 1] & 15) << 8;
      break;
  }
  return static_cast<std::uint16_t>(value);
}

}  // namespace

std::optional<PixelFormat> FindPixelFormat(std::string_view name) {
  for (const PixelFormat& format : kFormats)
    if (format.name == name) return format;
  return {};
}

std::string PixelFormatNames() {
  std::string names;
  for (const PixelFormat& format : kFormats) {
    if (!names.empty()) names += ", ";
    names += format.name;
  }
  return names;
}

std::size_t BytesPerRow(const PixelFormat& format, int width) {
  const auto samples = static_cast<std::size_t>(width);
  switch (format.packing) {
    case Packing::kBytes:
      return samples;
    case Packing::kWords:
      return 2 * samples;
    case Packing::kTwelvePacked:
    case Packing::kTwelveLsbFirst:
      return (samples / 2) * 3 + (samples % 2) * 2;
  }
  return 0;
}

session::RawFrame Unpack(const PixelFormat& format, std::span<const std::uint8_t> bytes, int width,
                         int height, std::size_t stride) {
  const std::size_t row_bytes = BytesPerRow(format, width);
  if (width < 1 || height < 1 || stride < row_bytes ||
      bytes.size() < stride * static_cast<std::size_t>(height - 1) + row_bytes)
    throw InputError(fmt::format("a frame of {} x {} pixels {} cannot lie in {} bytes, {} a row",
                                 width, height, format.name, bytes.size(), stride));
  session::RawFrame frame;
  frame.width = width;
  frame.height = height;
  frame.dn.resize(frame.size());
  for (int row = 0; row < height; ++row) {
    const std::uint8_t* in = bytes.data() + static_cast<std::size_t>(row) * stride;
    std::uint16_t* out = frame.dn.data() + static_cast<std::size_t>(row) * width;
    for (int column = 0; column < width; ++column)
      out[column] = Sample(format, in, static_cast<std::size_t>(column));
  }
  return frame;
}

}  // namespace luxfield::hal::aravis
