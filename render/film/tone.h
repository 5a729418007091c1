// Tone operators: from radiance to what a screen can show, before sRGB encoding.
//
// The exponential operator acts on each channel (core::ExponentialTone, docs/theory.md 10) and
// bleaches what is bright: a red car turns pink. The two others keep the ratios of a colour's channels,
// so hue and saturation: a curve f with f(0) = 0 and f <= 1 acts on the largest channel, and the others
// follow.
//
//   c' = c f(m) / m,  m = max(R, G, B)
//
// Of a grey that is the curve itself. Negative channels count as 0.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "luxfield/core/colour.h"

namespace luxfield::render {

enum class ToneCurve { kExponential, kExponentialHue, kFilmic };

// As options name them: "exponential", "hue", "filmic".
const std::vector<std::pair<std::string, ToneCurve>>& ToneCurves();

// Display values in [0, 1] by a curve.
core::Rgb Toned(const core::Rgb& linear, ToneCurve curve, double k, double average_luminance);

// f(m) = 1 - exp(-k m / Y_avg): core::ExponentialTone of a grey.
core::Rgb ExponentialHueTone(const core::Rgb& linear, double k, double average_luminance);

// The S-shaped curve that K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2016, fits to that of the
// film industry's ACES, with the average as a middle grey:
//
//   f = x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14), at most 1,  x = 0.18 k m / Y_avg
core::Rgb FilmicTone(const core::Rgb& linear, double k, double average_luminance);

}  // namespace luxfield::render
