#include "luxfield/view/picture/look.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/core/parallel.h"

namespace luxfield::view {
namespace {

constexpr std::size_t kGrain = 1 << 14;  // pixels

// The linear value whose sRGB encoding is x (IEC 61966-2-1).
double SrgbDecode(double x) {
  return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}

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

std::array<std::uint8_t, 3> FalseColourOf(double luminance, const render::FalseColourScale& scale) {
  if (!(luminance > 0)) return {0, 0, 0};
  const core::Rgb colour =
      core::FalseColour(std::log(luminance / scale.min) / std::log(scale.max / scale.min));
  std::array<std::uint8_t, 3> codes{};
  for (int c = 0; c < 3; ++c)
    codes[c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(colour[c], 0.0, 1.0)));
  return codes;
}

}  // namespace

bool Look::operator==(const Look& other) const {
  const auto ends = [](const Look& look) {
    return look.scale ? std::array{look.scale->min, look.scale->max} : std::array{0.0, 0.0};
  };
  return tone == other.tone && k == other.k && average == other.average &&
         exposure == other.exposure && irradiance == other.irradiance && ends(*this) == ends(other);
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

const core::Image& Shown(const render::Frame& frame, const Look& look) {
  const bool irradiance =
      look.tone == Tone::kFalseColour && look.irradiance && !frame.irradiance.data.empty();
  return irradiance ? frame.irradiance : frame.radiance;
}

render::FalseColourScale ScaleOf(const render::Frame& frame, const Look& look) {
  return look.scale ? *look.scale : render::AutomaticScale(Shown(frame, look));
}

std::vector<std::uint8_t> ColoursOf(const render::Frame& frame, const Look& look) {
  const core::Image& image = Shown(frame, look);
  const double average = look.tone != Tone::kExponential ? 0
                         : look.average                  ? *look.average
                                                         : MeanLuminance(image);
  const render::FalseColourScale scale =
      look.tone == Tone::kFalseColour ? ScaleOf(frame, look) : render::FalseColourScale{};
  std::vector<std::uint8_t> bytes(4 * image.plane_size(), 255);
  core::ParallelFor(image.plane_size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      core::Rgb rgb = PixelOf(image, i);
      std::array<std::uint8_t, 3> codes{};
      if (look.tone == Tone::kFalseColour) {
        codes = FalseColourOf(core::Luminance(rgb), scale);
      } else if (look.tone == Tone::kExponential) {
        codes = Encoded(core::ExponentialTone(rgb, look.k, average));
      } else {
        for (double& value : rgb) value = std::clamp(value * look.exposure, 0.0, 1.0);
        codes = Encoded(rgb);
      }
      std::ranges::copy(codes, bytes.begin() + static_cast<std::ptrdiff_t>(4 * i));
    }
  });
  return bytes;
}

}  // namespace luxfield::view
