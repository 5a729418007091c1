#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/cli/reports/headlamp_report.h"
#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/cli/svg/svg_isolux.h"

namespace luxfield::cli {
namespace {

using photometry::Finding;
using photometry::Place;
using photometry::Verdict;
using Kind = photometry::Requirement::Kind;
using Rows = std::vector<std::vector<std::string>>;

constexpr double kGradientPlace = 0.01;  // two digits of it are printed without an uncertainty
constexpr double kDegree = std::numbers::pi / 180;

std::string Probability(const std::optional<double>& p) {
  if (!p) return "";
  if (*p > 0.9995) return "> 0.999";
  return *p < 0.0005 ? "< 0.001" : fmt::format("{:.3f}", *p);
}

void AddCutOff(HtmlPage& page, const photometry::Headlamp& headlamp) {
  if (!headlamp.cut_off) return;
  const auto& cut_off = *headlamp.cut_off;
  const auto& limits = *headlamp.asked.regulation.cut_off;
  Rows rows{{"cut-off", "value", "u (k = 1)", "limit", "probability", ""}};
  rows.push_back(
      {fmt::format("gradient G at {}", PlaceText(cut_off.place)),
       RoundedTo(cut_off.gradient.value, cut_off.gradient.u.value_or(kGradientPlace)),
       cut_off.gradient.u ? UncertaintyText(*cut_off.gradient.u) : "",
       fmt::format("{}{}",
                   limits.least_gradient ? fmt::format("≥ {:g} ", *limits.least_gradient) : "",
                   limits.most_gradient ? fmt::format("≤ {:g}", *limits.most_gradient) : ""),
       Probability(cut_off.gradient_probability), cut_off.gradient_met ? "pass" : "fail"});
  if (!limits.straight_h_deg.empty())
    rows.push_back({"spread of its V",
                    cut_off.spread_deg ? fmt::format("{:.3f}°", *cut_off.spread_deg)
                                       : "no cut-off at one of the places",
                    "", fmt::format("≤ {:g}°", limits.straight_within_deg), "",
                    cut_off.straight ? "pass" : "fail"});
  if (cut_off.at_screen)
    rows.push_back({fmt::format("V on the screen at {:g} m", *headlamp.asked.regulation.screen_m),
                    fmt::format("{:.3f}°", cut_off.at_screen->place.v_deg), "", "", "", ""});
  page.Table(rows);
}

void AddSweep(HtmlPage& page, const photometry::Headlamp& headlamp) {
  if (!headlamp.sweep) return;
  const auto& sweep = *headlamp.sweep;
  page.Paragraph(
      "Aimed anew, within what the regulation allows: the smallest margin of all that counts, in "
      "per "
      "cent of its limit, and how many limits are not met; columns by H, rows by V of the new "
      "aim.");
  Rows rows{{"V \\ H"}};
  for (const double h : sweep.h_deg) rows[0].push_back(AngleText(h, " R", " L"));
  for (std::size_t v = sweep.v_deg.size(); v-- > 0;) {
    auto& row = rows.emplace_back();
    row.push_back(AngleText(sweep.v_deg[v], " U", " D"));
    for (std::size_t h = 0; h < sweep.h_deg.size(); ++h) {
      const std::size_t k = v * sweep.h_deg.size() + h;
      row.push_back(fmt::format("{:+.1f}{}", 100 * sweep.margin[k],
                                sweep.failed[k] ? fmt::format(" ({})", sweep.failed[k]) : ""));
    }
  }
  page.Table(rows);
}

// A place on a flat screen, metres from where H = V = 0 meets it.
std::array<double, 2> OnScreen(Place place, double distance_m) {
  return {distance_m * std::tan(place.h_deg * kDegree),
          distance_m * std::tan(place.v_deg * kDegree) / std::cos(place.h_deg * kDegree)};
}

IsoluxMap MapOf(const photometry::PlaneAsked& plane, const std::vector<double>& illuminance) {
  IsoluxMap map;
  map.title = "Illuminance, " + plane.name;
  map.unit = "lx";
  map.x_label = "to the right of the driver, m";
  map.columns = plane.columns;
  map.rows = plane.rows;
  map.x0 = -plane.width_m / 2;
  map.x1 = plane.width_m / 2;
  map.values = illuminance;
  return map;
}

IsoluxMap ScreenMap(const photometry::Headlamp& headlamp, const photometry::PlaneAsked& plane,
                    const std::vector<double>& illuminance, double distance_m) {
  IsoluxMap map = MapOf(plane, illuminance);
  // The plane's middle, seen from H = V = 0.
  const double middle = Dot(plane.centre_m, plane.up);
  map.y0 = middle - plane.height_m / 2;
  map.y1 = middle + plane.height_m / 2;
  map.y_label = "above the axis of the aimed lamp, m";
  map.lines.push_back({{{map.x0, 0}, {map.x1, 0}}, true});
  map.lines.push_back({{{0, map.y0}, {0, map.y1}}, true});
  if (headlamp.cut_off) {
    IsoluxLine line;
    for (const auto& one : headlamp.cut_off->along)
      line.points.push_back(OnScreen(one.place, distance_m));
    map.lines.push_back(line);
  }
  return map;
}

// By tangents in per cent: 1 % is 0.57 degrees, a metre at a hundred.
IsoluxMap ViewMap(const photometry::RoadView& view, const std::vector<double>& illuminance) {
  IsoluxMap map;
  map.title = fmt::format("Illuminance of the road, as a driver {:g} m above it sees it",
                          view.eye_height_m);
  map.unit = "lx";
  map.x_label = "to the right, % of the distance";
  map.y_label = "above the horizon, %";
  map.columns = view.columns;
  map.rows = view.rows;
  map.x0 = 100 * view.left;
  map.x1 = 100 * view.right;
  map.y0 = -100 * view.nearest;
  map.y1 = -100 * view.farthest;
  map.values = illuminance;
  return map;
}

}  // namespace

Rows RequirementTable(const photometry::Headlamp& headlamp) {
  Rows rows{{"requirement", "where", "limit", "value", "u (k = 1)", "margin", "probability", ""}};
  const bool noise = headlamp.pass_probability.has_value();
  for (const Finding& finding : headlamp.findings) {
    const char* unit = finding.kind == Kind::kFlux ? "lm" : "cd";
    rows.push_back({finding.name, WhereText(finding),
                    fmt::format("{} {:.5g} {}{}", finding.is_least ? "≥" : "≤", finding.limit, unit,
                                finding.limit_text.empty() ? "" : " (" + finding.limit_text + ")"),
                    RoundedTo(finding.value.value, finding.value.u),
                    finding.value.u ? UncertaintyText(*finding.value.u) : "",
                    finding.limit > 0
                        ? fmt::format("{:+.1f} %", 100 * finding.margin.value / finding.limit)
                        : "",
                    Probability(finding.pass_probability),
                    VerdictName(finding.verdict) +
                        (finding.unless.empty() ? "" : ", counts unless " + finding.unless)});
  }
  if (!noise)
    for (auto& row : rows) {
      row.erase(row.begin() + 6);
      row.erase(row.begin() + 4);
    }
  return rows;
}

std::vector<std::string> HeadlampMaps(const HeadlampReport& report) {
  const auto& headlamp = report.headlamp;
  const double distance_m = headlamp.asked.regulation.distance_m;
  IsoluxMap screen = ScreenMap(headlamp, headlamp.screen, report.screen, distance_m);
  for (const Finding& finding : headlamp.findings) {
    if (finding.kind == Kind::kFlux || finding.kind == Kind::kSum) continue;
    const auto [x, y] = OnScreen(finding.place, distance_m);
    screen.marks.push_back({x, y, finding.name, finding.verdict == Verdict::kFail});
  }
  for (const auto& requirement : headlamp.asked.regulation.requirements) {
    if (requirement.kind != Kind::kZone && requirement.kind != Kind::kLine) continue;
    IsoluxLine line;
    for (const Place& place : requirement.places)
      line.points.push_back(OnScreen(place, distance_m));
    if (requirement.kind == Kind::kZone) line.points.push_back(line.points.front());
    screen.lines.push_back(line);
  }
  std::vector<std::string> maps{SvgIsolux(screen)};
  if (headlamp.aiming_screen)
    maps.push_back(SvgIsolux(ScreenMap(headlamp, *headlamp.aiming_screen, report.aiming_screen,
                                       *headlamp.asked.regulation.screen_m)));
  IsoluxMap road = MapOf(headlamp.road, report.road);
  road.y_label = "before the lamp, m";
  const double middle = Dot(headlamp.road.centre_m, headlamp.road.up);
  road.y0 = middle - headlamp.road.height_m / 2;
  road.y1 = middle + headlamp.road.height_m / 2;
  maps.push_back(SvgIsolux(road));
  maps.push_back(SvgIsolux(ViewMap(headlamp.view, report.view)));
  return maps;
}

std::vector<std::string> HeadlampParagraphs(const photometry::Headlamp& headlamp) {
  std::vector<std::string> paragraphs{fmt::format(
      "Verdict: {}{}. H = V = 0 is aimed to {} of the lamp's own frame{}.",
      VerdictName(headlamp.verdict),
      headlamp.pass_probability ? fmt::format(", all limits met with probability {}",
                                              Probability(headlamp.pass_probability))
                                : "",
      PlaceText(headlamp.aimed),
      headlamp.aimed_u_deg ? fmt::format(" (u {:.2g}° and {:.2g}°)", (*headlamp.aimed_u_deg)[0],
                                         (*headlamp.aimed_u_deg)[1])
                           : "")};
  for (const std::string& remark : headlamp.remarks) paragraphs.push_back("Note: " + remark + ".");
  return paragraphs;
}

void AddHeadlamp(HtmlPage& page, const HeadlampReport& report) {
  const auto& headlamp = report.headlamp;
  page.Heading(headlamp.asked.name);
  page.Paragraph(
      fmt::format("{} ({}).", headlamp.asked.regulation.name, headlamp.asked.regulation.source));
  for (const std::string& paragraph : HeadlampParagraphs(headlamp)) page.Paragraph(paragraph);
  page.Table(RequirementTable(headlamp));
  AddCutOff(page, headlamp);
  AddSweep(page, headlamp);
  page.Paragraph(kHeadlampMapsNote);
  page.Raw("<div class=\"row\">\n");
  for (const std::string& map : HeadlampMaps(report)) page.Raw(map);
  page.Raw("</div>\n");
}

}  // namespace luxfield::cli
