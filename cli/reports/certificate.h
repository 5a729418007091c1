// A certificate of a lamp's photometry: two to four pages that a laboratory hands to a customer with
// what ISO/IEC 17025:2017, 7.8 asks of a report, and the same as JSON
// (docs/formats/certificate.schema.json). What nobody states is said to be so.
//
// Expanded uncertainties have k = 2. With a budget the flux has the budget's own, and what is
// proportional to the light that of its noise and of what all light shares,
//
//   U = 2 sqrt(u_noise^2 + (c value)^2)
//
// c the flux's relative standard deviation from all sources but photon and read noise. Without one it
// is that of noise alone, which the certificate says.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/cli/reports/photometry_report.h"
#include "luxfield/reconstruct/budget/error_budget.h"

namespace luxfield::cli {

struct HashedFile {
  std::string role, file, sha256;
};

struct Certificate {
  std::map<std::string, std::string> texts;  // photometry::kCertificateTexts, by key
  std::vector<HashedFile> files;
  std::vector<std::pair<std::string, std::string>> set_up;  // of the session; empty: none was given
  std::optional<reconstruct::ErrorBudget> budget;
};

core::Json CertificateJson(const Certificate& certificate, const PhotometryReport& report);

// `lamp` is what the curves are drawn from.
void WriteCertificate(const std::filesystem::path& pdf, const Certificate& certificate,
                      const PhotometryReport& report, const photometry::Lamp& lamp);

}  // namespace luxfield::cli
