// Coefficients of the Hosek-Wilkie sky model, as published (hosek_wilkie_data.cc has their source
// and licence).
#pragma once

#include <array>

namespace luxfield::environment {

// Of one tristimulus value. Indices from the slowest to the fastest: ground albedo 0 and 1,
// turbidity 1 to 10, the 6 control points of a Bezier curve over the sun's elevation, and for the
// distribution its 9 coefficients A, B, C, D, E, F, G, I and H.
struct HosekWilkieTable {
  std::array<double, 2 * 10 * 6 * 9> distribution;
  std::array<double, 2 * 10 * 6> radiance;  // W sr^-1 m^-2
};
extern const std::array<HosekWilkieTable, 3> kHosekWilkieXyz;  // X, Y, Z

}  // namespace luxfield::environment
