// A RAW file as a still camera writes it: Adobe's Digital Negative, uncompressed, 16 bits.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace luxfield::fakes {

struct Negative {
  int width = 0, height = 0;
  std::vector<std::uint16_t> dn;
  std::string cfa;  // "RGGB" ...; empty: no mosaic
  double exposure_s = 0;
  std::string make = "Luxfield", model = "Fake";
};

std::string EncodeDng(const Negative& negative);

}  // namespace luxfield::fakes
