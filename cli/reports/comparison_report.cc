#include "luxfield/cli/reports/comparison_report.h"

#include <fmt/format.h>

#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/reports/photometry_plots.h"
#include "luxfield/cli/reports/rounded_number.h"

namespace luxfield::cli {
namespace {

using core::Json;
using photometry::ComparedQuantity;
using photometry::ComparedUnit;
using photometry::Estimate;
using Rows = std::vector<std::vector<std::string>>;

std::string UnitOf(const ComparedQuantity& quantity, const PhotometryNames& names) {
  switch (quantity.unit) {
    case ComparedUnit::kFlux:
      return names.flux_unit;
    case ComparedUnit::kIntensity:
      return names.intensity_unit;
    case ComparedUnit::kIlluminance:
      return names.illuminance_unit;
    case ComparedUnit::kDegree:
      return "°";
    case ComparedUnit::kNone:
      break;
  }
  return "";
}

std::string Text(const std::optional<Estimate>& estimate) {
  return estimate ? RoundedTo(estimate->value, estimate->u) : "none";
}
std::string Signed(const Estimate& estimate) {
  const std::string text =
      estimate.u ? RoundedTo(estimate.value, estimate.u) : Digits(estimate.value, 4);
  return text == "0" || text[0] == '-' ? text : "+" + text;
}

Rows TableOf(const ComparisonReport& report) {
  const PhotometryNames names = NamesOf(report.unit);
  Rows rows{{"quantity", "A", "B", "A - B", "u (k = 1)", "in u", "of B", "unit"}};
  for (const ComparedQuantity& quantity : report.comparison.quantities) {
    const auto difference = quantity.Difference();
    const auto in_u = quantity.InUncertainties();
    const bool share = difference && quantity.b->value != 0;
    rows.push_back(
        {quantity.name, Text(quantity.a), Text(quantity.b), difference ? Signed(*difference) : "",
         difference && difference->u ? UncertaintyText(*difference->u) : "",
         in_u ? fmt::format("{:+.1f}", *in_u) : "",
         share ? fmt::format("{:+.2f} %", 100 * difference->value / quantity.b->value) : "",
         UnitOf(quantity, names)});
  }
  return rows;
}

}  // namespace

std::vector<double> ComparisonReport::Difference() const {
  std::vector<double> difference = comparison.plane_a.values;
  for (std::size_t k = 0; k < difference.size(); ++k) difference[k] -= comparison.plane_b.values[k];
  return difference;
}

void PrintComparison(const ComparisonReport& report) {
  const PhotometryNames names = NamesOf(report.unit);
  for (const ComparedQuantity& quantity : report.comparison.quantities) {
    const auto difference = quantity.Difference();
    if (!difference) continue;
    const auto in_u = quantity.InUncertainties();
    fmt::print("  {:<28}{:>11} {:<5}{}\n", quantity.name, Signed(*difference),
               UnitOf(quantity, names), in_u ? fmt::format("{:+.1f} u", *in_u) : "");
  }
}

Json ComparisonJson(const ComparisonReport& report) {
  const PhotometryNames names = NamesOf(report.unit);
  Json quantities = Json::array();
  for (const ComparedQuantity& quantity : report.comparison.quantities) {
    Json one = {{"name", quantity.name},
                {"unit", UnitOf(quantity, names)},
                {"in_uncertainties", OptionalJson(quantity.InUncertainties())}};
    PutEstimate(one, "a", quantity.a);
    PutEstimate(one, "b", quantity.b);
    PutEstimate(one, "difference", quantity.Difference());
    quantities.push_back(one);
  }
  const auto& plane = report.comparison.plane_a.asked;
  return {{"quantities", quantities},
          {"plane",
           {{"name", plane.name},
            {"centre_m", VectorJson(plane.centre_m)},
            {"width_m", plane.width_m},
            {"height_m", plane.height_m},
            {names.Illuminance("a"), RowsJson(report.comparison.plane_a.values, plane.columns)},
            {names.Illuminance("b"), RowsJson(report.comparison.plane_b.values, plane.columns)}}}};
}

std::string ComparisonPage(const ComparisonReport& report) {
  const PhotometryNames names = NamesOf(report.unit);
  HtmlPage page("Two lamps compared");
  page.Paragraph(fmt::format("A: {}; B, the reference: {}.", report.file_a, report.file_b));
  const bool known = report.comparison.quantities[0].InUncertainties().has_value();
  page.Paragraph(
      known ? "u is the standard uncertainty of the difference, from the noise of both; a "
              "difference of more than two or three of them is no noise."
            : "Without --sigma-a and --sigma-b nobody knows what of the differences is noise.");
  Rows rows = TableOf(report);
  if (!known)
    for (auto& row : rows) row.erase(row.begin() + 4, row.begin() + 6);
  page.Table(rows);
  IsoluxMap a = IsoluxOf(report.comparison.plane_a, names),
            b = IsoluxOf(report.comparison.plane_b, names), difference = a;
  a.title = "A: " + a.title;
  b.title = "B: " + b.title;
  difference.title = "A - B, " + report.comparison.plane_a.asked.name;
  difference.values = report.Difference();
  page.Raw("<div class=\"row\">\n");
  for (const std::string& svg : {SvgIsolux(a), SvgIsolux(b), SvgDifference(difference)})
    page.Raw(svg);
  page.Raw("</div>\n");
  return page.Text();
}

}  // namespace luxfield::cli
