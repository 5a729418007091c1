#include "luxfield/cli/reports/estimate_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/photometry/luminance.h"

namespace luxfield::cli {

std::vector<std::string> EstimateRow(const std::string& name, const photometry::Estimate& estimate,
                                     const std::string& unit) {
  std::vector<std::string> row{name, RoundedTo(estimate.value, estimate.u), "", "", unit};
  if (estimate.u) {
    row[2] = UncertaintyText(*estimate.u);
    if (estimate.value != 0)
      row[3] = Digits(100 * *estimate.u / std::abs(estimate.value), 2) + " %";
  }
  return row;
}

std::vector<std::string> EstimateHead(const std::string& of) {
  return {of, "value", "u (k = 1)", "relative", "unit"};
}

bool IsBelowScale(const photometry::Estimate& rating) {
  return rating.value < photometry::kLeastRating;
}
std::string BelowScaleText() { return fmt::format("below {:g}", photometry::kLeastRating); }

std::vector<std::string> RatingRow(const std::string& name, const photometry::Estimate& rating) {
  if (!IsBelowScale(rating)) return EstimateRow(name, rating, "");
  return {name, BelowScaleText(), "", "", ""};
}

std::string EstimateText(const photometry::Estimate& estimate, const std::string& unit) {
  return RoundedTo(estimate.value, estimate.u) +
         (estimate.u ? " +- " + UncertaintyText(*estimate.u) : "") +
         (unit.empty() ? "" : " " + unit);
}

void AddEstimates(HtmlPage& page, EstimateRows rows) {
  const bool any =
      std::any_of(rows.begin() + 1, rows.end(), [](const auto& row) { return !row[2].empty(); });
  if (!any)
    for (auto& row : rows) row.erase(row.begin() + 2, row.begin() + 4);
  page.Table(rows);
}

void AddBeside(HtmlPage& page, const std::vector<std::string>& svgs, const EstimateRows& rows) {
  page.Raw("<div class=\"row\">\n");
  for (const std::string& svg : svgs) page.Raw(svg);
  page.Raw("<div>\n");
  AddEstimates(page, rows);
  page.Raw("</div>\n</div>\n");
}

}  // namespace luxfield::cli
