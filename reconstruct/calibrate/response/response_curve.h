// The inverse response of a camera that is not linear: the code of a pixel -> the exposure that
// made it (docs/theory.md 3, "Cameras that develop their pictures"; Debevec & Malik, SIGGRAPH
// 1997).
//
//   t X = I(z) = exp(g(z)),   g(reference_code) = 0
//
// z is the code of a picture file, 0 to saturation_code; I the exposure in units of the one that
// gives reference_code; X the radiance in those units per second. Between nodes g is linear in
// ln z: I is a piecewise power law, exact for a linear camera and for every power of z.
//
// Gauge: pictures show I only up to a factor, which is fixed at reference_code, per channel. Were
// the exposure ratios unknown too, I^p with X^p and t^p would fit as well for every p (Grossberg &
// Nayar, PAMI 2003): a curve and its exposure ratios are never found from one stack together.
#pragma once

#include <vector>

namespace luxfield::reconstruct {

struct ResponseCurve {
  double saturation_code = 255;  // codes of at least this are clipped
  double reference_code = 128;
  // Nodes, rising in both; codes below the first or above the last are not calibrated.
  std::vector<double> code, log_exposure;
  std::vector<double> sigma;  // standard error of log_exposure: relative error of I
  // Relative standard deviation of the exposure that one pixel's code stands for, at codes in
  // rising order; its logarithm is linear in LogitCode between them, falls as 1 / z before and is
  // constant after. Holds everything that differs from picture to picture: photon and read noise,
  // rounding, compression, movement.
  std::vector<double> noise_code, noise;

  double low_code() const { return code.front(); }
  double high_code() const { return code.back(); }
  double LogExposure(double z) const;       // power laws of the outermost intervals go on outside
  double Code(double log_exposure_) const;  // the inverse of LogExposure
  double Sigma(double z) const;
  double Noise(double z) const;
};

// Where z lies between two ends that both compress: ln(z / (saturation - z)).
double LogitCode(double z, double saturation_code);

// About `count` whole codes from 1 to saturation - 1, evenly spaced in LogitCode where codes are
// denser than that, the reference code among them.
std::vector<double> CurveNodes(double saturation_code, double reference_code, int count);

// Interval k and share f of value x among rising positions: x = (1 - f) p[k] + f p[k + 1]; f may
// leave [0, 1] outside of them.
struct Place {
  int k;
  double f;
};
Place FindPlace(const std::vector<double>& positions, double x);

}  // namespace luxfield::reconstruct
