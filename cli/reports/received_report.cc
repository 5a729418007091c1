#include "luxfield/cli/reports/received_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/estimate_table.h"

namespace luxfield::cli {
namespace {

using core::Json;
using lightfield::Vec3;
using photometry::DoseAnswer;
using photometry::Estimate;
using photometry::LineAnswer;
using photometry::PlaneAnswer;
using photometry::PointAnswer;
using photometry::ReceiverShape;
using photometry::VolumeAnswer;

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

void PutSummary(Json& json, const photometry::ManyPoints& points, ReceiverShape shape,
                const PhotometryNames& names) {
  PutEstimate(json, names.Illuminance(shape, "mean"), points.mean);
  PutEstimate(json, names.Illuminance(shape, "min"), points.least);
  PutEstimate(json, names.Illuminance(shape, "max"), points.most);
  PutEstimate(json, "uniformity_min_mean", points.uniformity);
  PutEstimate(json, "uniformity_min_max", points.diversity);
}

Json PlaneJson(const PlaneAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  Json json = {
      {"name", asked.name},
      {"centre_m", VectorJson(asked.centre_m)},
      {"right", VectorJson(asked.right)},
      {"up", VectorJson(asked.up)},
      {"normal", VectorJson(asked.Normal())},
      {"width_m", asked.width_m},
      {"height_m", asked.height_m},
      {"columns", asked.columns},
      {"rows", asked.rows},
      {names.Illuminance(asked.receiver.shape, ""), RowsJson(answer.values, asked.columns)},
      {"min_at_m", VectorJson(asked.PointAt(answer.least_at))},
      {"max_at_m", VectorJson(asked.PointAt(answer.most_at))}};
  PutWeighting(json, asked.weighting, names);
  PutSummary(json, answer, asked.receiver.shape, names);
  return json;
}

Json VolumeJson(const VolumeAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  const auto& middle = asked.middle;
  Json layers = Json::array();
  for (int layer = 0; layer < asked.layers; ++layer) {
    const auto first = answer.values.begin() + static_cast<std::ptrdiff_t>(middle.count()) * layer;
    layers.push_back(
        RowsJson({first, first + static_cast<std::ptrdiff_t>(middle.count())}, middle.columns));
  }
  Json json = {{"name", middle.name},
               {"centre_m", VectorJson(middle.centre_m)},
               {"right", VectorJson(middle.right)},
               {"up", VectorJson(middle.up)},
               {"width_m", middle.width_m},
               {"height_m", middle.height_m},
               {"depth_m", asked.depth_m},
               {"columns", middle.columns},
               {"rows", middle.rows},
               {"layers", asked.layers},
               {names.Illuminance(middle.receiver.shape, ""), layers},
               {"min_at_m", VectorJson(asked.PointAt(answer.least_at))},
               {"max_at_m", VectorJson(asked.PointAt(answer.most_at))}};
  PutWeighting(json, middle.weighting, names);
  PutSummary(json, answer, middle.receiver.shape, names);
  return json;
}

// KEY and KEY_u, a number for each point; null where none was asked for.
void PutAlong(Json& json, const std::string& key, const LineAnswer& answer,
              const std::function<std::optional<Estimate>(const PointAnswer&)>& of) {
  Json values = Json::array(), uncertainties = Json::array();
  for (const PointAnswer& point : answer.points) {
    const auto one = of(point);
    values.push_back(one ? Json(one->value) : Json());
    uncertainties.push_back(one ? OptionalJson(one->u) : Json());
  }
  const bool asked = of(answer.points[0]).has_value(), known = asked && of(answer.points[0])->u;
  json[key] = asked ? values : Json();
  json[key + "_u"] = known ? uncertainties : Json();
}

Json LineJson(const LineAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  Json json = {{"name", asked.name},
               {"from_m", VectorJson(asked.from_m)},
               {"to_m", VectorJson(asked.to_m)},
               {"points", asked.points},
               {"normal", asked.normal ? VectorJson(*asked.normal) : Json()},
               {"axis", VectorJson(asked.axis)},
               {"facing", asked.facing ? VectorJson(*asked.facing) : Json()}};
  PutWeighting(json, asked.weighting, names);
  PutAlong(json, names.Illuminance(), answer,
           [](const PointAnswer& point) { return point.illuminance; });
  PutAlong(json, names.Illuminance("spherical"), answer,
           [](const PointAnswer& point) { return point.spherical; });
  PutAlong(json, names.Illuminance("cylindrical"), answer,
           [](const PointAnswer& point) { return point.cylindrical; });
  PutAlong(json, names.Illuminance("semicylindrical"), answer,
           [](const PointAnswer& point) { return point.semicylindrical; });
  const std::string axes = "xyz";
  for (std::size_t k = 0; k < axes.size(); ++k)
    PutAlong(json, fmt::format("light_vector_{}_{}", axes[k], names.illuminance_suffix), answer,
             [&](const PointAnswer& point) { return point.light_vector[k]; });
  return json;
}

Json PathJson(const DoseAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  const ReceiverShape shape = asked.receiver.shape;
  Json positions = Json::array(), normals = Json::array();
  for (const Vec3 p : asked.positions_m) positions.push_back(VectorJson(p));
  for (const Vec3 n : asked.normals) normals.push_back(VectorJson(n));
  Json json = {
      {"name", asked.name},           {"t_s", asked.times_s},
      {"position_m", positions},      {"normal", asked.normals.empty() ? Json() : normals},
      {"time_s", answer.time_s},      {names.Illuminance(shape, ""), answer.rate},
      {"max_at_s", answer.most_at_s}, {"max_at_m", VectorJson(asked.Position(answer.most_at_s))},
      {"dose_unit", names.DoseUnit()}};
  PutWeighting(json, asked.weighting, names);
  PutEstimate(json, names.DoseKey(), answer.dose);
  PutEstimate(json, names.Illuminance(shape, "mean"), answer.mean);
  PutEstimate(json, names.Illuminance(shape, "max"), answer.most);
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

// The mean, then each point.
void AddPointsRows(std::vector<NumberRow>* rows, const photometry::ManyPoints& points,
                   const std::string& quantity, const std::string& name, const std::string& unit,
                   const std::function<Vec3(std::size_t)>& place) {
  rows->push_back({"mean " + quantity, name, unit, points.mean});
  for (std::size_t k = 0; k < points.values.size(); ++k)
    rows->push_back(
        {quantity, name + "; " + PlaceText(place(k)), unit, Estimate{points.values[k], {}}});
}

void AddPathRows(std::vector<NumberRow>* rows, const DoseAnswer& answer,
                 const PhotometryNames& names) {
  const auto& asked = answer.asked;
  const std::string quantity = names.Received(asked.receiver.shape);
  rows->push_back({"dose of " + quantity, asked.name, names.DoseUnit(), answer.dose});
  rows->push_back({"largest " + quantity,
                   asked.name + "; " + PlaceText(asked.Position(answer.most_at_s)),
                   names.illuminance_unit, answer.most});
}

}  // namespace

PhotometryNames ReceivedNames(const PhotometryReport& report, const std::string& weighting) {
  const auto found = std::ranges::find(report.weightings, weighting, &photometry::Weighting::name);
  return found == report.weightings.end() ? NamesOf(report.distribution.unit) : NamesOf(*found);
}

void PrintReceived(const PhotometryReport& report) {
  const auto unit = [&](const std::string& weighting) {
    return ReceivedNames(report, weighting).illuminance_unit;
  };
  const auto print = [&](const std::string& name, const photometry::ManyPoints& points,
                         const std::string& weighting) {
    fmt::print("  {}: mean {}, from {:.4g} to {:.4g}\n", name,
               EstimateText(points.mean, unit(weighting)), points.least.value, points.most.value);
  };
  for (const PointAnswer& answer : report.points)
    fmt::print("  {:<17} {}\n", answer.asked.name,
               EstimateText(answer.illuminance, unit(answer.asked.weighting)));
  for (const PlaneAnswer& answer : report.planes)
    print(answer.asked.name, answer, answer.asked.weighting);
  for (const VolumeAnswer& answer : report.volumes)
    print(answer.asked.middle.name, answer, answer.asked.middle.weighting);
  for (const DoseAnswer& answer : report.paths)
    fmt::print("  {}: dose {}\n", answer.asked.name,
               EstimateText(answer.dose, ReceivedNames(report, answer.asked.weighting).DoseUnit()));
}

void PutReceived(Json& json, const PhotometryReport& report) {
  for (const char* key : {"weightings", "points", "lines", "planes", "volumes", "paths"})
    json[key] = Json::array();
  for (const auto& one : report.weightings) json["weightings"].push_back(WeightingJson(one));
  for (const PointAnswer& answer : report.points)
    json["points"].push_back(PointJson(answer, ReceivedNames(report, answer.asked.weighting)));
  for (const LineAnswer& answer : report.lines)
    json["lines"].push_back(LineJson(answer, ReceivedNames(report, answer.asked.weighting)));
  for (const PlaneAnswer& answer : report.planes)
    json["planes"].push_back(PlaneJson(answer, ReceivedNames(report, answer.asked.weighting)));
  for (const VolumeAnswer& answer : report.volumes)
    json["volumes"].push_back(
        VolumeJson(answer, ReceivedNames(report, answer.asked.middle.weighting)));
  for (const DoseAnswer& answer : report.paths)
    json["paths"].push_back(PathJson(answer, ReceivedNames(report, answer.asked.weighting)));
}

std::vector<NumberRow> ReceivedRows(const PhotometryReport& report) {
  std::vector<NumberRow> rows;
  for (const PointAnswer& answer : report.points)
    AddPointRows(&rows, answer, ReceivedNames(report, answer.asked.weighting));
  for (const LineAnswer& answer : report.lines)
    for (const PointAnswer& point : answer.points)
      AddPointRows(&rows, point, ReceivedNames(report, answer.asked.weighting));
  const auto add = [&](const auto& answer, const photometry::PlaneAsked& plane) {
    const PhotometryNames names = ReceivedNames(report, plane.weighting);
    AddPointsRows(&rows, answer, names.Received(plane.receiver.shape), plane.name,
                  names.illuminance_unit, [&](std::size_t k) { return answer.asked.PointAt(k); });
  };
  for (const PlaneAnswer& answer : report.planes) add(answer, answer.asked);
  for (const VolumeAnswer& answer : report.volumes) add(answer, answer.asked.middle);
  for (const DoseAnswer& answer : report.paths)
    AddPathRows(&rows, answer, ReceivedNames(report, answer.asked.weighting));
  return rows;
}

}  // namespace luxfield::cli
