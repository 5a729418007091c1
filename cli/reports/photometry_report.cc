#include "luxfield/cli/reports/photometry_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "luxfield/cli/reports/colour_report.h"
#include "luxfield/cli/reports/csv.h"
#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/estimate_table.h"
#include "luxfield/cli/reports/eye_report.h"
#include "luxfield/cli/reports/headlamp_report.h"
#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/cli/reports/received_report.h"

namespace luxfield::cli {
namespace {

using core::Json;
using photometry::Estimate;

void PutAngle(Json& json, const std::string& name, const std::optional<photometry::BeamAngle>& b) {
  const auto part = [&](Estimate photometry::BeamAngle::*which) {
    return b ? std::optional((*b).*which) : std::nullopt;
  };
  PutEstimate(json, name + "_deg", part(&photometry::BeamAngle::mean_deg));
  PutEstimate(json, name + "_c0_deg", part(&photometry::BeamAngle::along_c0_deg));
  PutEstimate(json, name + "_c90_deg", part(&photometry::BeamAngle::along_c90_deg));
  json[name + "_limited"] = b ? Json(b->limited) : Json();
}

void PutPeakDirection(Json& json, const photometry::Distribution& d) {
  const auto peak = photometry::DirectionOf(d.peak_direction);
  const auto& u = d.peak_direction_u;
  PutEstimate(json, "peak_c_deg", Estimate{peak.c_deg, u ? u->c_deg : std::nullopt});
  PutEstimate(json, "peak_gamma_deg", Estimate{peak.gamma_deg, u ? u->gamma_deg : std::nullopt});
  json["peak_turn_deg_u"] = u ? Json{u->along_c0_deg, u->across_deg} : Json();
}

void PutInverseSquare(Json& json, const std::string& key, const photometry::InverseSquare& found) {
  Json values = Json::object(), uncertainties = Json::object();
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k) {
    const std::string percent = std::to_string(photometry::kInverseSquarePercent[k]);
    const auto& distance = found.distance_m[k];
    values[percent] = distance ? Json(distance->value) : Json();
    uncertainties[percent] = distance ? OptionalJson(distance->u) : Json();
  }
  json[key] = values;
  json[key + "_u"] = uncertainties;
}

Json TableJson(const photometry::IntensityTable& table, const PhotometryNames& names) {
  Json values = Json::array(), uncertainties = Json::array();
  bool known = false;
  for (std::size_t c = 0; c < table.c_deg.size(); ++c) {
    Json value_row = Json::array(), u_row = Json::array();
    for (std::size_t g = 0; g < table.gamma_deg.size(); ++g) {
      const Estimate& estimate = table.at(c, g);
      value_row.push_back(estimate.value);
      u_row.push_back(OptionalJson(estimate.u));
      known = known || estimate.u;
    }
    values.push_back(value_row);
    uncertainties.push_back(u_row);
  }
  const std::string key = names.intensity_suffix;
  return {{"c_deg", table.c_deg},
          {"gamma_deg", table.gamma_deg},
          {key, values},
          {key + "_u", known ? uncertainties : Json()}};
}

void PrintAngle(const char* name, const std::optional<photometry::BeamAngle>& angle) {
  if (angle)
    fmt::print("  {:<18}{} ({:.4g} along C0-C180, {:.4g} along C90-C270)\n", name,
               EstimateText(angle->mean_deg, "degrees"), angle->along_c0_deg.value,
               angle->along_c90_deg.value);
}

std::string CsvLine(const NumberRow& row) {
  return fmt::format("{},{},{},{},{}\n", CsvText(row.quantity), CsvText(row.where), row.value.value,
                     row.value.u ? fmt::format("{}", *row.value.u) : "", CsvText(row.unit));
}

// KEY and KEY_u, a list for each C plane.
void PutRatings(Json& json, const std::string& key,
                const std::vector<std::optional<Estimate>>& ratings, std::size_t distances) {
  Json values = Json::array(), uncertainties = Json::array();
  for (std::size_t k = 0; k < ratings.size(); ++k) {
    if (k % distances == 0) {
      values.push_back(Json::array());
      uncertainties.push_back(Json::array());
    }
    values.back().push_back(ratings[k] ? Json(ratings[k]->value) : Json());
    uncertainties.back().push_back(ratings[k] ? OptionalJson(ratings[k]->u) : Json());
  }
  json[key] = values;
  json[key + "_u"] = uncertainties;
}

Json GlareJson(const photometry::GlareAnswer& answer) {
  Json json = {{"name", answer.asked.name},
               {"below_m", answer.asked.below_m},
               {"c_deg", answer.asked.c_deg},
               {"distances_m", answer.asked.distances_m}};
  PutRatings(json, "ugr", answer.ugr, answer.asked.distances_m.size());
  PutRatings(json, "ugr_plain", answer.plain_ugr, answer.asked.distances_m.size());
  return json;
}

}  // namespace

