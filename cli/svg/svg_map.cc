#include "luxfield/cli/svg/svg_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/cli/svg/svg_plot.h"

namespace luxfield::cli {
namespace {

constexpr double kLeft = 34, kTop = 34, kBottom = 30, kRoom = 300;  // px
constexpr double kLargestCell = 44, kTextCell = 26;

// White to dark orange; half way the cell's text turns white.
std::string Colour(double share) {
  const auto mix = [share](double from, double to) {
    return static_cast<int>(std::lround(from + (to - from) * share));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(255, 168), mix(255, 62), mix(255, 18));
}

}  // namespace

std::string SvgMap(const CellMap& map) {
  int columns = 1, rows = 1;
  double largest = 0;
  std::string most;
  for (const MapCell& cell : map.cells) {
    columns = std::max(columns, cell.column + 1);
    rows = std::max(rows, cell.row + 1);
    if (cell.value.value_or(0) > largest) {
      largest = *cell.value;
      most = cell.text;
    }
  }
  const double size = std::min(kLargestCell, kRoom / std::max(columns, rows));
  const double width = std::max(kLeft + columns * size + 8,
                                kLeft + 10 + 8.8 * static_cast<double>(map.title.size()));
  const double height = kTop + rows * size + kBottom;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<defs><pattern id=\"hatch\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" "
      "patternTransform=\"rotate(45)\"><rect width=\"6\" height=\"6\" fill=\"#f4f4f4\"/><line "
      "y2=\"6\" stroke=\"#bbb\" stroke-width=\"2\"/></pattern></defs>\n"
      "<rect width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"white\"/>\n"
      "<text x=\"{2}\" y=\"20\" font-size=\"14\" font-weight=\"bold\">{3}</text>\n",
      width, height, kLeft, EscapeXml(map.title));
  for (const MapCell& cell : map.cells) {
    const double x = kLeft + cell.column * size, y = kTop + (rows - 1 - cell.row) * size;
    const double share = cell.value && largest > 0 ? *cell.value / largest : 0;
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" "
        "stroke=\"{}\" stroke-width=\"0.5\"><title>{} {}, {} {}: {}</title></rect>\n",
        x, y, size, size, cell.value ? Colour(share) : "url(#hatch)",
        size < kTextCell ? "none" : "#999", EscapeXml(map.column_label), cell.column,
        EscapeXml(map.row_label), cell.row, EscapeXml(cell.text));
    if (size >= kTextCell && 6.2 * static_cast<double>(cell.text.size()) < size)
      svg += fmt::format(
          "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" font-size=\"10\" "
          "fill=\"{}\">{}</text>\n",
          x + 0.5 * size, y + 0.5 * size + 4, share > 0.5 ? "white" : "#333", EscapeXml(cell.text));
  }
  svg += fmt::format(
      "<rect x=\"{}\" y=\"{}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
      "stroke=\"#999\"/>\n",
      kLeft, kTop, columns * size, rows * size);
  svg += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\">{} 0 to {}{}</text>"
      "<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\">{} 0 to {}</text>\n",
      kLeft, kTop + rows * size + 18, EscapeXml(map.column_label), columns - 1,
      most.empty() ? "; all 0" : "; darkest: " + EscapeXml(most), kLeft - 10, kTop + rows * size,
      EscapeXml(map.row_label), rows - 1);
  return svg + "</svg>\n";
}

}  // namespace luxfield::cli
