// What `photometry` says of a lamp: on the terminal, as JSON, as CSV and as a page.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/cli/reports/headlamp_report.h"
#include "luxfield/cli/reports/quality_report.h"
#include "luxfield/core/json.h"
#include "luxfield/photometry/answers.h"
#include "luxfield/photometry/colour.h"
#include "luxfield/photometry/distribution.h"
#include "luxfield/photometry/dose.h"

namespace luxfield::cli {

struct PhotometryReport {
  std::string file, sha256;
  std::string uncertainty;  // what the standard uncertainties are made of, a sentence
  photometry::Distribution distribution;
  photometry::IntensityTable table;
  std::vector<photometry::Weighting> weightings;
  std::vector<photometry::PointAnswer> points;
  std::vector<photometry::LineAnswer> lines;
  std::vector<photometry::PlaneAnswer> planes;
  std::vector<photometry::VolumeAnswer> volumes;
  std::vector<photometry::DoseAnswer> paths;
  std::vector<photometry::EyeAnswer> eyes;
  std::vector<photometry::GlareAnswer> glare;
  std::vector<HeadlampReport> headlamps;
  std::optional<photometry::ColourDistribution> colour;  // of three channels
  QualityReport quality;
};

// "C = 12.0°, gamma = 3.45°", where the largest intensity is; empty where no intensity is above 0.
std::string PeakText(const photometry::Distribution& distribution);

void PrintPhotometry(const PhotometryReport& report);

// docs/photometry.md has the keys.
core::Json ToJson(const PhotometryReport& report);

// A line for every number: quantity, where, value, standard uncertainty, unit.
std::string PhotometryCsv(const PhotometryReport& report);

// `lamp` is what the curves are drawn from.
std::string PhotometryPage(const PhotometryReport& report, const photometry::Lamp& lamp);

}  // namespace luxfield::cli
