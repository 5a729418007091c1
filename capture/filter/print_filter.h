// A filter sheet as files for a printer: 16-bit TIFF and PDF at the printer's resolution.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "luxfield/rig/filter_sheet.h"

namespace luxfield::capture {

struct PrintOptions {
  double dpi = 1200;    // 50 to 20000
  rig::ToneTable tone;  // of the printer; empty: codes print as transmittance
};

// The sheet in codes of the printer, row 0 on top; 65535 is clear film, 0 opaque. A pixel is the
// mean over 4 x 4 points in it. Pixel (row, column) is centred on x = (column + 1/2 - width/2) 25.4
// mm / dpi, y likewise upwards: lengths are exact whatever the rounding of the sheet's edge.
struct PrintedSheet {
  int width = 0, height = 0;
  std::vector<std::uint16_t> code;
};
PrintedSheet RasteriseSheet(const rig::FilterSheet& sheet, int print, const PrintOptions& options);

// NAME.sheet.json; NAME.tif, or NAME.plus.tif and NAME.minus.tif; and NAME.pdf with a page each, 8
// bits by error diffusion, which keeps every small area's mean. Equal inputs give equal bytes.
// Returns the files. Throws InputError for options that make no sense, DeviceError where a file
// cannot be written.
std::vector<std::filesystem::path> PrintFilter(const rig::FilterSheet& sheet,
                                               const std::filesystem::path& name,
                                               const PrintOptions& options);

}  // namespace luxfield::capture
