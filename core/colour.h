// Linear Rec. 709 to what eyes see.
#pragma once

#include <array>

namespace luxfield::core {

using Rgb = std::array<double, 3>;

// Y = 0.2126 R + 0.7152 G + 0.0722 B (linear Rec. 709).
inline double Luminance(const Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

double SrgbEncode(double linear);          // IEC 61966-2-1, input clamped to [0, 1]
Rgb LabFromLinear(const Rgb& linear_rgb);  // CIE 1976 L*a*b*, white D65, input in [0, 1]

// Exponential tone operator 1 - exp(-k L / L_avg) applied to each channel (docs/theory.md 10).
Rgb ExponentialTone(const Rgb& linear, double k, double average_luminance);

// Perceptually ordered false colour (a polynomial fit of ours to a dark-blue to yellow-white ramp),
// t in [0, 1].
Rgb FalseColour(double t);

}  // namespace luxfield::core
