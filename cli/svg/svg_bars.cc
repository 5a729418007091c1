#include "luxfield/cli/svg/svg_bars.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/cli/svg/svg_plot.h"

namespace luxfield::cli {

std::string SvgBars(const std::string& title, const std::vector<Bar>& bars) {
  constexpr int kWidth = 760, kTop = 34, kRow = 22, kLabel = 130, kText = 190;
  const int height = kTop + kRow * static_cast<int>(bars.size()) + 8;
  double largest = 0;
  for (const Bar& bar : bars) largest = std::max(largest, bar.value.value_or(0));
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
      "<text x=\"8\" y=\"20\" font-size=\"14\" font-weight=\"bold\">{2}</text>\n",
      kWidth, height, EscapeXml(title));
  for (std::size_t n = 0; n < bars.size(); ++n) {
    const Bar& bar = bars[n];
    const int y = kTop + kRow * static_cast<int>(n);
    const double length =
        bar.value && largest > 0 ? *bar.value / largest * (kWidth - kLabel - kText) : 0;
    if (bar.value)
      svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\" fill=\"{}\"/>\n",
                         kLabel, y + 3, std::max(length, 0.5), kRow - 6,
                         bar.strong ? "#444" : "#4477aa");
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\"{}>{}</text>"
        "<text x=\"{:.1f}\" y=\"{}\"{}>{}</text>\n",
        kLabel - 8, y + 15, bar.strong ? " font-weight=\"bold\"" : "", EscapeXml(bar.name),
        kLabel + length + 8, y + 15, bar.value ? "" : " fill=\"#888\"", EscapeXml(bar.text));
  }
  return svg + "</svg>\n";
}

}  // namespace luxfield::cli
