// The simulated sensor: electrons and numbers (docs/theory.md 3, "Exposure bracket").
//
//   electrons ~ Poisson(t (1 + prnu_k) v_k R E'_k + t dark_k)
//   DN = clip(round(gain (electrons + overflow) + black + read noise))
//   overflow = blooming_share x (1 - q) / 2 q^(n - 1),   q = exp(-1 / blooming_px)
//
// with the overflow n pixels up or down the column from a pixel that has x electrons more than
// saturation shows.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::hal::sim {

struct SensorModel {
  int width = 0, height = 0;
  int bits = 12;  // 32: no ADC, float DN
  double black_dn = 0;
  double saturation_dn = 0;  // nothing is above
  double gain_dn_per_e = 1;
  std::vector<double> responsivity;  // electrons per second and W m^-2 (or lx), per channel
  std::string cfa;                   // colour mosaic (rig/cfa.h); empty: none
  // Error sources; 0 is off.
  bool photon_noise = false;
  double read_noise_dn = 0;
  double dark_current_e_per_s = 0;
  double prnu = 0;            // rms of a fixed pattern
  double vignetting = 0;      // loss in the corners: v = 1 - loss (r / r_corner)^2
  double blooming_share = 0;  // of the electrons above saturation: what goes into the column
  double blooming_px = 1;     // over which that falls to 1 / e, upwards and downwards alike
  int hot_pixels = 0;
  double hot_current_e_per_s = 0;
};

class Sensor {
 public:
  Sensor(const SensorModel& model, std::uint64_t seed);

  const SensorModel& model() const { return model_; }
  const std::vector<std::pair<int, int>>& hot_pixels() const { return hot_; }  // (row, column)
  core::Image Vignetting() const;  // the relative sensitivity v_k

  // One exposure. `irradiance` is E' per pixel at the lamp's mean power during it, of the colour
  // that the pixel sees, empty for a closed shutter; `channel` is that of a sensor without a
  // mosaic. The noise depends on (seed, stream, pixel) only.
  session::RawFrame Expose(const std::vector<float>& irradiance, double lamp_factor, int channel,
                           double exposure_s, std::uint64_t stream) const;

 private:
  double VignettingAt(int row, int column) const;
  void AddOverflow(std::vector<double>& electrons) const;

  SensorModel model_;
  std::uint64_t seed_;
  std::vector<float> sensitivity_;  // (1 + prnu_k) v_k
  std::vector<float> dark_;         // electrons per second
  std::vector<std::pair<int, int>> hot_;
};

}  // namespace luxfield::hal::sim
