// What a fit of a response curve returns, and why it refuses.
#pragma once

#include <string>

#include "luxfield/core/error.h"
#include "luxfield/reconstruct/calibrate/response/response_curve.h"

namespace luxfield::reconstruct {

struct FittedResponse {
  ResponseCurve curve;  // noise_* : of a sample, not of a pixel
  double chi_squared = 0;
  double degrees = 0;  // codes less radiances less the parameters that the data fix
  int samples = 0;     // that took part
  int order = 0;       // of a polynomial
};

constexpr int kLeastResponseSamples = 50;

InputError TooFewResponseSamples(const std::string& what, std::size_t samples);
InputError NoRisingCurve(const std::string& what, double reference_code);
InputError NoSolution(const std::string& what);

}  // namespace luxfield::reconstruct
