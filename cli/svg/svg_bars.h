// Horizontal bars as SVG text, for reports.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace luxfield::cli {

struct Bar {
  std::string name;
  std::optional<double> value;  // absent: `text` alone, no bar
  std::string text;             // behind the bar
  bool strong = false;          // a sum of the others
};

// A self-contained <svg> element; bars from 0, all values >= 0.
std::string SvgBars(const std::string& title, const std::vector<Bar>& bars);

}  // namespace luxfield::cli
