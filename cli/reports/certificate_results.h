// The results of a certificate, one a line, with their expanded uncertainties.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/cli/reports/certificate.h"

namespace luxfield::cli {

struct CertificateResult {
  std::string quantity, where, unit;
  double value = 0;
  std::optional<double> u;         // of noise
  std::optional<double> expanded;  // k = 2, of all that is known
  bool rating = false;             // a unified glare rating, as of NumberRow
};

// Of the flux' budget, without photon and read noise, over its value, and of the spectral mismatch;
// absent without either.
std::optional<double> CommonRelative(const Certificate& certificate,
                                     const PhotometryReport& report);

std::vector<CertificateResult> CertificateResults(const Certificate& certificate,
                                                  const PhotometryReport& report);

}  // namespace luxfield::cli
