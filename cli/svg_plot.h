// Line and point plots as SVG text, for reports.
#pragma once

#include <string>
#include <vector>

namespace luxfield::cli {

struct Series {
  std::string name;
  std::vector<double> x, y;
  bool lines = true;  // joined points; else points alone
};

struct Plot {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;  // non-positive values are left out on a logarithmic axis
  std::vector<Series> series;
  int width = 640, height = 360;
};

// A self-contained <svg> element. Text escapes are done here. An empty plot says "no data".
std::string SvgPlot(const Plot& plot);

std::string EscapeXml(const std::string& text);

}  // namespace luxfield::cli
