#include "luxfield/cli/svg/svg_isolux.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/colour.h"

namespace luxfield::cli {
namespace {

constexpr double kLeft = 76, kTop = 44, kLegend = 150, kBottom = 56;
constexpr double kLargest = 340,
                 kLargestWithMarks = 700;  // of a map, with many marks that have names
constexpr std::size_t kManyMarks = 5;
constexpr int kMostLevels = 9;
constexpr double kBox = 18;  // of the legend

struct Frame {
  double width, height;  // of the map, pixels
  double X(const IsoluxMap& m, double x) const {
    return kLeft + (x - m.x0) / (m.x1 - m.x0) * width;
  }
  double Y(const IsoluxMap& m, double y) const {
    return kTop + (m.y1 - y) / (m.y1 - m.y0) * height;
  }
};

std::string ColourText(double r, double g, double b) {
  const auto byte = [](double x) { return std::lround(255 * std::clamp(x, 0.0, 1.0)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(r), byte(g), byte(b));
}

// Bands between levels, and what colour each has.
struct Scale {
  std::vector<double> levels;
  bool is_signed = false;

  std::string Colour(std::size_t band) const {
    const double share = (double(band) + 0.5) / double(levels.size() + 1);
    if (!is_signed) {
      const auto c = core::FalseColour(share);
      return ColourText(c[0], c[1], c[2]);
    }
    const double x = 2 * share - 1, dark = 0.75 * std::abs(x);
    return x > 0 ? ColourText(1, 1 - dark, 1 - dark) : ColourText(1 - dark, 1 - dark, 1);
  }
  bool OnDark(std::size_t level) const { return !is_signed && level < levels.size() / 2; }
};

// How many levels are at or below the value.
std::size_t BandOf(const std::vector<double>& levels, double value) {
  return static_cast<std::size_t>(std::upper_bound(levels.begin(), levels.end(), value) -
                                  levels.begin());
}

// Runs of fields of one band in a row, as rectangles; a path for each band.
std::string Fields(const IsoluxMap& map, const Frame& frame, const Scale& scale) {
  const double w = frame.width / map.columns, h = frame.height / map.rows;
  std::vector<std::string> paths(scale.levels.size() + 1);
  for (int row = 0; row < map.rows; ++row)
    for (int column = 0; column < map.columns;) {
      const auto band = [&](int at) {
        return BandOf(scale.levels, map.values[static_cast<std::size_t>(row) * map.columns + at]);
      };
      int end = column + 1;
      while (end < map.columns && band(end) == band(column)) ++end;
      // A little larger, so that no white shows between neighbours.
      constexpr double kMore = 0.4;
      const double x0 = kLeft + column * w, x1 = kLeft + end * w + kMore, y0 = kTop + row * h,
                   y1 = y0 + h + kMore;
      paths[band(column)] +=
          fmt::format("M{:.1f} {:.1f}H{:.1f}V{:.1f}H{:.1f}Z", x0, y0, x1, y1, x0);
      column = end;
    }
  std::string svg = "<g shape-rendering=\"crispEdges\">\n";
  for (std::size_t band = 0; band < paths.size(); ++band)
    if (!paths[band].empty())
      svg += fmt::format("<path d=\"{}\" fill=\"{}\"/>\n", paths[band], scale.Colour(band));
  return svg + "</g>\n";
}

// Marching squares between the middles of fields.
std::string Line(const IsoluxMap& map, const Frame& frame, double level, bool on_dark) {
  const double w = frame.width / map.columns, h = frame.height / map.rows;
  std::string path;
  for (int row = 0; row + 1 < map.rows; ++row)
    for (int column = 0; column + 1 < map.columns; ++column) {
      const auto value = [&](int r, int c) {
        return map.values[static_cast<std::size_t>(row + r) * map.columns + column + c];
      };
      // Corners in turn, and the points on the four sides where the level is crossed.
      const std::array<std::array<int, 2>, 4> corners = {{{0, 0}, {0, 1}, {1, 1}, {1, 0}}};
      std::vector<std::array<double, 2>> crossings;
      for (std::size_t k = 0; k < 4; ++k) {
        const auto [r0, c0] = corners[k];
        const auto [r1, c1] = corners[(k + 1) % 4];
        const double a = value(r0, c0) - level, b = value(r1, c1) - level;
        if ((a < 0) == (b < 0)) continue;
        const double t = a / (a - b);
        crossings.push_back({kLeft + (column + 0.5 + c0 + t * (c1 - c0)) * w,
                             kTop + (row + 0.5 + r0 + t * (r1 - r0)) * h});
      }
      for (std::size_t k = 0; k + 1 < crossings.size(); k += 2)
        path += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", crossings[k][0], crossings[k][1],
                            crossings[k + 1][0], crossings[k + 1][1]);
    }
  if (path.empty()) return path;
  return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"0.8\"{}/>\n", path,
                     on_dark ? "#fff" : "#000", level < 0 ? " stroke-dasharray=\"3 2\"" : "");
}

// Names of marks beside them, where no name before them lies: right or left, above or below, and so
// on by lines. A name that finds no place overlaps another.
class Names {
 public:
  struct Text {
    double x = 0, y = 0;  // of its base line
    bool left = false;    // it ends at x
  };
  Text Place(double x, double y, std::size_t letters, bool left_first) {
    constexpr double kAside = 6, kUp = 5, kHeight = 11, kLetter = 6.6;
    constexpr int kLines = 4;
    const double width = kLetter * double(letters);
    const auto box = [&](const Text& at) {
      return Box{at.left ? at.x - width : at.x, at.y - kHeight, width, kHeight};
    };
    const Text first{left_first ? x - kAside : x + kAside, y - kUp, left_first};
    Text chosen = first;
    bool found = false;
    for (int line = 0; line < kLines && !found; ++line)
      for (const double dy : {-kUp - line * kHeight, kUp + (line + 0.7) * kHeight})
        for (const bool left : {left_first, !left_first}) {
          const Text at{left ? x - kAside : x + kAside, y + dy, left};
          if (found || IsTaken(box(at))) continue;
          chosen = at;
          found = true;
        }
    taken_.push_back(box(chosen));
    return chosen;
  }

