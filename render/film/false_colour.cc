// False colour with a legend, drawn with Cairo.
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/spare_memory.h"
#include "luxfield/render/film/film.h"

namespace luxfield::render {
namespace {

constexpr int kLegendWidth = 110, kLeastHeight = 160;
constexpr double kMargin = 14, kBarWidth = 18, kTitleHeight = 40, kFontSize = 12;

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

double LuminanceOf(const core::Image& image, std::size_t i) {
  const std::size_t n = image.plane_size();
  return image.channels == 1
             ? image.data[i]
             : core::Luminance({image.data[i], image.data[n + i], image.data[2 * n + i]});
}

// The nodes of core::FalseColour are display values already.
std::uint32_t Argb(const core::Rgb& display) {
  std::uint32_t out = 0xFF;
  for (int c = 0; c < 3; ++c)
    out = (out << 8) |
          static_cast<std::uint32_t>(std::lround(255 * std::clamp(display[c], 0.0, 1.0)));
  return out;
}

double Position(double value, FalseColourScale scale) {
  return std::log(value / scale.min) / std::log(scale.max / scale.min);
}

// Smallest of 1, 2, 5 x 10^n that is not below `value`.
double RoundUp125(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (value <= factor * decade * (1 + 1e-9)) return factor * decade;
  return 10 * decade;
}

// 0xAARRGGBB of every pixel.
void PaintPixels(cairo_surface_t* surface, const core::Image& image,
                 const std::function<std::uint32_t(std::size_t pixel)>& argb) {
  cairo_surface_flush(surface);
  unsigned char* data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  for (int row = 0; row < image.height; ++row) {
    auto* line = reinterpret_cast<std::uint32_t*>(data + static_cast<std::size_t>(row) * stride);
    for (int column = 0; column < image.width; ++column)
      line[column] = argb(static_cast<std::size_t>(row) * image.width + column);
  }
  cairo_surface_mark_dirty(surface);
}

constexpr int kDigits = 4;  // of labels

bool IsWrittenOut(double value) {
  const double size = std::abs(value);
  return size == 0 || (size >= 1e-4 * (1 - 1e-9) && size < 1e7 * (1 - 1e-9));
}

// The least number of decimals that tells a value to kDigits digits.
int Decimals(double value) {
  const std::string text = fmt::format("{:.{}e}", std::abs(value), kDigits - 1);
  const auto power = std::stoi(text.substr(text.find('e') + 1));
  const auto last = static_cast<int>(text.find_last_not_of('0', text.find('e') - 1));
  return std::max(0, (last > 1 ? last - 1 : 0) - power);
}

// "5e-6".
std::string WithPower(double value) {
  const std::string text = fmt::format("{:.{}e}", value, kDigits - 1);
  const std::size_t e = text.find('e');
  const double mantissa = std::stod(text.substr(0, e));
  return fmt::format("{:.{}g}e{}", mantissa, kDigits, std::stoi(text.substr(e + 1)));
}

struct Tick {
  double position = 0;  // 0 at the lower end of the bar
  std::string label;    // may be empty
};

// 1, 2, 5 of every decade, labelled as far as the labels fit `length` pixels; the ends of a scale
// that holds less than two of them.
std::vector<Tick> MakeTicks(FalseColourScale scale, double length) {
  const double decade_pixels = length / std::log10(scale.max / scale.min);
  const double room = kFontSize + 1;
  const bool label_all = decade_pixels * std::log10(2) >= room;  // the narrowest gap, from 1 to 2
  const int every = std::max(1, static_cast<int>(std::ceil(room / decade_pixels)));
  const int first = static_cast<int>(std::floor(std::log10(scale.min)));
  const int last = static_cast<int>(std::floor(std::log10(scale.max) + 1e-3));
  std::vector<double> values;
  std::vector<bool> labelled;
  for (int decade = first; decade <= last; ++decade)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10.0, decade);
      if (value < scale.min * 0.999 || value > scale.max * 1.001) continue;
      values.push_back(value);
      labelled.push_back(label_all || (factor == 1.0 && decade % every == 0));
    }
  if (values.size() < 2) {
    values = {scale.min, scale.max};
    labelled = {true, true};
  }
  const std::vector<std::string> labels = TickLabels(values);
  std::vector<Tick> ticks;
  for (std::size_t i = 0; i < values.size(); ++i)
    ticks.push_back({Position(values[i], scale), labelled[i] ? labels[i] : std::string()});
  return ticks;
}

