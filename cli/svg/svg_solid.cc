#include "luxfield/cli/svg/svg_solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/cli/svg/svg_plot.h"

namespace luxfield::cli {
namespace {

constexpr double kSize = 400, kTop = 40, kDegree = std::numbers::pi / 180;
// Where it is seen from: turned about the vertical, and above the horizon.
constexpr double kTurn_deg = 30, kAbove_deg = 25;

struct Point {
  double x = 0, y = 0, depth = 0;  // right, up; the larger, the nearer
};

// (u, v, z) of docs/axes.md with z down, as seen.
Point Seen(double u, double v, double z) {
  const double turn = kTurn_deg * kDegree, above = kAbove_deg * kDegree;
  const double right = std::cos(turn) * u + std::sin(turn) * v,
               ahead = -std::sin(turn) * u + std::cos(turn) * v, height = -z;
  return {right, std::cos(above) * height + std::sin(above) * ahead,
          std::sin(above) * height - std::cos(above) * ahead};
}

struct Face {
  std::array<Point, 4> corners;
  double depth = 0, shade = 0;
};

std::vector<Face> FacesOf(const IntensitySolid& solid, double largest) {
  const std::size_t planes = solid.c_deg.size(), angles = solid.gamma_deg.size();
  const auto at = [&](std::size_t plane, std::size_t angle) {
    const double c = solid.c_deg[plane % planes] * kDegree,
                 gamma = solid.gamma_deg[angle] * kDegree,
                 r = std::max(0.0, solid.value[(plane % planes) * angles + angle]) / largest;
    return Seen(r * std::sin(gamma) * std::cos(c), -r * std::sin(gamma) * std::sin(c),
                r * std::cos(gamma));
  };
  std::vector<Face> faces;
  for (std::size_t plane = 0; plane < planes; ++plane)
    for (std::size_t angle = 0; angle + 1 < angles; ++angle) {
      Face face{
          {at(plane, angle), at(plane + 1, angle), at(plane + 1, angle + 1), at(plane, angle + 1)}};
      for (const Point& corner : face.corners) face.depth += corner.depth / 4;
      // By how much it faces who looks.
      const auto &a = face.corners[0], &b = face.corners[2], &c = face.corners[1],
                 &d = face.corners[3];
      const double x = (b.y - a.y) * (d.depth - c.depth) - (b.depth - a.depth) * (d.y - c.y),
                   y = (b.depth - a.depth) * (d.x - c.x) - (b.x - a.x) * (d.depth - c.depth),
                   z = (b.x - a.x) * (d.y - c.y) - (b.y - a.y) * (d.x - c.x),
                   length = std::hypot(x, y, z);
      if (!(length > 1e-12)) continue;
      face.shade = std::abs(z) / length;
      faces.push_back(face);
    }
  std::sort(faces.begin(), faces.end(),
            [](const Face& a, const Face& b) { return a.depth < b.depth; });
  return faces;
}

}  // namespace

std::string SvgSolid(const IntensitySolid& solid) {
  double largest = 0;
  for (const double value : solid.value) largest = std::max(largest, value);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0}\" "
      "height=\"{1}\" fill=\"white\"/>\n<text x=\"20\" y=\"20\" font-size=\"14\" "
      "font-weight=\"bold\">{2}</text>\n",
      kSize, kSize, EscapeXml(solid.title));
  if (!(largest > 0))
    return svg +
           fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">no light</text>\n</svg>\n",
                       kSize / 2, kSize / 2);
  std::vector<Face> faces = FacesOf(solid, largest);
  // Axes: C0 and C90, and down beyond the largest intensity, where no face covers its name.
  constexpr double kAcross = 0.55, kDown = 1.1;
  const std::array<std::pair<const char*, Point>, 3> axes = {
      {{"C0", Seen(kAcross, 0, 0)}, {"C90", Seen(0, -kAcross, 0)}, {"gamma 0", Seen(0, 0, kDown)}}};
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  const auto hold = [&](const Point& p) {
    x0 = std::min(x0, p.x), x1 = std::max(x1, p.x), y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
  };
  for (const Face& face : faces)
    for (const Point& corner : face.corners) hold(corner);
  for (const auto& [name, end] : axes) hold(end);
  constexpr double kMargin = 46;
  const double scale =
      std::min((kSize - 2 * kMargin) / (x1 - x0), (kSize - kTop - 2 * kMargin) / (y1 - y0));
  const auto px = [&](double x) { return kSize / 2 + scale * (x - 0.5 * (x0 + x1)); };
  const auto py = [&](double y) {
    return kTop + (kSize - kTop) / 2 - scale * (y - 0.5 * (y0 + y1));
  };
  for (const Face& face : faces) {
    std::string points;
    for (const Point& corner : face.corners)
      points += fmt::format("{:.1f},{:.1f} ", px(corner.x), py(corner.y));
    const auto grey = std::lround(110 + 130 * face.shade);
    svg += fmt::format(
        "<polygon points=\"{}\" fill=\"#{:02x}{:02x}{:02x}\" stroke=\"#444\" "
        "stroke-width=\"0.3\"/>\n",
        points, grey, grey, std::min(255L, grey + 12));
  }
  for (const auto& [name, p] : axes) {
    svg += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#000\" "
        "stroke-width=\"1.2\"/><text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
        px(0), py(0), px(p.x), py(p.y), px(1.12 * p.x), py(1.12 * p.y) + 4, name);
  }
  svg += fmt::format("<text x=\"20\" y=\"38\">largest drawn: {:.4g} {}</text>\n", largest,
                     EscapeXml(solid.unit));
  return svg + "</svg>\n";
}

}  // namespace luxfield::cli
