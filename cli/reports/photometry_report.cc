#include "luxfield/cli/reports/photometry_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "luxfield/cli/reports/colour_report.h"
#include "luxfield/cli/reports/csv.h"
#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/headlamp_report.h"
#include "luxfield/cli/reports/photometry_names.h"

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

Json PointJson(const photometry::PointAnswer& answer, const PhotometryNames& names) {
  Json json = {{"name", answer.asked.name},
               {"position_m", VectorJson(answer.asked.p_m)},
               {"normal", VectorJson(answer.asked.normal)},
               {"axis", VectorJson(answer.asked.axis)},
               {"facing", answer.asked.facing ? VectorJson(*answer.asked.facing) : Json()}};
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

Json PlaneJson(const photometry::PlaneAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  Json json = {{"name", asked.name},
               {"centre_m", VectorJson(asked.centre_m)},
               {"right", VectorJson(asked.right)},
               {"up", VectorJson(asked.up)},
               {"normal", VectorJson(asked.Normal())},
               {"width_m", asked.width_m},
               {"height_m", asked.height_m},
               {"columns", asked.columns},
               {"rows", asked.rows},
               {names.Illuminance(), RowsJson(answer.illuminance, asked.columns)},
               {"min_at_m", VectorJson(asked.Point(answer.least_at[0], answer.least_at[1]))},
               {"max_at_m", VectorJson(asked.Point(answer.most_at[0], answer.most_at[1]))}};
  PutEstimate(json, names.Illuminance("mean"), answer.mean);
  PutEstimate(json, names.Illuminance("min"), answer.least);
  PutEstimate(json, names.Illuminance("max"), answer.most);
  PutEstimate(json, "uniformity_min_mean", answer.uniformity);
  PutEstimate(json, "uniformity_min_max", answer.diversity);
  return json;
}

Json EyeJson(const photometry::EyeAnswer& answer, const PhotometryNames& names) {
  const std::string suffix = names.LuminanceSuffix();
  Json fields = Json::array();
  for (const auto& field : answer.fields) {
    Json one = {{"field_of_view_mrad", field.mrad}, {"direction", VectorJson(field.direction)}};
    PutEstimate(one, "luminance_largest_mean_" + suffix, field.largest);
    fields.push_back(one);
  }
  Json json = {{"name", answer.asked.name},
               {"eye_m", VectorJson(answer.asked.eye_m)},
               {"fields_of_view", fields},
               {"luminous_solid_angle_sr", answer.area ? Json(answer.area->solid_angle) : Json()}};
  PutEstimate(json, "luminance_of_luminous_area_" + suffix,
              answer.area ? std::optional(answer.area->luminance) : std::nullopt);
  PutEstimate(json, "ugr", answer.ugr);
  PutEstimate(json, "ugr_plain", answer.plain_ugr);
  PutEstimate(json, "veiling_luminance_" + suffix, answer.veiling);
  PutEstimate(json, "threshold_increment_percent", answer.threshold_increment);
  return json;
}

// "12.3 +- 0.4 lm".
std::string Text(const Estimate& estimate, const std::string& unit) {
  return fmt::format("{:.5g}{} {}", estimate.value,
                     estimate.u ? fmt::format(" +- {:.2g}", *estimate.u) : "", unit);
}

void PrintAngle(const char* name, const std::optional<photometry::BeamAngle>& angle) {
  if (angle)
    fmt::print("  {:<18}{} ({:.4g} along C0-C180, {:.4g} along C90-C270)\n", name,
               Text(angle->mean_deg, "degrees"), angle->along_c0_deg.value,
               angle->along_c90_deg.value);
}

Json CsvRow(const std::string& quantity, const std::string& where, const Estimate& estimate,
            const std::string& unit) {
  return {{"quantity", quantity},
          {"where", where},
          {"value", estimate.value},
          {"u", estimate.u ? Json(*estimate.u) : Json("")},
          {"unit", unit}};
}

std::string PlaceText(lightfield::Vec3 p) {
  return fmt::format("x = {:.6g} m; y = {:.6g} m; z = {:.6g} m", p.x, p.y, p.z);
}

// As Csv of columns in this order: those of an object of JSON are sorted by name.
std::string CsvLine(const Json& row) {
  std::string line;
  for (const char* key : {"quantity", "where", "value", "u", "unit"}) {
    const Json cell = {{{"x", row.at(key)}}};
    const std::string text = Csv(cell);  // "x\nCELL\n"
    line += (line.empty() ? "" : ",") + text.substr(2, text.size() - 3);
  }
  return line + "\n";
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

void PrintPhotometry(const PhotometryReport& report) {
  const auto& d = report.distribution;
  const PhotometryNames names = NamesOf(d.unit);
  fmt::print("{}\n  {:<18}{}\n", report.file, "flux", Text(d.flux, names.flux_unit));
  fmt::print("  {:<18}{}\n", "intensity, axis", Text(d.axis, names.intensity_unit));
  const auto peak = photometry::DirectionOf(d.peak_direction);
  fmt::print("  {:<18}{} at C {:.1f}, gamma {:.2f}\n", "intensity, peak",
             Text(d.peak, names.intensity_unit), peak.c_deg, peak.gamma_deg);
  PrintAngle("beam angle", d.beam);
  PrintAngle("field angle", d.field);
  if (d.downward_share && d.downward_share->value < 1)
    fmt::print("  {:<18}{:.2f} %\n", "downwards", 100 * d.downward_share->value);
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k)
    if (const auto& distance = d.on_axis.distance_m[k])
      fmt::print("  inverse square     within {} % from {} on the axis\n",
                 photometry::kInverseSquarePercent[k], Text(*distance, "m"));
  for (const auto& answer : report.points)
    fmt::print("  {:<18}{}\n", answer.asked.name, Text(answer.illuminance, names.illuminance_unit));
  for (const auto& answer : report.planes)
    fmt::print("  {}: mean {}, from {:.4g} to {:.4g}\n", answer.asked.name,
               Text(answer.mean, names.illuminance_unit), answer.least.value, answer.most.value);
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
               {"asymmetry_c0_c180", OptionalJson(d.asymmetry_c0_c180)},
               {"asymmetry_c90_c270", OptionalJson(d.asymmetry_c90_c270)},
               {"covered_gamma_deg", OptionalJson(d.covered_gamma_deg)},
               {"intensity", TableJson(report.table, names)}};
  PutEstimate(json, names.flux_key, d.flux);
  PutEstimate(json, names.Intensity("axis"), d.axis);
  PutEstimate(json, names.Intensity("peak"), d.peak);
  const auto peak = photometry::DirectionOf(d.peak_direction);
  json["peak_c_deg"] = peak.c_deg;
  json["peak_gamma_deg"] = peak.gamma_deg;
  PutAngle(json, "beam_angle", d.beam);
  PutAngle(json, "field_angle", d.field);
  PutEstimate(json, "downward_share", d.downward_share);
  PutEstimate(json, "upward_share", d.upward_share);
  PutInverseSquare(json, "inverse_square_distance_m", d.on_axis);
  PutInverseSquare(json, "inverse_square_distance_peak_m", d.towards_peak);
  json["colour"] = report.colour ? ColourJson(*report.colour) : Json();
  json["points"] = json["planes"] = json["eyes"] = json["headlamps"] = json["glare"] =
      Json::array();
  for (const auto& answer : report.glare) json["glare"].push_back(GlareJson(answer));
  for (const auto& headlamp : report.headlamps) json["headlamps"].push_back(HeadlampJson(headlamp));
  for (const auto& answer : report.eyes) json["eyes"].push_back(EyeJson(answer, names));
  for (const auto& answer : report.points) json["points"].push_back(PointJson(answer, names));
  for (const auto& answer : report.planes) json["planes"].push_back(PlaneJson(answer, names));
  return json;
}