void DrawTitle(cairo_t* cairo, double left, double height, const std::string& quantity,
               const std::string& unit) {
  cairo_set_source_rgb(cairo, 1, 1, 1);
  cairo_rectangle(cairo, left, 0, kLegendWidth, height);
  cairo_fill(cairo);
  core::RequireSpareMemory(core::kTextDrawingBytes);
  cairo_select_font_face(cairo, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo, kFontSize);
  cairo_set_source_rgb(cairo, 0, 0, 0);
  cairo_move_to(cairo, left + 6, 18);
  cairo_show_text(cairo, quantity.c_str());
  cairo_move_to(cairo, left + 6, 34);
  cairo_show_text(cairo, unit.c_str());
}

void DrawBar(cairo_t* cairo, double left, double height,
             const std::function<core::Rgb(double position)>& colour_at,
             const std::vector<Tick>& ticks) {
  const double top = kTitleHeight + kMargin, bottom = height - kMargin, bar = left + 10;
  for (int i = 0; i < bottom - top; ++i) {
    const double y = top + i;
    const auto colour = colour_at((bottom - y - 0.5) / (bottom - top));
    cairo_set_source_rgb(cairo, colour[0], colour[1], colour[2]);
    cairo_rectangle(cairo, bar, y, kBarWidth, 1);
    cairo_fill(cairo);
  }
  cairo_set_source_rgb(cairo, 0, 0, 0);
  cairo_set_line_width(cairo, 1);
  for (const Tick& tick : ticks) {
    const double y = bottom - tick.position * (bottom - top);
    cairo_move_to(cairo, bar + kBarWidth, y);
    cairo_line_to(cairo, bar + kBarWidth + (tick.label.empty() ? 4 : 7), y);
    cairo_stroke(cairo);
    cairo_move_to(cairo, bar + kBarWidth + 10, y + 0.35 * kFontSize);
    cairo_show_text(cairo, tick.label.c_str());
  }
}

void DrawKeys(cairo_t* cairo, double left, const std::vector<ColourKey>& keys) {
  double y = kTitleHeight;
  for (const ColourKey& key : keys) {
    cairo_set_source_rgb(cairo, key.colour[0], key.colour[1], key.colour[2]);
    cairo_rectangle(cairo, left + 10, y, kBarWidth, kFontSize);
    cairo_fill(cairo);
    cairo_set_source_rgb(cairo, 0, 0, 0);
    cairo_move_to(cairo, left + 16 + kBarWidth, y + 0.85 * kFontSize);
    cairo_show_text(cairo, key.name.c_str());
    y += 1.5 * kFontSize;
  }
}

cairo_status_t Append(void* closure, const unsigned char* data, unsigned length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

double BarLength(double height) { return height - kTitleHeight - 2 * kMargin; }

// A PNG of the picture's pixels and, right of it, what draw_legend(cairo, height) draws.
void WriteWithLegend(const std::filesystem::path& path, const core::Image& image,
                     const std::function<std::uint32_t(std::size_t pixel)>& argb,
                     const std::function<void(cairo_t* cairo, double height)>& draw_legend) {
  const int width = image.width + kLegendWidth, height = std::max(image.height, kLeastHeight);
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height),
                        &cairo_surface_destroy);
  const Context cairo(cairo_create(surface.get()), &cairo_destroy);
  cairo_set_source_rgb(cairo.get(), 1, 1, 1);
  cairo_paint(cairo.get());
  if (cairo_status(cairo.get()) != CAIRO_STATUS_SUCCESS)
    throw DeviceError(fmt::format("{}: drawing {} x {} pixels failed: {}", path.string(), width,
                                  height, cairo_status_to_string(cairo_status(cairo.get()))));
  PaintPixels(surface.get(), image, argb);
  draw_legend(cairo.get(), height);
  std::string png;
  const cairo_status_t status = cairo_surface_write_to_png_stream(surface.get(), Append, &png);
  if (status != CAIRO_STATUS_SUCCESS || cairo_status(cairo.get()) != CAIRO_STATUS_SUCCESS)
    throw DeviceError(fmt::format("{}: the PNG encoder failed: {}", path.string(),
                                  cairo_status_to_string(status)));
  core::WriteFileAtomically(path, png);
}

}  // namespace

