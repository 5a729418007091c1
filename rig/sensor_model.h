// What a sensor does to light (docs/theory.md 3, "Exposure bracket"; docs/formats/session.md,
// "session.json").
//
//   y = black_dn + gain_dn_per_e * t * (a X + dark_current_e_per_s) + noise
//   var(y) = gain_dn_per_e * (y - black_dn) + read_noise_dn^2 + quantisation_variance_dn2
//
// with X in electrons per second.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace luxfield::rig {

struct SensorModel {
  int width = 0, height = 0;
  int bits = 16;  // 32: float DN of a camera without an ADC
  double gain_dn_per_e = 1;
  double read_noise_dn = 0;
  double black_dn = 0;
  double saturation_dn = 65535;  // a sample of at least this is clipped
  double prnu = 0;               // relative standard deviation of the pixels' sensitivity
  double dark_current_e_per_s = 0;
  std::vector<double>
      responsivity_e_per_s_per_w_m2;  // per channel: electrons per second at 1 W m^-2
  std::string cfa;  // colour mosaic (rig/cfa.h): one frame holds all channels; empty: none
  std::vector<std::pair<int, int>> defects;  // (row, column)
  std::vector<float> vignetting;             // relative sensitivity per pixel; empty: 1 everywhere

  // Of rounding to whole numbers, 1/12; for a float DN only what keeps variances above zero.
  double quantisation_variance_dn2() const {
    if (bits < 32) return 1.0 / 12;
    const double rounding_dn = 1e-7 * saturation_dn;  // float32 keeps 24 bits of full scale
    return rounding_dn * rounding_dn;
  }
};

}  // namespace luxfield::rig
