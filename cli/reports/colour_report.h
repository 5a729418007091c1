// What `photometry` says of the colour of a lamp of three channels.
#pragma once

#include <string>
#include <vector>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/core/json.h"
#include "luxfield/photometry/colour.h"

namespace luxfield::cli {

void PrintColour(const photometry::ColourDistribution& colour);
core::Json ColourJson(const photometry::ColourDistribution& colour);

// {quantity, where, value, u, unit} with a head; without u where there is none.
std::vector<std::vector<std::string>> ColourTable(const photometry::ColourDistribution& colour);
// Correlated colour temperature over gamma in the first C plane and the one a quarter on, as SVG.
std::string ColourPlot(const photometry::ColourDistribution& colour);

void AddColour(HtmlPage& page, const photometry::ColourDistribution& colour);

}  // namespace luxfield::cli
