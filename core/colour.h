// Linear Rec. 709 to what eyes see.
#pragma once

#include <array>

#include "luxfield/core/luminance_weights.clh"

namespace luxfield::core {

using Rgb = std::array<double, 3>;

inline constexpr Rgb kLuminanceWeights = {LUXFIELD_LUMINANCE_WEIGHTS()};

// Y of luminance_weights.clh.
inline double Luminance(const Rgb& c) {
  return kLuminanceWeights[0] * c[0] + kLuminanceWeights[1] * c[1] + kLuminanceWeights[2] * c[2];
}

double SrgbEncode(double linear);          // IEC 61966-2-1, input clamped to [0, 1]
Rgb LabFromLinear(const Rgb& linear_rgb);  // CIE 1976 L*a*b*, white D65, input in [0, 1]

// Exponential tone operator 1 - exp(-k L / L_avg) applied to each channel (docs/theory.md 10).
Rgb ExponentialTone(const Rgb& linear, double k, double average_luminance);

// Perceptually ordered false colour (a polynomial fit of ours to a dark-blue to yellow-white ramp),
// t in [0, 1].
Rgb FalseColour(double t);

}  // namespace luxfield::core
