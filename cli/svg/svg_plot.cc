#include "luxfield/cli/svg/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "luxfield/core/printable.h"

namespace luxfield::cli {
namespace {

constexpr std::array kColours = {"#1f5fa8", "#c8501e", "#2f8a4c", "#8a3fa0", "#8c6d1f",
                                 "#555555", "#d0418f", "#1aa3a3", "#5b3fd0", "#a83232"};
constexpr const char* kRingColour = "#999999";
constexpr double kLegendLine = 18;

std::string Marker(int style, double x, double y, const char* colour) {
  const auto polygon = [&](std::initializer_list<std::array<double, 2>> corners) {
    std::string points;
    for (const auto& [dx, dy] : corners) points += fmt::format("{:.1f},{:.1f} ", x + dx, y + dy);
    return fmt::format("<polygon points=\"{}\" fill=\"{}\"/>", points, colour);
  };
  switch (style % 5) {
    case 1:
      return polygon({{-2.5, -2.5}, {2.5, -2.5}, {2.5, 2.5}, {-2.5, 2.5}});
    case 2:
      return polygon({{0, -3.5}, {3.5, 2.5}, {-3.5, 2.5}});
    case 3:
      return polygon({{0, -3.8}, {3.8, 0}, {0, 3.8}, {-3.8, 0}});
    case 4:
      return polygon({{0, 3.5}, {3.5, -2.5}, {-3.5, -2.5}});
    default:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\" fill=\"{}\"/>", x, y,
                         colour);
  }
}

std::string Ring(double x, double y) {
  return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"6\" fill=\"none\" stroke=\"{}\"/>", x,
                     y, kRingColour);
}

// Of a line with more points than can be told apart there is the line alone.
bool ShowsMarkers(const Series& series) { return !series.lines || series.x.size() < 60; }

std::string Dashes(const Series& series) {
  return series.dashed ? " stroke-dasharray=\"6 3\"" : "";
}

// A piece of the line, for the legend.
std::string Stroke(const Series& series, double x, double y, const char* colour) {
  return fmt::format(
      "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
      "stroke-width=\"1.5\"{}/>",
      x - 9, x + 12, y, y, colour, Dashes(series));
}

// Where each named series stands in the legend between title and frame: lines of them.
struct Place {
  double x = 0, y = 0;
};
std::vector<Place> LegendPlaces(const Plot& plot, double left, double right) {
  std::vector<Place> places;
  Place next{left, 41};
  for (const auto& series : plot.series) {
    const double width = 40 + 7.0 * static_cast<double>(series.name.size());
    if (next.x > left && next.x + width > right) next = {left, next.y + kLegendLine};
    places.push_back(next);
    if (!series.name.empty()) next.x += width;
  }
  return places;
}

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

std::string EscapeXml(const std::string& text) { return core::EscapedMarkup(core::Visible(text)); }

std::string SvgPlot(const Plot& plot) {
  const double left = 70, right = plot.width - 30, bottom = plot.height - 48;
  const auto legend = LegendPlaces(plot, left, right);
  const double top = 15 + (legend.empty() ? 41 : legend.back().y);
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
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const Series& series = plot.series[k];
    const int style = series.style.value_or(static_cast<int>(k));
    const char* colour = series.ring ? kRingColour : kColours[style % kColours.size()];
    std::string points, markers;
    for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
      if (!x.Shows(series.x[i]) || !y.Shows(series.y[i])) continue;
      any = true;
      const double px = x.Pixel(series.x[i]), py = y.Pixel(series.y[i]);
      points += fmt::format("{:.1f},{:.1f} ", px, py);
      markers += series.ring ? Ring(px, py) : Marker(style, px, py, colour);
    }
    if (series.lines)
      svg += fmt::format(
          "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"{}/>\n", points,
          colour, Dashes(series));
    if (ShowsMarkers(series)) svg += markers + "\n";
    if (!series.name.empty()) {
      const auto& [lx, ly] = legend[k];
      svg += fmt::format("{}<text x=\"{:.0f}\" y=\"{:.0f}\">{}</text>\n",
                         series.ring            ? Ring(lx + 5, ly)
                         : ShowsMarkers(series) ? Marker(style, lx + 5, ly, colour)
                                                : Stroke(series, lx, ly, colour),
                         lx + 15, ly + 4, EscapeXml(series.name));
    }
  }
  if (!any)
    svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">no data</text>\n",
                       (left + right) / 2, (top + bottom) / 2);
  return svg + "</svg>\n";
}

}  // namespace luxfield::cli
