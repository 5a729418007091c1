#include "luxfield/cli/reports/received_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/estimate_table.h"
#include "luxfield/cli/reports/photometry_plots.h"
#include "luxfield/cli/svg/svg_isolux.h"

namespace luxfield::cli {
namespace {

using core::Json;
using lightfield::Vec3;
using photometry::Estimate;
using photometry::PlaneAnswer;
using photometry::PointAnswer;

std::string PlaceText(Vec3 p) {
  return fmt::format("x = {:.6g} m; y = {:.6g} m; z = {:.6g} m", p.x, p.y, p.z);
}

// What a line of CSV is of: "illuminance", "spherical illuminance", "PPFD".
std::string RowName(const PhotometryNames& names, const std::string& weighting,
                    const std::string& which = {}) {
  return (which.empty() ? "" : which + " ") +
         (weighting.empty() ? names.illuminance_key : weighting);
}

// Which weighting, and in what unit.
void PutWeighting(Json& json, const std::string& weighting, const PhotometryNames& names) {
  json["weighting"] = weighting.empty() ? Json() : Json(weighting);
  json["unit"] = names.illuminance_unit;
}

Json WeightingJson(const photometry::Weighting& weighting) {
  return {{"name", weighting.name}, {"unit", weighting.unit}, {"factors", weighting.factors}};
}

Json PointJson(const PointAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  Json json = {{"name", asked.name},
               {"position_m", VectorJson(asked.p_m)},
               {"normal", VectorJson(asked.normal)},
               {"axis", VectorJson(asked.axis)},
               {"facing", asked.facing ? VectorJson(*asked.facing) : Json()}};
  PutWeighting(json, asked.weighting, names);
  PutEstimate(json, names.Illuminance(), answer.illuminance);
  PutEstimate(json, names.Illuminance("spherical"), answer.spherical);
  PutEstimate(json, names.Illuminance("cylindrical"), answer.cylindrical);
  PutEstimate(json, names.Illuminance("semicylindrical"), answer.semicylindrical);
  Json vector = Json::array(), u = Json::array();
  for (const Estimate& component : answer.light_vector) {
    vector.push_back(component.value);
    u.push_back(OptionalJson(component.u));
  }
  json["light_vector_" + names.illuminance_suffix] = vector;
  json["light_vector_" + names.illuminance_suffix + "_u"] = answer.light_vector[0].u ? u : Json();
  return json;
}

Json PlaneJson(const PlaneAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  const auto key = [&](const char* which) {
    return names.Illuminance(asked.receiver.shape, which);
  };
  Json json = {{"name", asked.name},
               {"centre_m", VectorJson(asked.centre_m)},
               {"right", VectorJson(asked.right)},
               {"up", VectorJson(asked.up)},
               {"normal", VectorJson(asked.Normal())},
               {"width_m", asked.width_m},
               {"height_m", asked.height_m},
               {"columns", asked.columns},
               {"rows", asked.rows},
               {key(""), RowsJson(answer.values, asked.columns)},
               {"min_at_m", VectorJson(asked.Point(answer.least_at[0], answer.least_at[1]))},
               {"max_at_m", VectorJson(asked.Point(answer.most_at[0], answer.most_at[1]))}};
  PutWeighting(json, asked.weighting, names);
  PutEstimate(json, key("mean"), answer.mean);
  PutEstimate(json, key("min"), answer.least);
  PutEstimate(json, key("max"), answer.most);
  PutEstimate(json, "uniformity_min_mean", answer.uniformity);
  PutEstimate(json, "uniformity_min_max", answer.diversity);
  return json;
}

void AddPointRows(std::vector<NumberRow>* rows, const PointAnswer& answer,
                  const PhotometryNames& names) {
  const auto& asked = answer.asked;
  const std::string where = asked.name + "; " + PlaceText(asked.p_m);
  const auto add = [&](const std::string& which, const Estimate& estimate) {
    rows->push_back(
        {RowName(names, asked.weighting, which), where, names.illuminance_unit, estimate});
  };
  add("", answer.illuminance);
  add("spherical", answer.spherical);
  add("cylindrical", answer.cylindrical);
  if (answer.semicylindrical) add("semicylindrical", *answer.semicylindrical);
}

void AddPlaneRows(std::vector<NumberRow>* rows, const PlaneAnswer& answer,
                  const PhotometryNames& names) {
  const auto& asked = answer.asked;
  const std::string quantity = RowName(names, asked.weighting, ShapeName(asked.receiver.shape));
  rows->push_back({"mean " + quantity, asked.name, names.illuminance_unit, answer.mean});
  for (int row = 0; row < asked.rows; ++row)
    for (int column = 0; column < asked.columns; ++column)
      rows->push_back({quantity, asked.name + "; " + PlaceText(asked.Point(column, row)),
                       names.illuminance_unit, Estimate{answer.at(column, row), {}}});
}

EstimateRows PointTable(const PointAnswer& answer, const PhotometryNames& names) {
  const Vec3 p = answer.asked.p_m;
  EstimateRows rows{EstimateHead(
      fmt::format("{}, at ({:.4g}, {:.4g}, {:.4g}) m", answer.asked.name, p.x, p.y, p.z))};
  const auto add = [&](const std::string& name, const Estimate& estimate) {
    rows.push_back(EstimateRow(name, estimate, names.illuminance_unit));
  };
  add(names.illuminance, answer.illuminance);
  add("mean spherical", answer.spherical);
  add("cylindrical", answer.cylindrical);
  if (answer.semicylindrical) add("semicylindrical", *answer.semicylindrical);
  const char* const kAxes[] = {"light vector, x", "light vector, y", "light vector, z"};
  for (std::size_t k = 0; k < 3; ++k) add(kAxes[k], answer.light_vector[k]);
  return rows;
}

EstimateRows PlaneTable(const PlaneAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  EstimateRows rows{EstimateHead(asked.name)};
  rows.push_back(EstimateRow(fmt::format("mean of {} x {} points", asked.columns, asked.rows),
                             answer.mean, names.illuminance_unit));
  rows.push_back(EstimateRow("smallest", answer.least, names.illuminance_unit));
  rows.push_back(EstimateRow("largest", answer.most, names.illuminance_unit));
  if (answer.uniformity) rows.push_back(EstimateRow("smallest / mean", *answer.uniformity, ""));
  if (answer.diversity) rows.push_back(EstimateRow("smallest / largest", *answer.diversity, ""));
  return rows;
}

// How the weightings asked for weigh channels.
void AddWeightings(HtmlPage& page, const std::vector<photometry::Weighting>& weightings) {
  for (const auto& one : weightings) {
    std::string factors;
    for (const double factor : one.factors)
      factors += (factors.empty() ? "" : ", ") + fmt::format("{:g}", factor);
    page.Paragraph(fmt::format("{}, {}: channels weighed by {}.", one.name, one.unit, factors));
  }
}

}  // namespace

PhotometryNames ReceivedNames(const PhotometryReport& report, const std::string& weighting) {
  const auto found = std::ranges::find(report.weightings, weighting, &photometry::Weighting::name);
  return found == report.weightings.end() ? NamesOf(report.distribution.unit) : NamesOf(*found);
}

void PrintReceived(const PhotometryReport& report) {
  for (const PointAnswer& answer : report.points)
    fmt::print("  {:<18}{}\n", answer.asked.name,
               EstimateText(answer.illuminance,
                            ReceivedNames(report, answer.asked.weighting).illuminance_unit));
  for (const PlaneAnswer& answer : report.planes)
    fmt::print(
        "  {}: mean {}, from {:.4g} to {:.4g}\n", answer.asked.name,
        EstimateText(answer.mean, ReceivedNames(report, answer.asked.weighting).illuminance_unit),
        answer.least.value, answer.most.value);
}

void PutReceived(Json& json, const PhotometryReport& report) {
  json["weightings"] = json["points"] = json["planes"] = Json::array();
  for (const auto& one : report.weightings) json["weightings"].push_back(WeightingJson(one));
  for (const PointAnswer& answer : report.points)
    json["points"].push_back(PointJson(answer, ReceivedNames(report, answer.asked.weighting)));
  for (const PlaneAnswer& answer : report.planes)
    json["planes"].push_back(PlaneJson(answer, ReceivedNames(report, answer.asked.weighting)));
}

std::vector<NumberRow> ReceivedRows(const PhotometryReport& report) {
  std::vector<NumberRow> rows;
  for (const PointAnswer& answer : report.points)
    AddPointRows(&rows, answer, ReceivedNames(report, answer.asked.weighting));
  for (const PlaneAnswer& answer : report.planes)
    AddPlaneRows(&rows, answer, ReceivedNames(report, answer.asked.weighting));
  return rows;
}

void AddReceived(HtmlPage& page, const PhotometryReport& report) {
  const std::string illuminance = NamesOf(report.distribution.unit).illuminance;
  AddWeightings(page, report.weightings);
  if (!report.planes.empty()) page.Heading(illuminance + " on planes");
  for (const PlaneAnswer& answer : report.planes) {
    const PhotometryNames names = ReceivedNames(report, answer.asked.weighting);
    page.Raw("<div class=\"row\">\n");
    page.Raw(SvgIsolux(IsoluxOf(answer, names)));
    page.Raw("<div>\n");
    AddEstimates(page, PlaneTable(answer, names));
    page.Raw("</div>\n</div>\n");
  }
  if (!report.points.empty()) page.Heading(illuminance + " at points");
  for (const PointAnswer& answer : report.points)
    AddEstimates(page, PointTable(answer, ReceivedNames(report, answer.asked.weighting)));
}

}  // namespace luxfield::cli
