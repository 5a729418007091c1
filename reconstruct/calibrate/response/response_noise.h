// How far exposures scatter about what a response curve predicts.
#pragma once

#include <vector>

namespace luxfield::reconstruct {

// ln of the exposure that a code stands for, against the prediction of a fit that it took part in.
struct ExposureResidual {
  double predicted_code = 0;
  double residual = 0;
  double leverage = 0;  // share of this sample in its own prediction, 0 to 1
};

struct ExposureNoise {
  std::vector<double> code, sigma;
};

// Standard deviations in at most `bins` parts of all codes, evenly spaced in LogitCode and with at
// least 40 residuals each; residuals grow by 1 / sqrt(1 - leverage), and those beyond 3 standard
// deviations count as 3 (with the factor that makes this exact for normal noise). Residuals of a
// leverage above 0.95 say nothing and are left out. Empty where fewer than 40 are left.
ExposureNoise EstimateExposureNoise(std::vector<ExposureResidual> residuals, double saturation_code,
                                    int bins);

}  // namespace luxfield::reconstruct
