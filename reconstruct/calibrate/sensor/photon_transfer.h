// Pair statistics -> gain, read noise, dark current, offset and saturation of a sensor
// (docs/theory.md 3, "Sensor by photon transfer"; Janesick, Photon Transfer, SPIE 2007; EMVA 1288
// R4 Linear).
//
// Model, DN; the signal S counts all electrons, of light and of dark current:
//
//   mean = b + S,   temporal variance V = R + g S + 1/12
//   darks: S = q t
//
// b offset, g DN per electron, R read variance, q dark signal per second, 1/12 of rounding (0 for
// float frames). The four are found together by weighted least squares, its weights from the fitted
// model and iterated (Gauss-Newton). For a pair of n pixels with Poisson electrons
//
//   var(V) = (2 V^2 + g^3 S / 2) / n,   var(mean) = V / 2n,   cov(mean, V) = g^2 S / 2n,
//
// so for flats, whose light is unknown, var(V - g (mean - b)) = (2 V^2 + g^2 (R + 1/12) / 2) / n.
// Standard errors are those of this fit; where its residuals exceed its noise by more than 4
// standard deviations of chi-squared, the errors grow by sqrt(chi-squared / degrees).
//
// What it leaves out, and why that does not bias:
//  - Pairs near saturation: mean + 6 s >= saturation (s: spread over the pixels of one frame) or a
//    sample at saturation. s and mean come from all pixels, so the choice does not follow the noise
//    that it would select. Of a mosaic also those in which another colour is saturated: its
//    overflow reaches the neighbours.
//  - Pairs whose V - 1/12 is below 0.49 DN^2, from the variance equations only: below 0.7 DN of
//    noise rounding errors are no longer uniform (they change V by 3e-4 at 0.7 DN, 20 % at 0.4 DN).
//    Read noise then follows from the intercept of brighter pairs, or stays unresolved. Offset and
//    dark current get the rounding error of a mean (at R less two of its errors) in quadrature,
//      sum_k exp(-4 pi^2 k^2 R) / (2 pi^2 k^2) DN^2.
//  - Lamp drift within a pair: B is scaled to A by the ratio of their light.
//
// Bias: 1/g is high by (sigma_g / g)^2 relative, far below its own error. The variance of a bent
// sensor is not g S: where linearity is off by d, the gain is off by about 2 d (linearity.h).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "luxfield/core/quantity.h"
#include "luxfield/reconstruct/calibrate/sensor/pair_statistics.h"

namespace luxfield::reconstruct {

using core::Quantity;

// sqrt of an estimate that may lie at or below 0 within its error: value sqrt(max(v, 0)), sigma the
// way up to sqrt(max(v, 0) + sigma(v)), which is sigma(v) / (2 value) where v is well above 0.
Quantity RootOf(const Quantity& square);

// One pair of flats or darks in the fit.
struct TransferPoint {
  bool dark = false;
  int channel = 0;
  double exposure_s = 0;
  double signal_dn = 0;     // S
  double variance_dn2 = 0;  // V - 1/12
  double model_dn2 = 0;     // R + g S
  double sigma_dn2 = 0;     // of their difference
  bool saturated = false;   // left out of everything
  bool fitted = false;      // in the variance equations
};

struct PhotonTransfer {
  Quantity gain_dn_per_e, gain_e_per_dn;
  Quantity read_variance_dn2, read_variance_e2;  // unbiased: may be negative within their errors
  Quantity read_noise_dn, read_noise_e;
  bool read_noise_resolved = true;  // read_variance_e2 is above 3 of its errors
  Quantity offset_dn;
  Quantity dark_dn_per_s, dark_current_e_per_s;
  std::optional<Quantity> saturation_dn;  // absent: no exposure reached it
  std::optional<Quantity> capacity_e;     // (saturation - offset) / g
  double chi_squared = 0;                 // of the fit
  int degrees = 0;
  std::vector<TransferPoint> points;  // as the pairs given
};

// The saturation level of one channel, from the pair of its longest exposure: its largest value
// where at least 1 % of the samples pile up there (a clipping ADC), else mean - 6 s where the
// variance has fallen below a quarter of its largest (a full well; Granados et al. 2010); else
// absent. Its error is s / sqrt(n), at least 1/sqrt(12) DN.
std::optional<Quantity> FindSaturation(std::span<const PairStatistics> flats);

// Flats of one channel or of several, whose saturation is then the lowest of them, and the darks.
// Throws InputError that names what cannot be calibrated: darks of fewer than two exposure times, a
// black level cut off at 0, every flat saturated, fewer than three levels of flats, flats that get
// darker with exposure, no shot noise above the error of the fit, frames without noise.
PhotonTransfer FitPhotonTransfer(std::span<const PairStatistics> pairs);

}  // namespace luxfield::reconstruct
