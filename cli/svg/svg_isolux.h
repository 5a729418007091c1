// A map of illuminance with lines of equal values as SVG text, for reports.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace luxfield::cli {

// What is drawn over a map, in its coordinates; what lies outside is left out.
struct IsoluxMark {
  double x = 0, y = 0;
  std::string text;
  bool crossed = false;  // a cross, else a ring
};
struct IsoluxLine {
  std::vector<std::array<double, 2>> points;
  bool dashed = false;
};

struct IsoluxMap {
  std::string title, x_label, y_label, unit;
  double x0 = 0, x1 = 1, y0 = 0, y1 = 1;  // outer edges; y1 at the top
  int columns = 0, rows = 0;
  std::vector<double> values;  // [row][column] at the middles of fields, row 0 at the top
  std::vector<IsoluxMark> marks;
  std::vector<IsoluxLine> lines;
  bool outlined = true;  // lines between fields of different levels; pictures have none
};

// Levels 1, 2, 5 times powers of ten from the largest value down, at most `most` of them.
std::vector<double> IsoluxLevels(double largest, int most);

// A map of values of either sign: levels to both sides of 0, lighter the nearer to it, those below it
// bluish and with dashed lines.
std::string SvgDifference(const IsoluxMap& map);

// A self-contained <svg> element: fields shaded by level, dark to light as the light itself, lines
// between them, and a legend. Text escapes are done here. "no light" where all values are 0, "nothing
// above 0" where some are below.
std::string SvgIsolux(const IsoluxMap& map);

}  // namespace luxfield::cli
