// What `compare` says of two light fields in the words of photometry.
#pragma once

#include <string>
#include <vector>

#include "luxfield/core/json.h"
#include "luxfield/photometry/comparison.h"

namespace luxfield::cli {

struct ComparisonReport {
  std::string file_a, file_b;
  lightfield::FluxUnit unit = lightfield::FluxUnit::kRelative;
  photometry::Comparison comparison;

  std::vector<double> Difference() const;  // of illuminance on the plane, A - B
};

void PrintComparison(const ComparisonReport& report);
core::Json ComparisonJson(const ComparisonReport& report);
std::string ComparisonPage(const ComparisonReport& report);

}  // namespace luxfield::cli