 private:
  struct Box {
    double x, y, width, height;
  };
  bool IsTaken(const Box& a) const {
    return std::any_of(taken_.begin(), taken_.end(), [&](const Box& b) {
      return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height &&
             b.y < a.y + a.height;
    });
  }
  std::vector<Box> taken_;
};

// Lines and marks with a dark border around their light middle, on whatever lies below.
std::string Overlay(const IsoluxMap& map, const Frame& frame) {
  const auto inside = [&](double x, double y) {
    return x >= map.x0 && x <= map.x1 && y >= map.y0 && y <= map.y1;
  };
  std::string svg;
  for (const IsoluxLine& line : map.lines) {
    std::string path;
    bool drawing = false;
    for (const auto& [x, y] : line.points) {
      const bool on = inside(x, y);
      if (on)
        path +=
            fmt::format("{}{:.1f} {:.1f}", drawing ? "L" : "M", frame.X(map, x), frame.Y(map, y));
      drawing = on;
    }
    if (path.empty()) continue;
    for (const auto& [colour, width] : {std::pair{"#000", 2.6}, {"#fff", 1.2}})
      svg += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n",
                         path, colour, width, line.dashed ? " stroke-dasharray=\"5 4\"" : "");
  }
  Names names;
  for (std::ptrdiff_t k = 0; k < std::ssize(map.marks); ++k) {
    const IsoluxMark& mark = map.marks[k];
    if (!inside(mark.x, mark.y)) continue;
    const double x = frame.X(map, mark.x), y = frame.Y(map, mark.y);
    for (const auto& [colour, stroke] : {std::pair{"#000", 3.4}, {"#fff", 1.6}})
      svg += mark.crossed
                 ? fmt::format(
                       "<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}M{:.1f} {:.1f}L{:.1f} {:.1f}\" "
                       "fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"/>\n",
                       x - 4, y - 4, x + 4, y + 4, x - 4, y + 4, x + 4, y - 4, colour, stroke)
                 : fmt::format(
                       "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"none\" "
                       "stroke=\"{}\" stroke-width=\"{}\"/>\n",
                       x, y, colour, stroke);
    const auto is_named = [&](const IsoluxMark& other) {
      return other.x == mark.x && other.y == mark.y && other.text == mark.text;
    };
    if (std::find_if(map.marks.begin(), map.marks.end(), is_named) != map.marks.begin() + k)
      continue;
    const auto text = names.Place(x, y, mark.text.size(), x > kLeft + 0.85 * frame.width);
    svg += fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"11\" text-anchor=\"{}\" fill=\"#fff\" "
        "stroke=\"#000\" stroke-width=\"2.2\" paint-order=\"stroke\">{}</text>\n",
        text.x, text.y, text.left ? "end" : "start", EscapeXml(mark.text));
  }
  return svg;
}

