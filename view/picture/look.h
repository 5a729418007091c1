// How a picture's values become colours on the screen.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "luxfield/view/picture/layer.h"

namespace luxfield::view {

enum class Tone {
  kExponential,     // 1 - exp(-k L / L_avg) of each channel, as `render --png` writes
  kLinear,          // radiance times an exposure, clipped at 1, as `render --png --exposure` writes
  kFalseColour,     // a layer on a scale of colours, luminance as `render --radiance-map` writes it
  kExponentialHue,  // the exponential curve of the largest channel (render/film/tone.h)
  kFilmic           // a filmic curve, likewise
};

// That shows a curve of render/film/tone.h.
Tone ToneOf(render::ToneCurve curve);

struct Look {
  Tone tone = Tone::kExponential;
  double k = 1;                    // of the exponential operators and the filmic one
  std::optional<double> average;   // their L_avg; empty: the picture's mean luminance
  double exposure = 1;             // of the linear one: display value per radiance
  Layer layer = Layer::kRadiance;  // of false colours
  std::optional<render::FalseColourScale> scale;  // empty: from the picture
  // Lines of equal value in false colours: at 1, 2 and 5 of every decade, of linear scales at tenths.
  bool contours = false;
  bool operator==(const Look& other) const;
};

// Of all pixels; 0 of a picture without any.
double MeanLuminance(const core::Image& image);

// The layer that a look's false colours show: its own where the frame has it, else the radiance.
Layer ShownLayer(const render::Frame& frame, const Look& look, const LayerSources& sources);

// What the false colours of a frame span.
render::FalseColourScale ScaleOf(const render::Frame& frame, const Look& look,
                                 const LayerSources& sources = {});

// Red, green, blue, 255 of every pixel, row 0 on top: the same bytes that render::WritePng writes of
// render::ToneMap, and render::WriteFalseColour of the picture beside its legend.
std::vector<std::uint8_t> ColoursOf(const render::Frame& frame, const Look& look,
                                    const LayerSources& sources = {});

// The share of such pixels of which a channel is 255, the largest that the screen has.
double Saturated(const std::vector<std::uint8_t>& rgba);

// The linear value whose sRGB encoding is that (IEC 61966-2-1).
double SrgbDecode(double encoded);

// 255 x the sRGB encoding of a linear value, rounded to nearest: core::SrgbEncode by a table. Values
// that are not finite are 0.
std::uint8_t EncodeByte(double linear);

}  // namespace luxfield::view
