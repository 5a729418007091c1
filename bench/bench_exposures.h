// `luxfield bench exposures`: bias and spread of merged exposures on simulated sensors, beside what
// no unbiased estimator can beat.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/rig/sensor_model.h"

namespace luxfield::bench {

struct BenchExposuresOptions {
  int pixels = 1 << 20;  // of every figure
  int stops = 17;        // a scene from 30 electrons per second up
  int per_stop = 2;      // levels
  std::uint64_t seed = 1;
};

// Fisher information about the mean number of electrons `mean_e` in one sample of a camera that
// counts Poisson electrons, adds normal read noise, rounds to whole DN and clips at 0 and
// saturation:
//
//   p(y) = sum_n P(n | mean) q(y | n),  dP/dmean = P(n - 1) - P(n),  I = sum_y (dp/dmean)^2 / p
//
// with q the normal's share of the rounding interval of y. The sums run over +-9 standard
// deviations in double: relative error below 1e-6. Exact for the sensor, quantisation and clipping
// included; about 1 / (mean + (read^2 + 1/12) / gain^2) where neither matters. The Cramer-Rao bound
// of a bracket is sigma(X) = 1 / sqrt(sum t_i^2 I(t_i X)).
double FisherInformation(const rig::SensorModel& sensor, double mean_e);

// Rows, one a level and sensor, and then what must be flagged:
//   sensor       `14 bit` (8 electrons of read noise, black level 512), `coarse ADC` (20 electrons
//                per DN, 0.1 DN of read noise), `low black` (black level 4 DN, read noise 3.3)
//   e_per_s, used   true X; share of pixels that got a value
//   bias, bias_se   mean / X - 1 and its standard error
//   spread_ratio    standard deviation over the Cramer-Rao bound, standard error 1 / sqrt(2 pixels)
//   sigma_ratio     standard deviation over the root mean square of the stated sigma
// and for `one photon, noisy` (one electron a pixel on average in the longest exposure), `one
// photon, exactly`, `all saturated` and `black above signal` (every sample clips at 0): flagged,
// no_number: shares of pixels that carry a flag, and that report no number. The estimate of one
// photon stays for sums: `bias_kept` is what the mean of the estimates is off the truth, in
// standard deviations of a pixel, `bias_zeroed` if 0 stood for the flagged ones, `bias_dropped` if
// they were left out.
//
// 8 exposures of 0.24 ms to 4 s. Poisson counts, Gaussian noise, rounding and clipping come from
// code that shares nothing with the estimator. Throws InputError if an option is below 1.
nlohmann::json BenchExposures(const BenchExposuresOptions& options = {});

}  // namespace luxfield::bench
