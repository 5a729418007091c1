#include <fmt/format.h>

#include <algorithm>

#include "luxfield/cli/reports/estimate_table.h"
#include "luxfield/cli/reports/photometry_plots.h"
#include "luxfield/cli/reports/received_report.h"
#include "luxfield/cli/svg/svg_isolux.h"
#include "luxfield/cli/svg/svg_plot.h"

namespace luxfield::cli {
namespace {

using lightfield::Vec3;
using photometry::Estimate;
using photometry::PlaneAnswer;
using photometry::PointAnswer;

EstimateRows PointTable(const PointAnswer& answer, const PhotometryNames& names) {
  const Vec3 p = answer.asked.p_m;
  const std::string place = fmt::format("({:.4g}, {:.4g}, {:.4g}) m", p.x, p.y, p.z);
  // Points without a name are called by their place.
  EstimateRows rows{
      EstimateHead(answer.asked.name == place ? place : answer.asked.name + ", at " + place)};
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

// Of a plane or a volume; `points` is how many there are, "41 x 41 points".
EstimateRows SummaryTable(const std::string& name, const std::string& points,
                          const photometry::ManyPoints& answer, const std::string& unit) {
  EstimateRows rows{EstimateHead(name)};
  rows.push_back(EstimateRow("mean of " + points, answer.mean, unit));
  rows.push_back(EstimateRow("smallest", answer.least, unit));
  rows.push_back(EstimateRow("largest", answer.most, unit));
  if (answer.uniformity) rows.push_back(EstimateRow("smallest / mean", *answer.uniformity, ""));
  if (answer.diversity) rows.push_back(EstimateRow("smallest / largest", *answer.diversity, ""));
  return rows;
}

void AddPlane(HtmlPage& page, const PlaneAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  AddBeside(page, {SvgIsolux(IsoluxOf(answer, names))},
            SummaryTable(asked.name, fmt::format("{} x {} points", asked.columns, asked.rows),
                         answer, names.illuminance_unit));
}

void AddVolume(HtmlPage& page, const photometry::VolumeAnswer& answer,
               const PhotometryNames& names) {
  constexpr int kMostShown = 4;
  const auto& asked = answer.asked;
  std::vector<std::string> maps;
  for (int k = 0; k < std::min(asked.layers, kMostShown); ++k) {
    // The first, the last, and evenly between them.
    const int layer = asked.layers <= kMostShown ? k : (asked.layers - 1) * k / (kMostShown - 1);
    PlaneAnswer one;
    one.asked = asked.Layer(layer);
    const auto first =
        answer.values.begin() + static_cast<std::ptrdiff_t>(asked.middle.count()) * layer;
    one.values.assign(first, first + static_cast<std::ptrdiff_t>(asked.middle.count()));
    maps.push_back(SvgIsolux(IsoluxOf(one, names)));
  }
  AddBeside(page, maps,
            SummaryTable(asked.middle.name,
                         fmt::format("{} x {} x {} points", asked.middle.columns, asked.middle.rows,
                                     asked.layers),
                         answer, names.illuminance_unit));
}

void AddLine(HtmlPage& page, const photometry::LineAnswer& answer, const PhotometryNames& names) {
  Plot plot;
  plot.title = answer.asked.name;
  plot.x_label = "along the line, m";
  plot.y_label = names.illuminance_unit;
  const double step = Length(answer.asked.to_m - answer.asked.from_m) / (answer.asked.points - 1);
  const auto add = [&](const std::string& name, auto&& value_of) {
    Series series;
    series.name = name;
    for (std::size_t k = 0; k < answer.points.size(); ++k) {
      series.x.push_back(step * static_cast<double>(k));
      series.y.push_back(value_of(answer.points[k]));
    }
    series.dashed = plot.series.size() % 2 == 1;
    plot.series.push_back(std::move(series));
  };
  add("plane", [](const PointAnswer& point) { return point.illuminance.value; });
  add("sphere", [](const PointAnswer& point) { return point.spherical.value; });
  add("cylinder", [](const PointAnswer& point) { return point.cylindrical.value; });
  if (answer.points[0].semicylindrical)
    add("semicylinder", [](const PointAnswer& point) { return point.semicylindrical->value; });
  const auto by_plane = [](const PointAnswer& a, const PointAnswer& b) {
    return a.illuminance.value < b.illuminance.value;
  };
  const auto [least, most] =
      std::minmax_element(answer.points.begin(), answer.points.end(), by_plane);
  const auto at = [&](const PointAnswer& point) {
    return fmt::format(" on a plane, {:.4g} m along",
                       Length(point.asked.p_m - answer.asked.from_m));
  };
  AddBeside(page, {SvgPlot(plot)},
            {EstimateHead(fmt::format("{} points", answer.asked.points)),
             EstimateRow("smallest" + at(*least), least->illuminance, names.illuminance_unit),
             EstimateRow("largest" + at(*most), most->illuminance, names.illuminance_unit)});
}

void AddPath(HtmlPage& page, const photometry::DoseAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  const std::string title = names.IlluminanceTitle(asked.receiver.shape);
  Plot plot;
  plot.title = fmt::format("{}, {}", title, asked.name);
  plot.x_label = "time, s";
  plot.y_label = names.illuminance_unit;
  Series series;
  series.x = answer.time_s;
  series.y = answer.rate;
  plot.series.push_back(std::move(series));
  AddBeside(
      page, {SvgPlot(plot)},
      {EstimateHead(asked.name), EstimateRow("dose", answer.dose, names.DoseUnit()),
       EstimateRow("mean over time", answer.mean, names.illuminance_unit),
       EstimateRow(answer.most.value > 0 ? fmt::format("largest, at {:.4g} s", answer.most_at_s)
                                         : "largest",
                   answer.most, names.illuminance_unit)});
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

void AddReceived(HtmlPage& page, const PhotometryReport& report) {
  const std::string illuminance = NamesOf(report.distribution.unit).illuminance;
  const auto names = [&](const std::string& weighting) { return ReceivedNames(report, weighting); };
  if (!report.weightings.empty()) page.Heading("Weighed channels");
  AddWeightings(page, report.weightings);
  if (!report.planes.empty()) page.Heading(illuminance + " on planes");
  for (const auto& answer : report.planes) AddPlane(page, answer, names(answer.asked.weighting));
  if (!report.volumes.empty()) page.Heading(illuminance + " in volumes");
  for (const auto& answer : report.volumes)
    AddVolume(page, answer, names(answer.asked.middle.weighting));
  if (!report.lines.empty()) page.Heading(illuminance + " along lines");
  for (const auto& answer : report.lines) AddLine(page, answer, names(answer.asked.weighting));
  if (!report.points.empty()) page.Heading(illuminance + " at points");
  for (const auto& answer : report.points)
    AddEstimates(page, PointTable(answer, names(answer.asked.weighting)));
  if (!report.paths.empty()) page.Heading("Dose along paths");
  for (const auto& answer : report.paths) AddPath(page, answer, names(answer.asked.weighting));
}

}  // namespace luxfield::cli
