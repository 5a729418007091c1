// A grid of coloured cells as SVG text, for reports.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace luxfield::cli {

struct MapCell {
  int column = 0, row = 0;      // row 0 at the bottom
  std::optional<double> value;  // >= 0; absent: hatched
  std::string text;             // in the cell where it fits, and what a pointer over it shows
};

struct CellMap {
  std::string title;
  std::string column_label, row_label;
  std::vector<MapCell> cells;
};

// A self-contained <svg> element: white for 0 to dark for the largest value. Text escapes are done
// here.
std::string SvgMap(const CellMap& map);

}  // namespace luxfield::cli
