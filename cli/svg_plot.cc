#include "cli/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace luxfield::cli {
namespace {

constexpr std::array kColours = {"#1f5fa8", "#c8501e", "#2f8a4c", "#8a3fa0", "#8c6d1f", "#555555"};

struct Axis {
  double low = 0, high = 1;
  bool logarithmic = false;
  double pixel_low = 0, pixel_high = 1;

  double Map(double value) const { return logarithmic ? std::log10(value) : value; }
  bool Shows(double value) const { return std::isfinite(value) && (!logarithmic || value > 0); }
  double Pixel(double value) const {
    return pixel_low + (Map(value) - low) / (high - low) * (pixel_high - pixel_low);
  }
};

// Limits in mapped (maybe logarithmic) units, rounded outwards to whole ticks.
Axis MakeAxis(const std::vector<const std::vector<double>*>& columns, bool logarithmic,
              double pixel_low, double pixel_high) {
  Axis axis{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
            logarithmic, pixel_low, pixel_high};
  for (const auto* column : columns)
    for (const double value : *column)
      if (axis.Shows(value)) {
        axis.low = std::min(axis.low, axis.Map(value));
        axis.high = std::max(axis.high, axis.Map(value));
      }
  if (!(axis.low <= axis.high)) axis.low = 0, axis.high = 1;
  if (axis.high - axis.low < 1e-12 * std::max(1.0, std::abs(axis.high)))
    axis.low -= 0.5, axis.high += 0.5;
  if (logarithmic) {
    axis.low = std::floor(axis.low + 1e-9);
    axis.high = std::ceil(axis.high - 1e-9);
  }
  return axis;
}

std::vector<double> Ticks(const Axis& axis) {
  std::vector<double> ticks;
  if (axis.logarithmic) {
    const int step = std::max(1, static_cast<int>((axis.high - axis.low) / 8));
    for (int decade = static_cast<int>(axis.low); decade <= static_cast<int>(axis.high);
         decade += step)
      ticks.push_back(std::pow(10.0, decade));
    return ticks;
  }
  const double raw = (axis.high - axis.low) / 5;
  const double magnitude = std::pow(10.0, std::floor(std::log10(raw)));
  const double ratio = raw / magnitude;
  const double step = magnitude * (ratio < 1.5 ? 1 : ratio < 3.5 ? 2 : ratio < 7.5 ? 5 : 10);
  const double first = std::ceil(axis.low / step - 1e-9);
  const double last = std::floor(axis.high / step + 1e-9);
  for (int k = 0; k <= static_cast<int>(last - first); ++k) ticks.push_back((first + k) * step);
  return ticks;
}

}  // namespace

std::string EscapeXml(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string SvgPlot(const Plot& plot) {
  const double left = 70, right = plot.width - 16, top = 56, bottom = plot.height - 48;
  std::vector<const std::vector<double>*> xs, ys;
  for (const auto& series : plot.series) {
    xs.push_back(&series.x);
    ys.push_back(&series.y);
  }
  const Axis x = MakeAxis(xs, plot.log_x, left, right);
  const Axis y = MakeAxis(ys, plot.log_y, bottom, top);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0}\" height=\"{1}\" "
      "fill=\"white\"/>\n"
      "<text x=\"{2}\" y=\"20\" font-size=\"14\" font-weight=\"bold\">{3}</text>\n",
      plot.width, plot.height, left, EscapeXml(plot.title));
  for (const double tick : Ticks(x))
    svg += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#ddd\"/>"
        "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:.4g}</text>\n",
        x.Pixel(tick), top, bottom, bottom + 16, tick);
  for (const double tick : Ticks(y))
    svg += fmt::format(
        "<line x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" stroke=\"#ddd\"/>"
        "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.4g}</text>\n",
        y.Pixel(tick), left, right, left - 6, y.Pixel(tick) + 4, tick);
  svg += fmt::format(
      "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444\"/>\n", left,
      top, right - left, bottom - top);
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                     (left + right) / 2, plot.height - 12, EscapeXml(plot.x_label));
  svg += fmt::format(
      "<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      (top + bottom) / 2, EscapeXml(plot.y_label));
  bool any = false;
  double legend_x = left;
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const Series& series = plot.series[k];
    const char* colour = kColours[k % kColours.size()];
    std::string points, circles;
    for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
      if (!x.Shows(series.x[i]) || !y.Shows(series.y[i])) continue;
      any = true;
      points += fmt::format("{:.1f},{:.1f} ", x.Pixel(series.x[i]), y.Pixel(series.y[i]));
      circles += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\" fill=\"{}\"/>",
                             x.Pixel(series.x[i]), y.Pixel(series.y[i]), colour);
    }
    if (series.lines)
      svg += fmt::format(
          "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", points,
          colour);
    if (!series.lines || series.x.size() < 60) svg += circles + "\n";
    if (!series.name.empty()) {  // the legend, in one line between title and frame
      svg += fmt::format(
          "<rect x=\"{:.0f}\" y=\"36\" width=\"10\" height=\"10\" fill=\"{}\"/><text x=\"{:.0f}\" "
          "y=\"45\">{}</text>\n",
          legend_x, colour, legend_x + 15, EscapeXml(series.name));
      legend_x += 40 + 7.0 * static_cast<double>(series.name.size());
    }
  }
  if (!any)
    svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">no data</text>\n",
                       (left + right) / 2, (top + bottom) / 2);
  return svg + "</svg>\n";
}

}  // namespace luxfield::cli