std::string PeakText(const photometry::Distribution& d) {
  if (!(d.peak.value > 0)) return "";
  const auto peak = photometry::DirectionOf(d.peak_direction);
  return fmt::format("C = {:.1f}°, gamma = {:.2f}°", peak.c_deg, peak.gamma_deg);
}

void PrintPhotometry(const PhotometryReport& report) {
  const auto& d = report.distribution;
  const PhotometryNames names = NamesOf(d.unit);
  fmt::print("{}\n  {:<18}{}\n", report.file, "flux", EstimateText(d.flux, names.flux_unit));
  fmt::print("  {:<18}{}\n", "intensity, axis", EstimateText(d.axis, names.intensity_unit));
  const std::string where = PeakText(d);
  fmt::print("  {:<18}{}{}\n", "intensity, peak", EstimateText(d.peak, names.intensity_unit),
             where.empty() ? "" : " at " + where);
  PrintAngle("beam angle", d.beam);
  PrintAngle("field angle", d.field);
  if (d.downward_share && d.downward_share->value < 1)
    fmt::print("  {:<18}{:.2f} %\n", "downwards", 100 * d.downward_share->value);
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k)
    if (const auto& distance = d.on_axis.distance_m[k])
      fmt::print("  inverse square     within {} % from {} on the axis\n",
                 photometry::kInverseSquarePercent[k], EstimateText(*distance, "m"));
  PrintReceived(report);
  for (const auto& answer : report.eyes) PrintEye(answer, names);
  if (report.colour) PrintColour(*report.colour);
  for (const auto& headlamp : report.headlamps) PrintHeadlamp(headlamp);
  fmt::print("  {}\n", report.uncertainty);
  for (const std::string& remark : d.remarks) fmt::print("  {}\n", remark);
}

Json ToJson(const PhotometryReport& report) {
  const auto& d = report.distribution;
  const PhotometryNames names = NamesOf(d.unit);
  Json json = {{"file", report.file},
               {"sha256", report.sha256},
               {"unit", lightfield::FluxUnitName(d.unit)},
               {"uncertainty", report.uncertainty},
               {"remarks", d.remarks},
               {"intensity", TableJson(report.table, names)}};
  PutEstimate(json, names.flux_key, d.flux);
  PutEstimate(json, names.Intensity("axis"), d.axis);
  PutEstimate(json, names.Intensity("peak"), d.peak);
  PutPeakDirection(json, d);
  PutEstimate(json, "asymmetry_c0_c180", d.asymmetry_c0_c180);
  PutEstimate(json, "asymmetry_c90_c270", d.asymmetry_c90_c270);
  PutEstimate(json, "covered_gamma_deg", d.covered_gamma_deg);
  PutAngle(json, "beam_angle", d.beam);
  PutAngle(json, "field_angle", d.field);
  PutEstimate(json, "downward_share", d.downward_share);
  PutEstimate(json, "upward_share", d.upward_share);
  PutInverseSquare(json, "inverse_square_distance_m", d.on_axis);
  PutInverseSquare(json, "inverse_square_distance_peak_m", d.towards_peak);
  json["colour"] = report.colour ? ColourJson(*report.colour) : Json();
  PutReceived(json, report);
  json["quality"] = QualityJson(report.quality);
  json["eyes"] = json["headlamps"] = json["glare"] = Json::array();
  for (const auto& answer : report.glare) json["glare"].push_back(GlareJson(answer));
  for (const auto& headlamp : report.headlamps) json["headlamps"].push_back(HeadlampJson(headlamp));
  for (const auto& answer : report.eyes) json["eyes"].push_back(EyeJson(answer, names));
  return json;
}

