// The solid of luminous intensity: in every direction as far from the middle as the intensity is large,
// as SVG text, for reports. The lamp's +z axis points down, as a lamp hangs.
#pragma once

#include <string>
#include <vector>

namespace luxfield::cli {

struct IntensitySolid {
  std::string title, unit;
  std::vector<double> c_deg, gamma_deg;  // evenly, C all around
  std::vector<double> value;             // [plane][angle]; below 0 drawn as 0
};

// A self-contained <svg> element, drawn from above and aside without perspective, faces hidden by
// those before them. "no light" where no value is above 0.
std::string SvgSolid(const IntensitySolid& solid);

}  // namespace luxfield::cli
