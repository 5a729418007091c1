// How good the measurement of a lamp is (docs/photometry.md, "Quality of the measurement"): as JSON, lines
// of CSV and a section of pages.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/cli/reports/number_row.h"
#include "luxfield/core/json.h"
#include "luxfield/photometry/asked.h"
#include "luxfield/photometry/lamp.h"

namespace luxfield::cli {

struct QualityReport {
  lightfield::FluxUnit unit = lightfield::FluxUnit::kRelative;
  double beyond_planes_flux = 0;          // a bound, in the unit of flux
  std::optional<double> mismatch_factor;  // F
  std::optional<double> mismatch_index;   // f1', 1
  // Of the sensor's calibration, the largest of its channels, 1: f3; the scatter of constant light from
  // frame to frame beyond noise; the spread of sensitivity from pixel to pixel, before the flat field.
  std::optional<double> linearity_index, repeatability, nonuniformity;
  // |F - 1| / sqrt(3): readings are not corrected, and the correction is taken as evenly likely up to
  // that on either side (JCGM 100:2008, 4.3.7).
  std::optional<double> mismatch_u() const;
};

// Throws InputError for files that are not what they are named for.
QualityReport QualityOf(const photometry::Lamp& lamp, const photometry::QualityAsked& asked);

core::Json QualityJson(const QualityReport& report);
std::vector<NumberRow> QualityRows(const QualityReport& report);
// A table with its head, and paragraphs about what the bound is worth and which indices have no number.
std::vector<std::vector<std::string>> QualityTable(const QualityReport& report);
std::vector<std::string> QualityRemarks(const QualityReport& report);

}  // namespace luxfield::cli
