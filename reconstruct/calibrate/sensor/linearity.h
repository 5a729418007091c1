// Is the signal proportional to exposure (EMVA 1288 R4 Linear 6.7).
//
// S_k: the light's signal of flat pair k, mean - offset - dark. H_k: its exposure time, times the
// lamp monitor's reading where every flat has one. The line a0 + a1 H is fitted to the relative
// deviations of the pairs between 5 % and 95 % of the range,
//
//   minimise sum_k ((S_k - a0 - a1 H_k) / S_k)^2
//   deviation_k = (S_k - a0 - a1 H_k) / (a0 + a1 H_k)
//
// Error of a deviation: the pair's noise, sqrt(V / 2n) / S, and the light's repeatability, through
// the fit. Chi-squared is that of the line of least chi-squared through the same points: about
// `degrees` for a linear sensor. An a0 beside 0 is a shutter that opens a0 / a1 longer than it
// says.
#pragma once

#include <span>
#include <vector>

#include "luxfield/reconstruct/calibrate/sensor/photon_transfer.h"

namespace luxfield::reconstruct {

struct LinearityPoint {
  double exposure_s = 0;
  double signal_dn = 0;  // S
  double deviation = 0, sigma = 0;
};

struct Linearity {
  std::vector<LinearityPoint> points;
  LinearityPoint largest;  // of the largest deviation, up or down
  double chi_squared = 0;
  int degrees = 0;
  Quantity exposure_offset_s;  // a0 / a1 from the line of least chi-squared
  // Relative standard deviation of one frame's light beyond its noise (lamp, shutter, monitor),
  // from the difference of a pair's frames where that exceeds the noise by 3 standard deviations of
  // chi-squared; else 0.
  double repeatability = 0;
  bool by_monitor = false;
};

// `pairs`: flats of one channel (others and darks are passed over) as given to FitPhotonTransfer
// together with `transfer`. Throws InputError for fewer than four levels in the range.
Linearity MeasureLinearity(std::span<const PairStatistics> pairs, const PhotonTransfer& transfer,
                           int channel);

}  // namespace luxfield::reconstruct
