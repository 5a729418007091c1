// Tables of a page whose rows are values with their standard uncertainties.
#pragma once

#include <string>
#include <vector>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/photometry/functional.h"

namespace luxfield::cli {

using EstimateRows = std::vector<std::vector<std::string>>;

// {name, value, u, u / value, unit}; a table's first row is EstimateHead.
std::vector<std::string> EstimateRow(const std::string& name, const photometry::Estimate& estimate,
                                     const std::string& unit);
std::vector<std::string> EstimateHead(const std::string& of);

// A unified glare rating as people read it: "below 10" without more, from there on as other estimates.
bool IsBelowScale(const photometry::Estimate& rating);
std::string BelowScaleText();
std::vector<std::string> RatingRow(const std::string& name, const photometry::Estimate& rating);

// "12.3 +- 0.4 lm", as the terminal shows it.
std::string EstimateText(const photometry::Estimate& estimate, const std::string& unit);

// As a table; without the columns of uncertainties where there are none.
void AddEstimates(HtmlPage& page, EstimateRows rows);
// Beside plots.
void AddBeside(HtmlPage& page, const std::vector<std::string>& svgs, const EstimateRows& rows);

}  // namespace luxfield::cli