// Round values, some 80 pixels apart, or two to four along a short axis.
std::vector<double> RoundTicks(double low, double high, double pixels) {
  const double raw = (high - low) / std::max(2.0, pixels / 80);
  const double magnitude = std::pow(10.0, std::floor(std::log10(raw))), ratio = raw / magnitude;
  const double step = magnitude * (ratio < 1.5 ? 1 : ratio < 3.5 ? 2 : ratio < 7.5 ? 5 : 10);
  std::vector<double> ticks;
  for (double k = std::ceil(low / step - 1e-9); k <= high / step + 1e-9; ++k)
    ticks.push_back(k == 0 ? 0 : k * step);
  return ticks;
}

std::string AxisTicks(const IsoluxMap& map, const Frame& frame) {
  std::string svg;
  const auto mark = [&](double x, double y, double dx, double dy) {
    svg += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#444\"/>\n", x, y,
        x + dx, y + dy);
  };
  const double bottom = kTop + frame.height;
  for (const double x : RoundTicks(map.x0, map.x1, frame.width)) {
    mark(frame.X(map, x), bottom, 0, 4);
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.4g}</text>\n",
                       frame.X(map, x), bottom + 17, x);
  }
  for (const double y : RoundTicks(map.y0, map.y1, frame.height)) {
    mark(kLeft, frame.Y(map, y), -4, 0);
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{:.4g}</text>\n",
                       kLeft - 7, frame.Y(map, y) + 4, y);
  }
  svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                     kLeft + frame.width / 2, kTop + frame.height + 38, EscapeXml(map.x_label));
  // Beside the middle, or, of a map that is lower than its name is long, from below the title on.
  constexpr double kLetter = 6.4, kBelowTitle = 30;
  const double middle =
      std::max(kTop + frame.height / 2, kBelowTitle + kLetter * double(map.y_label.size()) / 2);
  svg += fmt::format(
      "<text transform=\"translate(16 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      middle, EscapeXml(map.y_label));
  return svg;
}

// "200000", "2e6".
std::string LevelText(double level) {
  std::string text = fmt::format("{:g}", level);
  if (const std::size_t plus = text.find("e+0"); plus != std::string::npos) text.erase(plus + 1, 2);
  return text;
}

// Under its unit.
std::string Legend(const IsoluxMap& map, const Frame& frame, const Scale& scale) {
  const std::vector<double>& levels = scale.levels;
  const double x = kLeft + frame.width + 18;
  std::string svg =
      fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x, kTop + 10, EscapeXml(map.unit));
  for (std::size_t band = 0; band <= levels.size(); ++band) {
    const double y = kTop + kBox * double(levels.size() + 1 - band);
    const std::string text = band == 0 ? "below " + LevelText(levels[0])
                             : band == levels.size()
                                 ? "from " + LevelText(levels[band - 1])
                                 : LevelText(levels[band - 1]) + " to " + LevelText(levels[band]);
    svg += fmt::format(
        "<rect x=\"{0:.1f}\" y=\"{1:.1f}\" width=\"{2}\" height=\"{2}\" fill=\"{3}\" "
        "stroke=\"#888\" stroke-width=\"0.5\"/><text x=\"{4:.1f}\" y=\"{5:.1f}\">{6}</text>\n",
        x, y, kBox, scale.Colour(band), x + kBox + 6, y + 13, text);
  }
  return svg;
}

