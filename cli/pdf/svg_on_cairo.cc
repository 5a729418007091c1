#include "luxfield/cli/pdf/svg_on_cairo.h"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "luxfield/formats/xml.h"

namespace luxfield::cli {
namespace {

using formats::XmlElement;

// What children take over from the elements around them.
struct Style {
  double font_size = 12;
};

std::string Attribute(const XmlElement& element, const std::string& name,
                      const std::string& fallback = {}) {
  for (const auto& [key, value] : element.attributes)
    if (key == name) return value;
  return fallback;
}
double Number(const XmlElement& element, const std::string& name, double fallback = 0) {
  const std::string text = Attribute(element, name);
  return text.empty() ? fallback : std::strtod(text.c_str(), nullptr);
}

[[noreturn]] void Refuse(const std::string& what) {
  throw std::logic_error(fmt::format("DrawSvg: {} is not drawn", what));
}

// "white", "#rgb", "#rrggbb".
std::array<double, 3> Colour(const std::string& text) {
  if (text == "white") return {1, 1, 1};
  if (text == "black" || text.empty()) return {0, 0, 0};
  if (text[0] != '#' || (text.size() != 4 && text.size() != 7)) Refuse("colour " + text);
  const std::size_t digits = text.size() == 4 ? 1 : 2;
  std::array<double, 3> colour{};
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] =
        static_cast<double>(std::strtol(text.substr(1 + digits * k, digits).c_str(), nullptr, 16)) /
        (digits == 1 ? 15 : 255);
  return colour;
}

void SetColour(cairo_t* context, const std::string& text) {
  const auto [r, g, b] = Colour(text);
  cairo_set_source_rgb(context, r, g, b);
}

void SetStroke(cairo_t* context, const XmlElement& element) {
  SetColour(context, Attribute(element, "stroke"));
  cairo_set_line_width(context, Number(element, "stroke-width", 1));
  std::vector<double> dashes;
  const std::string text = Attribute(element, "stroke-dasharray");
  for (const char* at = text.c_str(); *at;) {
    char* end = nullptr;
    const double length = std::strtod(at, &end);
    if (end == at) break;
    dashes.push_back(length);
    at = *end ? end + 1 : end;
  }
  // "0" and the like are full lines.
  double sum = 0;
  for (const double length : dashes) sum += length;
  cairo_set_dash(context, dashes.data(), sum > 0 ? static_cast<int>(dashes.size()) : 0, 0);
}

// Fills and strokes the path that lies in the context.
void Paint(cairo_t* context, const XmlElement& element) {
  const std::string fill = Attribute(element, "fill", "black"),
                    stroke = Attribute(element, "stroke", "none");
  if (fill != "none") {
    SetColour(context, fill);
    cairo_fill_preserve(context);
  }
  if (stroke != "none") {
    SetStroke(context, element);
    cairo_stroke_preserve(context);
  }
  cairo_new_path(context);
}

// "12,34 ..." and "M12 34L56 78H90V12Z": numbers after letters; without letters a line through all.
void AddPath(cairo_t* context, const std::string& text) {
  char command = 'M';
  for (const char* at = text.c_str(); *at;) {
    if (*at == ' ' || *at == ',' || *at == '\n') {
      ++at;
      continue;
    }
    if (*at == 'Z') {
      cairo_close_path(context);
      ++at;
      continue;
    }
    if (*at == 'M' || *at == 'L' || *at == 'H' || *at == 'V') {
      command = *at++;
      continue;
    }
    char* end = nullptr;
    const double x = std::strtod(at, &end);
    if (end == at) Refuse(fmt::format("path command {}", *at));
    at = end;
    if (command == 'H' || command == 'V') {
      double from_x = 0, from_y = 0;
      cairo_get_current_point(context, &from_x, &from_y);
      cairo_line_to(context, command == 'H' ? x : from_x, command == 'V' ? x : from_y);
      continue;
    }
    while (*at == ' ' || *at == ',') ++at;
    const double y = std::strtod(at, &end);
    if (end == at) Refuse("a path of an odd count of numbers");
    at = end;
    if (command == 'M')
      cairo_move_to(context, x, y);
    else
      cairo_line_to(context, x, y);
    command = 'L';
  }
}

// "translate(x y) rotate(degrees)", either alone too.
void Transform(cairo_t* context, const std::string& text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t open = text.find('(', at), close = text.find(')', at);
    if (open == std::string::npos || close == std::string::npos) break;
    const std::string name =
        text.substr(text.find_first_not_of(' ', at), open - text.find_first_not_of(' ', at));
    char* end = nullptr;
    const double a = std::strtod(text.c_str() + open + 1, &end);
    if (name == "translate")
      cairo_translate(context, a, std::strtod(*end == ',' ? end + 1 : end, nullptr));
    else if (name == "rotate")
      cairo_rotate(context, a * std::numbers::pi / 180);
    else
      Refuse("transform " + name);
    at = close + 1;
  }
}

