// What `photometry` says of receivers at points, along lines and paths, on planes and in volumes: on
// the terminal, as JSON, as lines of
// CSV and as sections of the page.
#pragma once

#include <string>
#include <vector>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/reports/number_row.h"
#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/cli/reports/photometry_report.h"

namespace luxfield::cli {

// Of the weighting that is named; of the light itself if none is.
PhotometryNames ReceivedNames(const PhotometryReport& report, const std::string& weighting);

void PrintReceived(const PhotometryReport& report);
// Under "weightings", "points", "lines", "planes", "volumes" and "paths".
void PutReceived(core::Json& json, const PhotometryReport& report);
std::vector<NumberRow> ReceivedRows(const PhotometryReport& report);
void AddReceived(HtmlPage& page, const PhotometryReport& report);

}  // namespace luxfield::cli
