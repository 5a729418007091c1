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
#include <utility>
#include <vector>

#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::hal::sim {

// The camera's own model, whose read noise, dark current and PRNU are 0 where they are switched off,
// whose saturation nothing is above, and whose defects and vignetting are empty: what follows makes
// them.
struct SimulatedSensor : rig::SensorModel {
  bool photon_noise = false;
  double corner_loss = 0;     // vignetting: v = 1 - loss (r / r_corner)^2
  double blooming_share = 0;  // of the electrons above saturation: what goes into the column
  double blooming_px = 1;     // over which that falls to 1 / e, upwards and downwards alike
  int hot_pixels = 0;
  double hot_current_e_per_s = 0;
};

class Sensor {
 public:
  Sensor(const SimulatedSensor& model, std::uint64_t seed);

  const SimulatedSensor& model() const { return model_; }
  const std::vector<std::pair<int, int>>& hot_pixels() const { return hot_; }  // (row, column)
  std::vector<float> Vignetting() const;  // the relative sensitivity v_k

  // One exposure. `irradiance` is E' per pixel at the lamp's mean power during it, of the colour
  // that the pixel sees, empty for a closed shutter; `channel` is that of a sensor without a
  // mosaic. The noise depends on (seed, stream, pixel) only.
  session::RawFrame Expose(const std::vector<float>& irradiance, double lamp_factor, int channel,
                           double exposure_s, std::uint64_t stream) const;

 private:
  double VignettingAt(int row, int column) const;
  void AddOverflow(std::vector<double>& electrons) const;

  SimulatedSensor model_;
  std::uint64_t seed_;
  std::vector<float> sensitivity_;  // (1 + prnu_k) v_k
  std::vector<float> dark_;         // electrons per second
  std::vector<std::pair<int, int>> hot_;
};

}  // namespace luxfield::hal::sim