std::string PhotometryCsv(const PhotometryReport& report) {
  const auto& d = report.distribution;
  const PhotometryNames names = NamesOf(d.unit);
  std::string text = "quantity,where,value,u,unit\n";
  const auto add = [&](const std::string& quantity, const std::string& where,
                       const Estimate& estimate, const std::string& unit) {
    text += CsvLine({quantity, where, unit, estimate});
  };
  const auto direction = [](double c, double gamma) {
    return fmt::format("C = {:g} deg; gamma = {:g} deg", c, gamma);
  };
  add("flux", "", d.flux, names.flux_unit);
  add("intensity on the axis", direction(0, 0), d.axis, names.intensity_unit);
  const auto peak = photometry::DirectionOf(d.peak_direction);
  add("largest intensity", direction(peak.c_deg, peak.gamma_deg), d.peak, names.intensity_unit);
  for (const auto& [name, angle] : {std::pair{"beam angle", &d.beam}, {"field angle", &d.field}})
    if (*angle) {
      add(name, "mean", (*angle)->mean_deg, "deg");
      add(name, "along C0-C180", (*angle)->along_c0_deg, "deg");
      add(name, "along C90-C270", (*angle)->along_c90_deg, "deg");
    }
  for (const auto& [name, share] :
       {std::pair{"C0-C180", &d.asymmetry_c0_c180}, {"C90-C270", &d.asymmetry_c90_c270}})
    if (*share) add("asymmetry", name, **share, "1");
  if (d.covered_gamma_deg)
    add("whole filter plane seen up to gamma", "", *d.covered_gamma_deg, "deg");
  if (d.downward_share) add("downward share", "", *d.downward_share, "1");
  if (d.upward_share) add("upward share", "", *d.upward_share, "1");
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k)
    if (const auto& distance = d.on_axis.distance_m[k])
      add("inverse square holds from",
          fmt::format("axis; within {} %", photometry::kInverseSquarePercent[k]), *distance, "m");
  for (std::size_t c = 0; c < report.table.c_deg.size(); ++c)
    for (std::size_t g = 0; g < report.table.gamma_deg.size(); ++g)
      add("intensity", direction(report.table.c_deg[c], report.table.gamma_deg[g]),
          report.table.at(c, g), names.intensity_unit);
  for (const NumberRow& row : ReceivedRows(report)) text += CsvLine(row);
  for (const NumberRow& row : QualityRows(report.quality)) text += CsvLine(row);
  for (const auto& answer : report.eyes)
    for (const NumberRow& row : EyeRows(answer, names)) text += CsvLine(row);
  for (const auto& answer : report.glare)
    for (std::size_t k = 0; k < answer.ugr.size(); ++k) {
      const std::size_t distances = answer.asked.distances_m.size();
      const std::string where =
          answer.asked.name + "; " + answer.asked.Eye(k / distances, k % distances).name;
      if (answer.ugr[k]) add("UGR", where, *answer.ugr[k], "");
      if (answer.plain_ugr[k]) add("UGR of the opening", where, *answer.plain_ugr[k], "");
    }
  for (const auto& headlamp : report.headlamps)
    for (const NumberRow& row : HeadlampRows(headlamp)) text += CsvLine(row);
  return text;
}

}  // namespace luxfield::cli
