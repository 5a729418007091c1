// Codes of the same places under several exposures -> the response curve that explains them, with
// its covariance (docs/theory.md 3, "Cameras that develop their pictures").
//
//   kDebevecMalik  ln I as cubic splines with the smoothness of Debevec & Malik (SIGGRAPH 1997) in
//                  LogitCode, residuals of ln I. The smoothness is that of the data's own curve:
//                  the evidence decides it (MacKay, Neural Computation 4, 1992), 0.03 to 3.
//   kRobertson     The same splines hardly smoothed (1, several times what the curves of
//                  cameras ask for: it bridges codes that no sample has), residuals of exposure, as
//                  Robertson, Borman & Stevenson (Journal of Electronic Imaging 12, 2003) weigh
//                  them.
//   kPolynomial    I a polynomial of z, residuals of exposure (Mitsunaga & Nayar, CVPR 1999); of
//                  the orders up to max_order the one of least BIC among those that rise.
//   kPublished     published_response.h.
//
// The first finds noise and weights as well: sigma of an exposure comes from the residuals
// (response_noise.h), the leverage of curve and radiance counted; it and the choice of codes (a
// relative sigma of at most 15 %, below 97 % of saturation, four sigmas below 98.5 %) follow the
// predicted code and never the code itself. After 7 rounds both are held, until the curve moves by
// less than 3 % of its standard error. The other two start from there and keep weights and choice.
//
// The standard error is from the whole information matrix (joint_response.h), smoothness as prior
// (Wahba, JRSS B 45, 1983), grown by sqrt(chi^2 / degrees) where that is above 1, as for a
// polynomial that does not fit. Where all exposures are one ratio R apart, the part of g that is
// periodic in ln R is known by smoothness alone, and its sigma says so.
#pragma once

#include <span>
#include <string>

#include "luxfield/reconstruct/calibrate/response/fitted_response.h"
#include "luxfield/reconstruct/calibrate/response/response_samples.h"

namespace luxfield::reconstruct {

enum class ResponseMethod { kDebevecMalik, kRobertson, kPolynomial, kPublished };

struct FitResponseOptions {
  ResponseMethod method = ResponseMethod::kDebevecMalik;
  double huber_sigmas = 2.5;  // residuals beyond count linearly
  int max_order = 10;         // of the polynomial
};

// `samples`: single pixels, or histogram levels for kPublished; `exposures_s` as
// samples.exposures. Throws InputError, beginning with `what`, where the samples do not settle a
// curve: fewer than 50 usable in two exposures, or a curve that does not rise about the reference
// code.
FittedResponse FitResponse(const ResponseSamples& samples, std::span<const double> exposures_s,
                           double saturation_code, double reference_code,
                           const FitResponseOptions& options, const std::string& what);

}  // namespace luxfield::reconstruct
