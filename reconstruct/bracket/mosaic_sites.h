// The sites of a colour mosaic: the four places of its 2 x 2 cell, row by row. The pixels of one
// site are a sensor of one colour with half the pixels each way, whose neighbours compare as those
// of a sensor without a mosaic do (EMVA 1288 R4 evaluates them likewise, the two greens apart).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::reconstruct {

// How many sites a sensor has: 4, or 1 without a mosaic, which is the whole sensor.
int SitesOf(const std::string& cfa);

// The site of the sensor's pixel (row, column).
inline int SiteOf(const std::string& cfa, int row, int column) {
  return cfa.empty() ? 0 : 2 * (row % 2) + column % 2;
}

// The colour that the k-th pixel of a mosaic sees.
int ChannelOfPixel(const rig::SensorModel& sensor, std::size_t k);

// Where pixel (row, column) of a site stands on the sensor.
inline std::pair<int, int> PixelOfSite(const std::string& cfa, int site, int row, int column) {
  if (cfa.empty()) return {row, column};
  return {2 * row + site / 2, 2 * column + site % 2};
}

// Every second value of every second row, from the site's first on.
template <typename Value>
std::vector<Value> PixelsOfSite(const std::vector<Value>& pixels, int width, int height, int site) {
  std::vector<Value> own;
  if (pixels.empty()) return own;
  own.reserve(static_cast<std::size_t>((width + 1) / 2) * ((height + 1) / 2));
  for (int row = site / 2; row < height; row += 2)
    for (int column = site % 2; column < width; column += 2)
      own.push_back(pixels[static_cast<std::size_t>(row) * width + column]);
  return own;
}

// The merged pixels of one site.
struct MergedFrame;
MergedFrame PixelsOfSite(const MergedFrame& merged, int site);

// A frame per site; a frame without a mosaic is moved.
std::vector<session::RawFrame> SplitSites(session::RawFrame frame, const std::string& cfa);

}  // namespace luxfield::reconstruct
