// The sites of a colour mosaic: the four places of its 2 x 2 cell, row by row. The pixels of one
// site are a sensor of one colour with half the pixels each way, whose neighbours compare as those
// of a sensor without a mosaic do (EMVA 1288 R4 evaluates them likewise, the two greens apart).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/raw_frame.h"

namespace luxfield::reconstruct {

// `cfa` of the "camera" object of `file` (core/cfa.h); empty: no mosaic. Throws InputError for an
// unknown one.
std::string ReadCfa(const nlohmann::json& camera, const std::string& file);

// How many sites a sensor has: 4, or 1 without a mosaic, which is the whole sensor.
int SitesOf(const std::string& cfa);

// Where pixel (row, column) of a site stands on the sensor.
inline std::pair<int, int> PixelOfSite(const std::string& cfa, int site, int row, int column) {
  if (cfa.empty()) return {row, column};
  return {2 * row + site / 2, 2 * column + site % 2};
}

// A frame per site; a frame without a mosaic is moved.
std::vector<core::RawFrame> SplitSites(core::RawFrame frame, const std::string& cfa);

}  // namespace luxfield::reconstruct
