// Line and point plots as SVG text, for reports.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace luxfield::cli {

struct Series {
  std::string name;
  std::vector<double> x, y;
  bool lines = true;  // joined points; else points alone
  // Colour and marker: series of the same style look alike. Absent: one of its own.
  std::optional<int> style{};
  bool ring = false;  // points as open rings around those of other series; grey
  bool dashed = false;
};

struct Plot {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;  // non-positive values are left out on a logarithmic axis
  std::vector<Series> series;
  int width = 640, height = 360;
};

// A self-contained <svg> element; series without a name are left out of its legend. Text escapes
// are done here. An empty plot says "no data".
std::string SvgPlot(const Plot& plot);

std::string EscapeXml(const std::string& text);

}  // namespace luxfield::cli