void DrawText(cairo_t* context, const XmlElement& element, const Style& style) {
  const bool bold = Attribute(element, "font-weight") == "bold";
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  // DejaVu is wider than the sans-serif that plots are laid out for.
  constexpr double kNarrower = 0.92;
  cairo_set_font_size(context, kNarrower * Number(element, "font-size", style.font_size));
  cairo_text_extents_t extents;
  cairo_text_extents(context, element.text.c_str(), &extents);
  const std::string anchor = Attribute(element, "text-anchor", "start");
  const double share = anchor == "middle" ? 0.5 : anchor == "end" ? 1 : 0;
  cairo_move_to(context, Number(element, "x") - share * extents.x_advance, Number(element, "y"));
  if (const std::string stroke = Attribute(element, "stroke", "none"); stroke != "none") {
    cairo_text_path(context, element.text.c_str());
    SetStroke(context, element);
    cairo_stroke_preserve(context);
    SetColour(context, Attribute(element, "fill", "black"));
    cairo_fill(context);
    return;
  }
  SetColour(context, Attribute(element, "fill", "black"));
  cairo_show_text(context, element.text.c_str());
}

void Draw(cairo_t* context, const XmlElement& element, Style style) {
  style.font_size = Number(element, "font-size", style.font_size);
  cairo_save(context);
  if (const std::string transform = Attribute(element, "transform"); !transform.empty())
    Transform(context, transform);
  const std::string& name = element.name;
  if (name == "svg" || name == "g") {
    for (const XmlElement& child : element.children) Draw(context, child, style);
  } else if (name == "rect") {
    cairo_rectangle(context, Number(element, "x"), Number(element, "y"), Number(element, "width"),
                    Number(element, "height"));
    Paint(context, element);
  } else if (name == "circle") {
    cairo_new_path(context);  // an arc is joined to where the last text ended
    cairo_arc(context, Number(element, "cx"), Number(element, "cy"), Number(element, "r"), 0,
              2 * std::numbers::pi);
    Paint(context, element);
  } else if (name == "line") {
    cairo_move_to(context, Number(element, "x1"), Number(element, "y1"));
    cairo_line_to(context, Number(element, "x2"), Number(element, "y2"));
    SetStroke(context, element);
    cairo_stroke(context);
  } else if (name == "polyline" || name == "polygon") {
    AddPath(context, Attribute(element, "points"));
    if (name == "polygon") cairo_close_path(context);
    Paint(context, element);
  } else if (name == "path") {
    AddPath(context, Attribute(element, "d"));
    Paint(context, element);
  } else if (name == "text") {
    DrawText(context, element, style);
  } else {
    Refuse("<" + name + ">");
  }
  cairo_restore(context);
}

}  // namespace

SvgSize SizeOfSvg(const std::string& svg) {
  const XmlElement root = formats::ParseXml(svg, "plot");
  return {Number(root, "width"), Number(root, "height")};
}

void DrawSvg(cairo_t* context, const std::string& svg, double x, double y, double scale) {
  const XmlElement root = formats::ParseXml(svg, "plot");
  cairo_save(context);
  cairo_translate(context, x, y);
  cairo_scale(context, scale, scale);
  cairo_rectangle(context, 0, 0, Number(root, "width"), Number(root, "height"));
  cairo_clip(context);  // as browsers do: a name that is too long stays off the plot beside it
  Draw(context, root, {});
  cairo_restore(context);
}

}  // namespace luxfield::cli
