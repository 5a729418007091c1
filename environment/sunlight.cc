#include "luxfield/environment/sunlight.h"

#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/core/primaries.h"

namespace luxfield::environment {
namespace {

// Bird and Riordan's table: extraterrestrial irradiance, W m^-2 nm^-1, and the absorption
// coefficients of water vapour, ozone and uniformly mixed gases, 1/cm.
struct Band {
  double nm, irradiance, water, ozone, mixed;
};
constexpr std::array<Band, 34> kBands = {{{380, 1.1038, 0, 0, 0},
                                          {390, 1.0338, 0, 0, 0},
                                          {400, 1.4791, 0, 0, 0},
                                          {410, 1.7013, 0, 0, 0},
                                          {420, 1.7404, 0, 0, 0},
                                          {430, 1.5872, 0, 0, 0},
                                          {440, 1.837, 0, 0, 0},
                                          {450, 2.005, 0, 0.003, 0},
                                          {460, 2.043, 0, 0.006, 0},
                                          {470, 1.987, 0, 0.009, 0},
                                          {480, 2.027, 0, 0.014, 0},
                                          {490, 1.896, 0, 0.021, 0},
                                          {500, 1.909, 0, 0.03, 0},
                                          {510, 1.927, 0, 0.04, 0},
                                          {520, 1.831, 0, 0.048, 0},
                                          {530, 1.891, 0, 0.063, 0},
                                          {540, 1.898, 0, 0.075, 0},
                                          {550, 1.892, 0, 0.085, 0},
                                          {570, 1.84, 0, 0.12, 0},
                                          {593, 1.768, 0.075, 0.119, 0},
                                          {610, 1.728, 0, 0.12, 0},
                                          {630, 1.658, 0, 0.09, 0},
                                          {656, 1.524, 0, 0.065, 0},
                                          {667.6, 1.531, 0, 0.051, 0},
                                          {690, 1.42, 0.016, 0.028, 0.15},
                                          {710, 1.399, 0.0125, 0.018, 0},
                                          {718, 1.374, 1.8, 0.015, 0},
                                          {724.4, 1.373, 2.5, 0.012, 0},
                                          {740, 1.298, 0.061, 0.01, 0},
                                          {752.5, 1.269, 0.0008, 0.008, 0},
                                          {757.5, 1.245, 0.0001, 0.007, 0},
                                          {762.5, 1.223, 1e-5, 0.006, 4},
                                          {767.5, 1.205, 1e-5, 0.005, 0.35},
                                          {780, 1.183, 0.0006, 0, 0}}};

constexpr double kOzoneAtmCm = 0.35, kWaterCm = 2;
constexpr double kLumenPerWatt = 683;

// A Gaussian with one inverse width on either side of its peak.
double Lobe(double nm, double peak, double below, double above) {
  const double t = (nm - peak) * (nm < peak ? below : above);
  return std::exp(-0.5 * t * t);
}

core::Rgb Observer(double nm) {
  return {1.056 * Lobe(nm, 599.8, 0.0264, 0.0323) + 0.362 * Lobe(nm, 442.0, 0.0624, 0.0374) -
              0.065 * Lobe(nm, 501.1, 0.0490, 0.0382),
          0.821 * Lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * Lobe(nm, 530.9, 0.0613, 0.0322),
          1.217 * Lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * Lobe(nm, 459.0, 0.0385, 0.0725)};
}

// The tristimulus values of 1 W m^-2 nm^-1 in each band, spectra being linear between bands.
std::array<core::Rgb, kBands.size()> BandXyz() {
  std::array<core::Rgb, kBands.size()> xyz{};
  for (std::size_t k = 0; k + 1 < kBands.size(); ++k) {
    const double from = kBands[k].nm, width = kBands[k + 1].nm - from;
    const int steps = static_cast<int>(std::ceil(width));
    for (int step = 0; step < steps; ++step) {
      const double t = (step + 0.5) / steps;
      const core::Rgb seen = Observer(from + t * width);
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = kLumenPerWatt * seen[c] * width / steps;
        xyz[k][c] += (1 - t) * value;
        xyz[k + 1][c] += t * value;
      }
    }
  }
  return xyz;
}

// Sum over the bands of spectrum(band), in W m^-2 nm^-1, as Rec. 709 in lx.
template <typename Spectrum>
core::Rgb Seen(Spectrum spectrum) {
  static const auto weights = BandXyz();
  core::Rgb xyz{};
  for (std::size_t k = 0; k < kBands.size(); ++k) {
    const double value = spectrum(kBands[k]);
    for (std::size_t c = 0; c < 3; ++c) xyz[c] += value * weights[k][c];
  }
  return core::IntoGamut(core::Rec709FromXyz(xyz));
}

// At relative air mass `mass`; the sun's sine is for the ozone layer at 22 km.
double Transmittance(const Band& band, double turbidity, double mass, double sine) {
  const double um = band.nm / 1000;
  constexpr double kOzoneHeight = 22.0 / 6370;
  const double ozone_mass = (1 + kOzoneHeight) / std::sqrt(sine * sine + 2 * kOzoneHeight);
  const double water = band.water * kWaterCm * mass, mixed = band.mixed * mass;
  const double thickness = mass * (RayleighThickness(um) + AerosolThickness(turbidity, um)) +
                           band.ozone * kOzoneAtmCm * ozone_mass +
                           0.2385 * water / std::pow(1 + 20.07 * water, 0.45) +
                           1.41 * mixed / std::pow(1 + 118.93 * mixed, 0.45);
  return std::exp(-thickness);
}

}  // namespace

double RayleighThickness(double um) {
  return 1 / (std::pow(um, 4) * (115.6406 - 1.335 / (um * um)));
}

double AerosolThickness(double turbidity, double um) {
  return (0.04608 * turbidity - 0.04586) * std::pow(um, -1.3);
}

core::Rgb DirectNormalIlluminance(const SunPosition& sun, double turbidity) {
  const double elevation = sun.apparent_elevation_deg;
  const double sine = std::sin(elevation * std::numbers::pi / 180);
  const double mass = 1 / (sine + 0.50572 * std::pow(elevation + 6.07995, -1.6364));
  const double nearness = 1 / (sun.distance_au * sun.distance_au);
  return Seen([&](const Band& band) {
    return nearness * band.irradiance * Transmittance(band, turbidity, mass, sine);
  });
}

core::Rgb ExtraterrestrialIlluminance() {
  return Seen([](const Band& band) { return band.irradiance; });
}

}  // namespace luxfield::environment