std::vector<std::string> TickLabels(std::span<const double> values) {
  const bool plain = std::ranges::all_of(values, IsWrittenOut);
  std::vector<std::string> labels;
  labels.reserve(values.size());
  for (const double value : values)
    labels.push_back(plain || value == 0 ? fmt::format("{:.{}f}", value, Decimals(value))
                                         : WithPower(value));
  return labels;
}

FalseColourScale AutomaticScale(const core::Image& values) {
  std::vector<double> positive;
  for (std::size_t i = 0; i < values.plane_size(); ++i)
    if (const double value = LuminanceOf(values, i); value > 0 && std::isfinite(value))
      positive.push_back(value);
  if (positive.empty()) return {1e-3, 1};
  const auto rank = static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(positive.size() - 1));
  std::nth_element(positive.begin(), positive.begin() + rank, positive.end());
  const double max = RoundUp125(positive[rank]);
  return {max * 1e-3, max};
}

void WriteFalseColour(const std::filesystem::path& path, const core::Image& image,
                      const std::string& quantity, const std::string& unit,
                      FalseColourScale scale) {
  if (scale.min == 0 && scale.max == 0) scale = AutomaticScale(image);
  if (!(scale.min > 0 && scale.max > scale.min && std::isfinite(scale.max)))
    throw InputError(
        fmt::format("the false-colour scale {} to {} is impossible; choose 0 < min < max",
                    scale.min, scale.max));
  WriteWithLegend(
      path, image,
      [&](std::size_t pixel) {
        const double value = LuminanceOf(image, pixel);
        return value > 0 ? Argb(core::FalseColour(Position(value, scale))) : 0xFF000000u;
      },
      [&](cairo_t* cairo, double height) {
        DrawTitle(cairo, image.width, height, quantity, unit);
        DrawBar(cairo, image.width, height, &core::FalseColour,
                MakeTicks(scale, BarLength(height)));
      });
}

void WriteColourScale(const std::filesystem::path& path, const core::Image& image,
                      const std::string& quantity, const std::string& unit,
                      const ColourScale& scale) {
  constexpr int kSteps = 4;
  std::vector<double> values;
  for (int k = 0; k <= kSteps; ++k)
    values.push_back(std::lerp(scale.min, scale.max, static_cast<double>(k) / kSteps));
  const std::vector<std::string> labels = TickLabels(values);
  std::vector<Tick> ticks;
  for (int k = 0; k <= kSteps; ++k) ticks.push_back({static_cast<double>(k) / kSteps, labels[k]});
  WriteWithLegend(
      path, image,
      [&](std::size_t pixel) {
        const double value = image.data[pixel];
        return std::isnan(value) ? 0xFF000000u
                                 : Argb(scale.colour(std::clamp(
                                       (value - scale.min) / (scale.max - scale.min), 0.0, 1.0)));
      },
      [&](cairo_t* cairo, double height) {
        DrawTitle(cairo, image.width, height, quantity, unit);
        DrawBar(cairo, image.width, height, scale.colour, ticks);
      });
}

void WriteColourKeys(const std::filesystem::path& path, const core::Image& image,
                     const std::string& quantity, const std::vector<ColourKey>& keys) {
  WriteWithLegend(
      path, image,
      [&](std::size_t pixel) {
        return Argb({image.plane(0)[pixel], image.plane(1)[pixel], image.plane(2)[pixel]});
      },
      [&](cairo_t* cairo, double height) {
        DrawTitle(cairo, image.width, height, quantity, "");
        DrawKeys(cairo, image.width, keys);
      });
}

}  // namespace luxfield::render
