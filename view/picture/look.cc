#include "luxfield/view/picture/look.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/core/parallel.h"
#include "luxfield/view/picture/tone_codes.h"

namespace luxfield::view {
namespace {

constexpr std::size_t kGrain = 1 << 14;  // pixels
constexpr int kLinearLines = 10;         // lines of equal value of a linear scale
constexpr double kDarkLuminance = 0.25;  // of a colour on which lines are white

// The linear values at which the rounded code changes: code c begins at element c.
const std::array<double, 256>& CodeBegins() {
  static const std::array<double, 256> begins = [] {
    std::array<double, 256> values{};
    for (int code = 1; code < 256; ++code) values[code] = SrgbDecode((code - 0.5) / 255);
    return values;
  }();
  return begins;
}

constexpr int kGuesses = 4096;

// The code at linear value i / kGuesses.
const std::array<std::uint8_t, kGuesses + 1>& Guesses() {
  static const std::array<std::uint8_t, kGuesses + 1> guesses = [] {
    std::array<std::uint8_t, kGuesses + 1> codes{};
    for (int i = 0; i <= kGuesses; ++i) {
      const double value = static_cast<double>(i) / kGuesses;
      codes[i] = static_cast<std::uint8_t>(
          std::upper_bound(CodeBegins().begin() + 1, CodeBegins().end(), value) -
          CodeBegins().begin() - 1);
    }
    return codes;
  }();
  return guesses;
}

core::Rgb PixelOf(const core::Image& image, std::size_t i) {
  const std::size_t n = image.plane_size();
  return {image.data[i], image.data[n + i], image.data[2 * n + i]};
}

std::array<std::uint8_t, 3> Encoded(const core::Rgb& linear) {
  // Rounded to float as render::ToneMap's image holds it.
  const auto code = [](double value) { return EncodeByte(static_cast<float>(value)); };
  return {code(linear[0]), code(linear[1]), code(linear[2])};
}

std::array<std::uint8_t, 3> Codes(const core::Rgb& display) {
  std::array<std::uint8_t, 3> codes{};
  for (int c = 0; c < 3; ++c)
    codes[c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(display[c], 0.0, 1.0)));
  return codes;
}

// What false colours are made from.
struct ColouredValues {
  Layer layer;
  core::Image values;
  render::FalseColourScale scale;

  double At(std::size_t i) const {
    return values.channels == 3 ? core::Luminance(PixelOf(values, i)) : values.data[i];
  }
  std::optional<double> Position(std::size_t i) const { return PositionOn(scale, layer, At(i)); }

  // How many lines of equal value lie below a pixel's; empty below the scale, where noise would be
  // all lines.
  std::optional<int> LinesBelow(std::size_t i) const {
    const double value = At(i);
    if (!std::isfinite(value)) return {};
    if (IsLinear(layer)) return static_cast<int>(std::floor(kLinearLines * *Position(i)));
    if (!(value >= scale.min)) return {};
    const double decade = std::floor(std::log10(value)), mantissa = value / std::pow(10, decade);
    return 3 * static_cast<int>(decade) + (mantissa >= 5 ? 2 : mantissa >= 2 ? 1 : 0);
  }
  // Whether a line passes between the pixel and its neighbour on the right or below.
  bool OnLine(std::size_t i) const {
    const auto width = static_cast<std::size_t>(values.width);
    const auto here = LinesBelow(i);
    const auto differs = [&](std::size_t other) {
      const auto there = LinesBelow(other);
      return here && there && *here != *there;
    };
    return ((i + 1) % width != 0 && differs(i + 1)) ||
           (i + width < values.plane_size() && differs(i + width));
  }
};

std::array<std::uint8_t, 3> FalseColourAt(const ColouredValues& values, std::size_t i,
                                          bool contours) {
  const auto position = values.Position(i);
  if (!position || std::isnan(*position)) return {0, 0, 0};
  const core::Rgb colour = core::FalseColour(*position);
  if (!contours || !values.OnLine(i)) return Codes(colour);
  return core::Luminance(colour) < kDarkLuminance ? std::array<std::uint8_t, 3>{255, 255, 255}
                                                  : std::array<std::uint8_t, 3>{0, 0, 0};
}

std::optional<render::ToneCurve> CurveOf(Tone tone) {
  switch (tone) {
    case Tone::kExponential:
      return render::ToneCurve::kExponential;
    case Tone::kExponentialHue:
      return render::ToneCurve::kExponentialHue;
    case Tone::kFilmic:
      return render::ToneCurve::kFilmic;
    case Tone::kLinear:
    case Tone::kFalseColour:
      break;
  }
  return {};
}

core::Rgb Toned(const core::Rgb& rgb, const Look& look, double average) {
  if (const auto curve = CurveOf(look.tone)) return render::Toned(rgb, *curve, look.k, average);
  core::Rgb display{};
  for (int c = 0; c < 3; ++c) display[c] = std::clamp(rgb[c] * look.exposure, 0.0, 1.0);
  return display;
}

// Of operators whose channels do not know of each other.
std::optional<ToneCodes> CodesOf(const Look& look, double average) {
  if (look.tone != Tone::kExponential && look.tone != Tone::kLinear) return {};
  return ToneCodes([&](float value) {
    return Encoded(Toned({value, value, value}, look, average))[0];
  });
}

}  // namespace

