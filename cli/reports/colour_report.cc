#include "luxfield/cli/reports/colour_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/cli/svg/svg_plot.h"

namespace luxfield::cli {
namespace {

using core::Json;
using photometry::Colour;
using photometry::ColourDistribution;
using photometry::Estimate;
using Rows = std::vector<std::vector<std::string>>;

Json OneJson(const std::optional<Colour>& colour) {
  if (!colour) return {};
  Json json;
  PutEstimate(json, "x", colour->x);
  PutEstimate(json, "y", colour->y);
  PutEstimate(json, "u_prime", colour->u);
  PutEstimate(json, "v_prime", colour->v);
  PutEstimate(json, "cct_k", colour->kelvin);
  PutEstimate(json, "duv", colour->duv);
  return json;
}

// A list for each plane of one figure of the table, null where there is none.
template <typename F>
Json Figures(const ColourDistribution& colour, F&& of) {
  Json planes = Json::array();
  const std::size_t angles = colour.gamma_deg.size();
  for (std::size_t k = 0; k < colour.table.size(); ++k) {
    if (k % angles == 0) planes.push_back(Json::array());
    const auto value = colour.table[k] ? of(*colour.table[k]) : std::nullopt;
    planes.back().push_back(OptionalJson(value));
  }
  return planes;
}

void AddRow(Rows* rows, const std::string& quantity, const std::string& where,
            const std::optional<Estimate>& estimate, const char* format, const std::string& unit) {
  if (!estimate) return;
  rows->push_back({quantity, where,
                   estimate->u ? RoundedTo(estimate->value, estimate->u)
                               : fmt::format(fmt::runtime(format), estimate->value),
                   estimate->u ? UncertaintyText(*estimate->u) : "", unit});
}

void AddRows(Rows* rows, const std::string& where, const std::optional<Colour>& colour) {
  if (!colour) return;
  AddRow(rows, "x", where, colour->x, "{:.4f}", "");
  AddRow(rows, "y", where, colour->y, "{:.4f}", "");
  AddRow(rows, "u'", where, colour->u, "{:.4f}", "");
  AddRow(rows, "v'", where, colour->v, "{:.4f}", "");
  AddRow(rows, "correlated colour temperature", where, colour->kelvin, "{:.0f}", "K");
  AddRow(rows, "Duv", where, colour->duv, "{:+.4f}", "");
}

}  // namespace

void PrintColour(const ColourDistribution& colour) {
  if (!colour.mean) return;
  fmt::print("  {:<18}x {:.4f}, y {:.4f}{}\n", "colour, mean", colour.mean->x.value,
             colour.mean->y.value,
             colour.mean->kelvin ? fmt::format(", {:.0f} K", colour.mean->kelvin->value) : "");
  if (colour.largest_deviation)
    fmt::print("  {:<18}{:.4f} at C {:.1f}, gamma {:.1f}\n", "largest du'v'",
               colour.largest_deviation->value, colour.largest_at.c_deg,
               colour.largest_at.gamma_deg);
}

Json ColourJson(const ColourDistribution& colour) {
  Json json = {
      {"mean", OneJson(colour.mean)},
      {"axis", OneJson(colour.axis)},
      {"peak", OneJson(colour.peak)},
      {"deviation_largest_at_deg", colour.largest_deviation
                                       ? Json{colour.largest_at.c_deg, colour.largest_at.gamma_deg}
                                       : Json()},
      {"c_deg", colour.c_deg},
      {"gamma_deg", colour.gamma_deg},
      {"x", Figures(colour, [](const Colour& c) { return std::optional(c.x.value); })},
      {"y", Figures(colour, [](const Colour& c) { return std::optional(c.y.value); })},
      {"cct_k", Figures(colour, [](const Colour& c) {
         return c.kelvin ? std::optional(c.kelvin->value) : std::nullopt;
       })}};
  PutEstimate(json, "deviation_largest", colour.largest_deviation);
  PutEstimate(json, "deviation_rms", colour.rms_deviation);
  return json;
}

Rows ColourTable(const ColourDistribution& colour) {
  Rows rows{{"quantity", "where", "value", "u (k = 1)", "unit"}};
  AddRows(&rows, "all of the flux", colour.mean);
  AddRows(&rows, "axis", colour.axis);
  AddRow(&rows, "largest Δu'v' from the mean, within 10 % of the largest intensity",
         fmt::format("C = {:.1f}°, gamma = {:.1f}°", colour.largest_at.c_deg,
                     colour.largest_at.gamma_deg),
         colour.largest_deviation, "{:.4f}", "");
  AddRow(&rows, "root mean square of Δu'v'", "the same directions, weighed by intensity",
         colour.rms_deviation, "{:.4f}", "");
  const bool any =
      std::any_of(rows.begin() + 1, rows.end(), [](const auto& row) { return !row[3].empty(); });
  if (!any)
    for (auto& row : rows) row.erase(row.begin() + 3);
  return rows;
}

std::string ColourPlot(const ColourDistribution& colour) {
  Plot plot;
  plot.title = "Correlated colour temperature";
  plot.x_label = "gamma, °";
  plot.y_label = "K";
  plot.width = 560;
  const std::size_t angles = colour.gamma_deg.size(), planes = colour.c_deg.size();
  for (const std::size_t plane : {std::size_t{0}, planes / 4}) {
    Series series;
    series.name = fmt::format("C{:.0f}", colour.c_deg[plane]);
    series.dashed = plane != 0;
    for (std::size_t k = 0; k < angles; ++k)
      if (const auto& one = colour.table[plane * angles + k]; one && one->kelvin) {
        series.x.push_back(colour.gamma_deg[k]);
        series.y.push_back(one->kelvin->value);
      }
    plot.series.push_back(std::move(series));
    if (planes < 4) break;
  }
  return SvgPlot(plot);
}

void AddColour(HtmlPage& page, const ColourDistribution& colour) {
  page.Heading("Colour");
  if (!colour.mean) {
    page.Paragraph("There is no light whose colour could be told.");
    return;
  }
  page.Table(ColourTable(colour));
  page.Raw(ColourPlot(colour));
}

}  // namespace luxfield::cli
