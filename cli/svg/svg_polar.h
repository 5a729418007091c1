// A polar diagram of luminous intensity as SVG text, for reports: gamma = 0 points down, as a lamp
// hangs.
#pragma once

#include <string>
#include <vector>

namespace luxfield::cli {

struct PolarCurve {
  std::string name;
  // Signed gamma: > 0 to the right, < 0 to the left; values below 0 are drawn as 0.
  std::vector<double> gamma_deg, value;
};

struct PolarPlot {
  std::string title, unit;
  std::vector<PolarCurve> curves;
};

// A self-contained <svg> element; curves differ by colour and by dashes. Text escapes are done here.
// "no light" where no value is above 0.
std::string SvgPolar(const PolarPlot& plot);

}  // namespace luxfield::cli
