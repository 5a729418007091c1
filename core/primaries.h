// Colour spaces by the chromaticities of their primaries, brought to linear Rec. 709.
#pragma once

#include <array>

#include "luxfield/core/colour.h"

namespace luxfield::core {

// CIE 1931 x, y.
struct Chromaticity {
  double x = 0, y = 0;
};

struct Primaries {
  Chromaticity red, green, blue, white;
};

inline constexpr Chromaticity kD65 = {0.3127, 0.3290};
inline constexpr Primaries kRec709 = {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, kD65};

using Matrix3 = std::array<std::array<double, 3>, 3>;  // rows
Rgb Apply(const Matrix3& m, const Rgb& v);

// Tristimulus values of linear R, G, B, with (1, 1, 1) the white at Y = 1 (SMPTE RP 177-1993).
// Throws InputError if a y is not above 0 or the primaries lie on one line.
Matrix3 XyzFromRgb(const Primaries& primaries);

// Linear Rec. 709 from linear R, G, B of these primaries: white stays white, by Bradford's
// chromatic adaptation (Lam 1985; ICC.1:2022 annex E); the identity for Rec. 709's own. Colours
// outside of Rec. 709 come out with a negative channel.
Matrix3 Rec709FromRgb(const Primaries& primaries);

// Linear Rec. 709 from tristimulus values, without adaptation. Its Y differs from Luminance() by at
// most 5e-5: the weights there are rounded to four places.
Rgb Rec709FromXyz(const Rgb& xyz);

// The colour of the same luminance nearest to `rgb` on the line to grey without a negative channel;
// black where the luminance is not above 0.
Rgb IntoGamut(const Rgb& rgb);

}  // namespace luxfield::core
