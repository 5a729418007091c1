// The colour of a lamp of three channels, linear Rec. 709, by direction: chromaticity, correlated
// colour temperature and how even it is (docs/photometry.md, "Colour").
//
//   (X, Y, Z) = M (R, G, B),   x = X / (X + Y + Z),   u' = 4 X / (X + 15 Y + 3 Z),   v' = 9 Y / (...)
//
// CIE 15:2018. That is the colour of what the camera measured, as good as its channels were brought to
// Rec. 709. Uncertainties are those of linearisations, noise independent from channel to channel.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/photometry/distribution.h"
#include "luxfield/photometry/lamp.h"

namespace luxfield::photometry {

struct ColourLamp {
  std::array<Lamp, 3> channels;  // of one channel each
};

// Absent unless all fields have three channels. `sigma` as of SetNoise; empty: none.
std::optional<ColourLamp> ColourLampOf(std::span<const lightfield::PosedLightField> fields,
                                       std::span<const lightfield::PosedLightField> sigma,
                                       std::span<const SolveMaps> maps, const std::string& file);

// The correlated colour temperature of u', v': of the black body nearest in (u', 2/3 v') (CIE 15:2018,
// 9.5), and the distance from it there, above 0 on the green side. The locus is Krystek's (Color Res.
// Appl. 10, 38, 1985), off by 1e-4 at most from 1000 to 15000 K. Absent beyond these temperatures and
// 0.05 of distance, where it means nothing.
struct ColourTemperature {
  double kelvin = 0, duv = 0;
};
std::optional<ColourTemperature> ColourTemperatureOf(double u, double v);

struct Colour {
  Estimate x, y;  // CIE 1931
  Estimate u, v;  // CIE 1976 u', v'
  std::optional<Estimate> kelvin, duv;
};
// Of the light that a functional measures of each channel; absent where that has no luminance.
std::optional<Colour> ColourOf(const ColourLamp& lamp, const Functional& functional);

struct ColourDistribution {
  std::optional<Colour> mean;  // of the flux: of all directions together
  std::optional<Colour> axis, peak;
  // The distance of u', v' from the mean's, over directions with a tenth of the largest intensity or
  // more: the largest, and the root of the mean square weighed by intensity. Absent: there is none.
  std::optional<Estimate> largest_deviation;
  Direction largest_at;
  // Noise makes the latter larger, as it does any sum of squares: it has no u where that is more than half
  // of it.
  std::optional<Estimate> rms_deviation;
  // By plane and angle; absent where intensity is below a hundredth of the largest.
  std::vector<double> c_deg, gamma_deg;
  std::vector<std::optional<Colour>> table;  // [plane][angle]
};
// Planes and angles are those of `table`; `peak` is where its lamp's intensity is largest.
ColourDistribution ColourDistributionOf(const ColourLamp& lamp, const IntensityTable& table,
                                        lightfield::Vec3 peak);

}  // namespace luxfield::photometry