double SrgbDecode(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

Tone ToneOf(render::ToneCurve curve) {
  switch (curve) {
    case render::ToneCurve::kExponentialHue:
      return Tone::kExponentialHue;
    case render::ToneCurve::kFilmic:
      return Tone::kFilmic;
    case render::ToneCurve::kExponential:
      break;
  }
  return Tone::kExponential;
}

bool Look::operator==(const Look& other) const {
  const auto ends = [](const Look& look) {
    return look.scale ? std::array{look.scale->min, look.scale->max} : std::array{0.0, 0.0};
  };
  return tone == other.tone && k == other.k && average == other.average &&
         exposure == other.exposure && layer == other.layer && contours == other.contours &&
         ends(*this) == ends(other);
}

std::uint8_t EncodeByte(double linear) {
  if (!(linear > 0) || !std::isfinite(linear)) return 0;
  if (linear >= 1) return 255;
  int code = Guesses()[static_cast<int>(linear * kGuesses)];
  while (code < 255 && linear >= CodeBegins()[code + 1]) ++code;
  return static_cast<std::uint8_t>(code);
}

double MeanLuminance(const core::Image& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.plane_size(); ++i) sum += core::Luminance(PixelOf(image, i));
  return image.data.empty() ? 0 : sum / static_cast<double>(image.plane_size());
}

Layer ShownLayer(const render::Frame& frame, const Look& look, const LayerSources& sources) {
  return HasLayer(frame, look.layer, sources) ? look.layer : Layer::kRadiance;
}

render::FalseColourScale ScaleOf(const render::Frame& frame, const Look& look,
                                 const LayerSources& sources) {
  if (look.scale) return *look.scale;
  const Layer layer = ShownLayer(frame, look, sources);
  return AutomaticScaleOf(LayerOf(frame, layer, sources), layer);
}

std::vector<std::uint8_t> ColoursOf(const render::Frame& frame, const Look& look,
                                    const LayerSources& sources) {
  std::optional<ColouredValues> values;
  double average = 0;
  if (look.tone == Tone::kFalseColour) {
    const Layer layer = ShownLayer(frame, look, sources);
    values = {layer, LayerOf(frame, layer, sources), ScaleOf(frame, look, sources)};
  } else if (look.tone != Tone::kLinear) {
    average = look.average ? *look.average : MeanLuminance(frame.radiance);
  }
  const std::size_t pixels = frame.radiance.plane_size();
  std::vector<std::uint8_t> bytes(4 * pixels, 255);
  const std::optional<ToneCodes> by_channel = CodesOf(look, average);
  core::ParallelFor(pixels, kGrain, [&](std::size_t begin, std::size_t end) {
    if (by_channel) {
      for (int c = 0; c < 3; ++c) {
        const auto plane = frame.radiance.plane(c);
        for (std::size_t i = begin; i < end; ++i) bytes[4 * i + c] = by_channel->At(plane[i]);
      }
      return;
    }
    for (std::size_t i = begin; i < end; ++i) {
      const auto codes = values ? FalseColourAt(*values, i, look.contours)
                                : Encoded(Toned(PixelOf(frame.radiance, i), look, average));
      std::ranges::copy(codes, bytes.begin() + static_cast<std::ptrdiff_t>(4 * i));
    }
  });
  return bytes;
}

double Saturated(const std::vector<std::uint8_t>& rgba) {
  std::size_t saturated = 0;
  for (std::size_t i = 0; i + 3 < rgba.size(); i += 4)
    saturated += std::max({rgba[i], rgba[i + 1], rgba[i + 2]}) == 255 ? 1 : 0;
  return rgba.empty() ? 0
                      : static_cast<double>(saturated) / (0.25 * static_cast<double>(rgba.size()));
}

}  // namespace luxfield::view