// What a map says that has no levels.
const char* WithoutLevels(const IsoluxMap& map, const Scale& scale) {
  if (scale.is_signed) return "no difference";
  const bool dark =
      std::all_of(map.values.begin(), map.values.end(), [](double x) { return x == 0; });
  return dark ? "no light" : "nothing above 0";
}

std::string Drawn(const IsoluxMap& map, const Scale& scale) {
  const double across = map.x1 - map.x0, along = map.y1 - map.y0;
  // As wide as high where that can be read: not beyond 1 : 4.
  const double ratio = std::clamp(along / across, 0.25, 4.0);
  const double largest = map.marks.size() < kManyMarks ? kLargest : kLargestWithMarks;
  const Frame frame{ratio > 1 ? largest / ratio : largest, ratio > 1 ? largest : largest * ratio};
  const double width = kLeft + frame.width + kLegend,
               height = kTop + std::max(frame.height, kBox * (kMostLevels + 2)) + kBottom;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "width=\"{0:.0f}\" height=\"{1:.0f}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect "
      "width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"white\"/>\n<text x=\"20\" y=\"22\" "
      "font-size=\"14\" font-weight=\"bold\">{2}</text>\n",
      width, height, EscapeXml(map.title));
  const std::string border = fmt::format(
      "<rect x=\"{}\" y=\"{}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
      "stroke=\"#444\"/>\n",
      kLeft, kTop, frame.width, frame.height);
  if (scale.levels.empty())
    return svg + Overlay(map, frame) + border + AxisTicks(map, frame) +
           fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n</svg>\n",
                       kLeft + frame.width / 2, kTop + frame.height / 2, WithoutLevels(map, scale));
  svg += Fields(map, frame, scale);
  for (std::size_t k = 0; map.outlined && k < scale.levels.size(); ++k)
    svg += Line(map, frame, scale.levels[k], scale.OnDark(k));
  return svg + Overlay(map, frame) + border + AxisTicks(map, frame) + Legend(map, frame, scale) +
         "</svg>\n";
}

}  // namespace

std::vector<double> IsoluxLevels(double largest, int most) {
  std::vector<double> levels;
  double power = std::pow(10, std::floor(std::log10(largest)));
  while (static_cast<int>(levels.size()) < most) {
    for (const double factor : {5.0, 2.0, 1.0})
      if (factor * power < largest && static_cast<int>(levels.size()) < most)
        levels.insert(levels.begin(), factor * power);
    power /= 10;
  }
  return levels;
}

std::string SvgIsolux(const IsoluxMap& map) {
  const double largest =
      map.values.empty() ? 0 : *std::max_element(map.values.begin(), map.values.end());
  return Drawn(map, {largest > 0 ? IsoluxLevels(largest, kMostLevels) : std::vector<double>{}});
}

std::string SvgDifference(const IsoluxMap& map) {
  constexpr int kToEitherSide = 4;
  double largest = 0;
  for (const double value : map.values) largest = std::max(largest, std::abs(value));
  Scale scale{{}, true};
  if (largest > 0) {
    const std::vector<double> above = IsoluxLevels(largest, kToEitherSide);
    for (auto it = above.rbegin(); it != above.rend(); ++it) scale.levels.push_back(-*it);
    scale.levels.insert(scale.levels.end(), above.begin(), above.end());
  }
  return Drawn(map, scale);
}

}  // namespace luxfield::cli
