// `compare` of two light fields in the words of photometry.
#pragma once

#include <string>

#include "luxfield/cli/reports/comparison_report.h"

namespace luxfield::cli {

struct LampsToCompare {
  std::string a, b, sigma_a, sigma_b;  // files; sigma empty: none
  double distance_m = 1;               // of the plane, as wide as B's beam
};

// Of lamps whose fluxes are in one unit.
ComparisonReport CompareLamps(const LampsToCompare& lamps);

}  // namespace luxfield::cli
