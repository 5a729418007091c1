#include "luxfield/cli/reports/headlamp_report.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/estimate_table.h"
#include "luxfield/photometry/planes.h"

namespace luxfield::cli {
namespace {

using core::Json;
using photometry::Finding;
using photometry::Place;
using Kind = photometry::Requirement::Kind;

Json PlaceJson(Place place) { return {place.h_deg, place.v_deg}; }

const char* KindName(Kind kind) {
  switch (kind) {
    case Kind::kPoint:
      return "point";
    case Kind::kLine:
      return "line";
    case Kind::kZone:
      return "zone";
    case Kind::kSum:
      return "sum";
    case Kind::kPeak:
      return "peak";
    case Kind::kFlux:
      return "flux";
  }
  return "";
}

Json FindingJson(const Finding& finding) {
  const std::string unit = finding.kind == Kind::kFlux ? "lm" : "cd";
  Json json = {{"name", finding.name},
               {"kind", KindName(finding.kind)},
               {"limit", finding.is_least ? "min" : "max"},
               {"limit_" + unit, finding.limit},
               {"limit_of", finding.limit_text.empty() ? Json() : Json(finding.limit_text)},
               {"at_deg", PlaceJson(finding.place)},
               {"verdict", VerdictName(finding.verdict)},
               {"pass_probability", OptionalJson(finding.pass_probability)},
               {"unless", finding.unless.empty() ? Json() : Json(finding.unless)}};
  PutEstimate(json, "value_" + unit, finding.value);
  PutEstimate(json, "margin_" + unit, finding.margin);
  return json;
}

Json CutOffJson(const photometry::CutOffFindings& cut_off) {
  Json along = Json::array();
  for (const auto& one : cut_off.along)
    along.push_back({{"at_deg", PlaceJson(one.place)}, {"gradient", one.gradient}});
  Json json = {
      {"at_deg", PlaceJson(cut_off.place)},
      {"gradient_probability", OptionalJson(cut_off.gradient_probability)},
      {"gradient_met", cut_off.gradient_met},
      {"has_gradient_peak", cut_off.has_gradient_peak},
      {"spread_deg", OptionalJson(cut_off.spread_deg)},
      {"straight", cut_off.straight},
      {"along", along},
      {"at_aiming_screen_deg", cut_off.at_screen ? PlaceJson(cut_off.at_screen->place) : Json()}};
  PutEstimate(json, "gradient", cut_off.gradient);
  return json;
}

Json SweepJson(const photometry::AimSweep& sweep) {
  const auto columns = static_cast<int>(sweep.h_deg.size());
  const std::vector<double> failed(sweep.failed.begin(), sweep.failed.end());
  return {{"h_deg", sweep.h_deg},
          {"v_deg", sweep.v_deg},
          {"smallest_margin", RowsJson(sweep.margin, columns)},
          {"failed", RowsJson(failed, columns)}};
}

Json PlaneJson(const photometry::PlaneAsked& plane, const std::vector<double>& illuminance) {
  return {{"name", plane.name},
          {"centre_m", VectorJson(plane.centre_m)},
          {"right", VectorJson(plane.right)},
          {"up", VectorJson(plane.up)},
          {"width_m", plane.width_m},
          {"height_m", plane.height_m},
          {"illuminance_lx", RowsJson(illuminance, plane.columns)}};
}

Json ViewJson(const photometry::RoadView& view, const std::vector<double>& illuminance) {
  return {{"eye_m", VectorJson(view.eye_m)},
          {"right_percent", {100 * view.left, 100 * view.right}},
          {"below_percent", {100 * view.farthest, 100 * view.nearest}},
          {"illuminance_lx", RowsJson(illuminance, view.columns)}};
}

}  // namespace

HeadlampReport ReportOfHeadlamp(const photometry::Lamp& lamp,
                                const photometry::HeadlampAsked& asked) {
  HeadlampReport report{HeadlampOf(lamp, asked), {}, {}, {}, {}};
  report.screen = IlluminanceOn(lamp, report.headlamp.screen);
  report.road = IlluminanceOn(lamp, report.headlamp.road);
  report.view = IlluminanceIn(lamp, report.headlamp.view);
  if (report.headlamp.aiming_screen)
    report.aiming_screen = IlluminanceOn(lamp, *report.headlamp.aiming_screen);
  return report;
}

std::string AngleText(double degrees, const char* positive, const char* negative) {
  const std::string text = fmt::format("{:.2f}°", std::abs(degrees));
  return text == "0.00°" ? "0°" : text + (degrees > 0 ? positive : negative);
}

std::string PlaceText(Place place) {
  return AngleText(place.h_deg, " R", " L") + ", " + AngleText(place.v_deg, " U", " D");
}

std::string WhereText(const Finding& finding) {
  return finding.kind == Kind::kSum || finding.kind == Kind::kFlux ? "all of it"
                                                                   : PlaceText(finding.place);
}

std::string VerdictName(photometry::Verdict verdict) {
  switch (verdict) {
    case photometry::Verdict::kPass:
      return "pass";
    case photometry::Verdict::kFail:
      return "fail";
    case photometry::Verdict::kNotMeasured:
      break;
  }
  return "not measured";
}

void PrintHeadlamp(const HeadlampReport& report) {
  const photometry::Headlamp& headlamp = report.headlamp;
  fmt::print("  {}: {}{}\n", headlamp.asked.name, VerdictName(headlamp.verdict),
             headlamp.pass_probability
                 ? fmt::format(", met with probability {:.3g}", *headlamp.pass_probability)
                 : "");
  fmt::print("    aimed at {}\n", PlaceText(headlamp.aimed));
  for (const Finding& finding : headlamp.findings)
    if (finding.verdict != photometry::Verdict::kPass)
      fmt::print("    {} {}: {}, {}, {} {:.5g}{}\n", VerdictName(finding.verdict), finding.name,
                 EstimateText(finding.value, finding.kind == Kind::kFlux ? "lm" : "cd"),
                 WhereText(finding), finding.is_least ? "not below" : "not above", finding.limit,
                 finding.unless.empty() ? "" : ", unless " + finding.unless);
  for (const std::string& remark : headlamp.remarks) fmt::print("    {}\n", remark);
}

Json HeadlampJson(const HeadlampReport& report) {
  const photometry::Headlamp& headlamp = report.headlamp;
  Json requirements = Json::array();
  for (const Finding& finding : headlamp.findings) requirements.push_back(FindingJson(finding));
  return {
      {"name", headlamp.asked.name},
      {"regulation", headlamp.asked.regulation.name},
      {"source", headlamp.asked.regulation.source},
      {"aim_deg", PlaceJson(headlamp.aimed)},
      {"aim_deg_u", headlamp.aimed_u_deg ? Json(*headlamp.aimed_u_deg) : Json()},
      {"verdict", VerdictName(headlamp.verdict)},
      {"pass_probability", OptionalJson(headlamp.pass_probability)},
      {"requirements", requirements},
      {"cut_off", headlamp.cut_off ? CutOffJson(*headlamp.cut_off) : Json()},
      {"aim_sweep", headlamp.sweep ? SweepJson(*headlamp.sweep) : Json()},
      {"screen", PlaneJson(headlamp.screen, report.screen)},
      {"aiming_screen",
       headlamp.aiming_screen ? PlaneJson(*headlamp.aiming_screen, report.aiming_screen) : Json()},
      {"road", PlaneJson(headlamp.road, report.road)},
      {"view", ViewJson(headlamp.view, report.view)},
      {"remarks", headlamp.remarks}};
}

std::vector<NumberRow> HeadlampRows(const HeadlampReport& report) {
  std::vector<NumberRow> rows;
  for (const Finding& finding : report.headlamp.findings)
    rows.push_back({fmt::format("{} {}", finding.name, finding.is_least ? "smallest" : "largest"),
                    fmt::format("{}; H = {:.4g} deg; V = {:.4g} deg; limit {:.6g}; {}",
                                report.headlamp.asked.name, finding.place.h_deg,
                                finding.place.v_deg, finding.limit, VerdictName(finding.verdict)),
                    finding.kind == Kind::kFlux ? "lm" : "cd", finding.value});
  return rows;
}

}  // namespace luxfield::cli
