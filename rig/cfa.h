// Colour filter arrays: which colour a pixel of a mosaic sees.
#pragma once

#include <string>

namespace luxfield::rig {

// A Bayer pattern is its 2 x 2 cell row by row from the top left pixel on: "RGGB", "BGGR", "GRBG"
// or "GBRG".
inline bool IsBayer(const std::string& cfa) {
  return cfa == "RGGB" || cfa == "BGGR" || cfa == "GRBG" || cfa == "GBRG";
}

// 0 R, 1 G, 2 B.
inline int CfaChannel(const std::string& cfa, int row, int column) {
  const char colour = cfa[static_cast<std::size_t>(2 * (row % 2) + column % 2)];
  return colour == 'R' ? 0 : colour == 'G' ? 1 : 2;
}

}  // namespace luxfield::rig
