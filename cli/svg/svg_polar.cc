#include "luxfield/cli/svg/svg_polar.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/cli/svg/svg_plot.h"

namespace luxfield::cli {
namespace {

constexpr double kSize = 480, kRadius = 180, kCentreX = kSize / 2, kCentreY = 250;
constexpr std::array kColours = {"#1f5fa8", "#c8501e", "#2f8a4c", "#555555"};
constexpr std::array kDashes = {"", "8 4", "2 3", "10 3 2 3"};

struct Place {
  double x, y;
};
Place At(double gamma_deg, double radius) {
  const double angle = gamma_deg * std::numbers::pi / 180;
  return {kCentreX + radius * std::sin(angle), kCentreY + radius * std::cos(angle)};
}

// The circles: 1, 2 or 5 times a power of ten apart, up to beyond the largest value.
double StepOf(double largest) {
  const double raw = largest / 4, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * power >= raw * (1 - 1e-9)) return step * power;
  return 10 * power;
}

std::string Grid(double step, double outermost, const std::string& unit) {
  std::string svg;
  const int circles = static_cast<int>(std::lround(outermost / step));
  for (int k = 1; k <= circles; ++k) {
    const double radius = kRadius * k * step / outermost;
    svg += fmt::format(
        "<circle cx=\"{}\" cy=\"{}\" r=\"{:.1f}\" fill=\"none\" stroke=\"#ccc\"/>"
        "<text x=\"{}\" y=\"{:.1f}\" fill=\"#444\">{:.4g}{}</text>\n",
        kCentreX, kCentreY, radius, kCentreX + 3, kCentreY - radius + 12, k * step,
        k == circles ? " " + EscapeXml(unit) : "");
  }
  for (int gamma = -150; gamma <= 180; gamma += 30) {
    const Place end = At(gamma, kRadius), label = At(gamma, kRadius + 16);
    svg += fmt::format(
        "<line x1=\"{}\" y1=\"{}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#ddd\"/>"
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}°</text>\n",
        kCentreX, kCentreY, end.x, end.y, label.x, label.y + 4, std::abs(gamma));
  }
  return svg;
}

}  // namespace

std::string SvgPolar(const PolarPlot& plot) {
  double largest = 0;
  for (const PolarCurve& curve : plot.curves)
    for (const double value : curve.value) largest = std::max(largest, value);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0}\" "
      "height=\"{1}\" fill=\"white\"/>\n<text x=\"20\" y=\"20\" font-size=\"14\" "
      "font-weight=\"bold\">{2}</text>\n",
      kSize, kSize, EscapeXml(plot.title));
  if (!(largest > 0))
    return svg + fmt::format(
                     "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">no light</text>\n"
                     "</svg>\n",
                     kCentreX, kCentreY);
  const double step = StepOf(largest), outermost = step * std::ceil(largest / step - 1e-9);
  svg += Grid(step, outermost, plot.unit);
  for (std::size_t k = 0; k < plot.curves.size(); ++k) {
    const PolarCurve& curve = plot.curves[k];
    const char* colour = kColours[k % kColours.size()];
    const char* dash = kDashes[k % kDashes.size()];
    std::string points;
    for (std::size_t i = 0; i < curve.value.size(); ++i) {
      const Place place =
          At(curve.gamma_deg[i], kRadius * std::max(0.0, curve.value[i]) / outermost);
      points += fmt::format("{:.1f},{:.1f} ", place.x, place.y);
    }
    const double y = 40 + 16 * double(k % 2), x = 20 + 220 * double(k / 2);
    svg += fmt::format(
        "<polyline points=\"{0}\" fill=\"none\" stroke=\"{1}\" stroke-width=\"1.8\" "
        "stroke-dasharray=\"{2}\"/>\n<line x1=\"{3}\" x2=\"{4}\" y1=\"{5}\" y2=\"{5}\" "
        "stroke=\"{1}\" stroke-width=\"1.8\" stroke-dasharray=\"{2}\"/><text x=\"{6}\" "
        "y=\"{7}\">{8}</text>\n",
        points, colour, dash, x, x + 28, y - 4, x + 34, y, EscapeXml(curve.name));
  }
  return svg + "</svg>\n";
}

}  // namespace luxfield::cli
