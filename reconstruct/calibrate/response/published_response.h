// Debevec & Malik's response curve (SIGGRAPH 1997) as printed, to compare other programs with: the
// g and ln X of least
//
//   sum_ij [w(z_ij) (g(z_ij) - ln X_i - ln t_j)]^2 + sum_z [lambda w(z) g''(z)]^2
//   g(reference) = 0
//
// at every code z of 8 bits, g'' = g(z - 1) - 2 g(z) + g(z + 1), lambda = 30, w a hat of height 1
// over the codes from 1 % to 99 % (as colour-hdri has it). The normal equations of g, with ln X
// eliminated, are solved by a Cholesky factorisation in double: their condition number, below 1e10,
// leaves 6 digits of g.
//
// The standard error comes from the residuals' scatter. It holds neither what the smoothness bends
// nor that the hat is no noise model: compare with it, measure with another method.
#pragma once

#include <span>
#include <string>

#include "luxfield/reconstruct/calibrate/response/fitted_response.h"
#include "luxfield/reconstruct/calibrate/response/response_samples.h"

namespace luxfield::reconstruct {

// `samples` of 8-bit pictures, one pixel or histogram level each; `exposures_s` as
// samples.exposures. Throws InputError, beginning with `what`, where fewer than 50 samples count in
// two exposures, or where g does not rise about the reference code.
FittedResponse FitPublishedResponse(const ResponseSamples& samples,
                                    std::span<const double> exposures_s, double reference_code,
                                    const std::string& what);

}  // namespace luxfield::reconstruct
