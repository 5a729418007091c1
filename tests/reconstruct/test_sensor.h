// A sensor for tests that calibrate one: written for them alone, so that no line of the simulated
// lab or of the calibration judges itself.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::reconstruct {

struct TestSensor {
  std::uint64_t seed = 1;
  int width = 64, height = 64;
  int bits = 12;
  double gain_e_per_dn = 1;
  double read_noise_e = 5;
  double prnu = 0.01;
  double dark_e_per_s = 10;
  double black_dn = 100;
  double light_e_per_s = 3000;
  double shading = 0.05;           // sensitivity lost from the middle to a corner
  double bend = 0;                 // signal lost at full scale, quadratic
  double exposure_offset_s = 0;    // the shutter opens so much longer than it says
  std::vector<std::size_t> hot{};  // 30000 electrons per second more
  std::vector<std::size_t> dead{};
  std::array<double, 4> cell{1, 1, 1, 1};  // sensitivity of a mosaic's 2 x 2 sites

  double full_dn() const { return std::ldexp(1.0, bits) - 1; }
  double full_e() const { return (full_dn() - black_dn) * gain_e_per_dn; }

  // `lamp` scales the light. Noise depends on (seed, stream, pixel).
  session::RawFrame Expose(double lamp, double exposure_s, std::uint64_t stream) const {
    session::RawFrame frame{
        width, height, std::vector<std::uint16_t>(std::size_t(width) * height), {}};
    for (std::size_t p = 0; p < frame.size(); ++p) {
      const double x = 2.0 * static_cast<double>(p % width) / width - 1,
                   y = 2.0 * static_cast<double>(p / width) / height - 1;
      const double sensitivity =
          (1 - 0.5 * shading * (x * x + y * y)) *
          (1 + prnu * core::Random(seed, 1, static_cast<std::uint32_t>(p)).Normal());
      double mean = exposure_s * dark_e_per_s +
                    std::max(0.0, exposure_s + exposure_offset_s) * lamp * light_e_per_s *
                        cell[p / width % 2 * 2 + p % width % 2] * std::max(0.0, sensitivity);
      if (std::binary_search(hot.begin(), hot.end(), p)) mean += 30000 * exposure_s;
      if (std::binary_search(dead.begin(), dead.end(), p)) mean = 0;
      core::Random random(seed, 100 + stream, static_cast<std::uint32_t>(p));
      double electrons = random.Poisson(mean);
      electrons -= bend * electrons * electrons / full_e();
      const double dn = black_dn + (electrons + read_noise_e * random.Normal()) / gain_e_per_dn;
      frame.dn[p] = static_cast<std::uint16_t>(std::clamp(std::round(dn), 0.0, full_dn()));
    }
    return frame;
  }
};

}  // namespace luxfield::reconstruct
