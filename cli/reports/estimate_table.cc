#include "luxfield/cli/reports/estimate_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace luxfield::cli {

std::vector<std::string> EstimateRow(const std::string& name, const photometry::Estimate& estimate,
                                     const std::string& unit) {
  const double value = estimate.value == 0 ? 0.0 : estimate.value;  // no -0
  std::vector<std::string> row{name, fmt::format("{:.5g}", value), "", "", unit};
  if (estimate.u) {
    row[2] = fmt::format("{:.2g}", *estimate.u);
    if (value != 0) row[3] = fmt::format("{:.2g} %", 100 * *estimate.u / std::abs(value));
  }
  return row;
}

std::vector<std::string> EstimateHead(const std::string& of) {
  return {of, "value", "u (k = 1)", "relative", "unit"};
}

std::string EstimateText(const photometry::Estimate& estimate, const std::string& unit) {
  return fmt::format("{:.5g}{} {}", estimate.value,
                     estimate.u ? fmt::format(" +- {:.2g}", *estimate.u) : "", unit);
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
