// How a picture's values become colours on the screen.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "luxfield/render/film/film.h"

namespace luxfield::view {

enum class Tone {
  kExponential,  // 1 - exp(-k L / L_avg), as `render --png` writes
  kLinear,       // radiance times an exposure, clipped at 1, as `render --png --exposure` writes
  kFalseColour   // luminance on a logarithmic scale, as `render --radiance-map` writes
};

struct Look {
  Tone tone = Tone::kExponential;
  double k = 1;                   // of the exponential operator
  std::optional<double> average;  // its L_avg; empty: the picture's mean luminance
  double exposure = 1;            // of the linear one: display value per radiance
  bool irradiance = false;        // false colour of the irradiance instead of the radiance
  std::optional<render::FalseColourScale> scale;  // empty: from the picture
  bool operator==(const Look& other) const;
};

// The image that a look shows: radiance, or irradiance where that is asked for and known.
const core::Image& Shown(const render::Frame& frame, const Look& look);

// Of all pixels; 0 of a picture without any.
double MeanLuminance(const core::Image& image);

// What the false colours of a frame span.
render::FalseColourScale ScaleOf(const render::Frame& frame, const Look& look);

// Red, green, blue, 255 of every pixel, row 0 on top: the same bytes that render::WritePng writes of
// render::ToneMap, and render::WriteFalseColour of the picture beside its legend.
std::vector<std::uint8_t> ColoursOf(const render::Frame& frame, const Look& look);

// 255 x the sRGB encoding of a linear value, rounded to nearest: core::SrgbEncode by a table. Values
// that are not finite are 0.
std::uint8_t EncodeByte(double linear);

}  // namespace luxfield::view