std::string PhotometryCsv(const PhotometryReport& report) {
  const auto& d = report.distribution;
  const PhotometryNames names = NamesOf(d.unit);
  std::string text = "quantity,where,value,u,unit\n";
  const auto add = [&](const std::string& quantity, const std::string& where,
                       const Estimate& estimate, const std::string& unit) {
    text += CsvLine(CsvRow(quantity, where, estimate, unit));
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
  for (const auto& answer : report.points) {
    const std::string where = answer.asked.name + "; " + PlaceText(answer.asked.p_m);
    add(names.illuminance_key, where, answer.illuminance, names.illuminance_unit);
    add("spherical " + names.illuminance_key, where, answer.spherical, names.illuminance_unit);
    add("cylindrical " + names.illuminance_key, where, answer.cylindrical, names.illuminance_unit);
    if (answer.semicylindrical)
      add("semicylindrical " + names.illuminance_key, where, *answer.semicylindrical,
          names.illuminance_unit);
  }
  for (const auto& answer : report.planes) {
    const std::string& name = answer.asked.name;
    add("mean " + names.illuminance_key, name, answer.mean, names.illuminance_unit);
    for (int row = 0; row < answer.asked.rows; ++row)
      for (int column = 0; column < answer.asked.columns; ++column)
        add(names.illuminance_key, name + "; " + PlaceText(answer.asked.Point(column, row)),
            Estimate{answer.at(column, row), {}}, names.illuminance_unit);
  }
  for (const auto& answer : report.glare)
    for (std::size_t k = 0; k < answer.ugr.size(); ++k) {
      const std::size_t distances = answer.asked.distances_m.size();
      const std::string where =
          answer.asked.name + "; " + answer.asked.Eye(k / distances, k % distances).name;
      if (answer.ugr[k]) add("UGR", where, *answer.ugr[k], "");
      if (answer.plain_ugr[k]) add("UGR of the opening", where, *answer.plain_ugr[k], "");
    }
  for (const auto& headlamp : report.headlamps)
    for (const auto& row : HeadlampRows(headlamp))
      add(row.quantity, row.where, row.value, row.unit);
  return text;
}

}  // namespace luxfield::cli
