#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "luxfield/cli/reports/colour_report.h"
#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/cli/reports/photometry_plots.h"
#include "luxfield/cli/reports/photometry_report.h"
#include "luxfield/cli/svg/svg_isolux.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

using photometry::Estimate;
using Rows = std::vector<std::vector<std::string>>;

std::string Number(double value) { return fmt::format("{:.5g}", value == 0 ? 0.0 : value); }

// {name, value, u, u / value, unit}.
std::vector<std::string> Row(const std::string& name, const Estimate& estimate,
                             const std::string& unit) {
  std::vector<std::string> row{name, Number(estimate.value), "", "", unit};
  if (estimate.u) {
    row[2] = fmt::format("{:.2g}", *estimate.u);
    if (estimate.value != 0)
      row[3] = fmt::format("{:.2g} %", 100 * *estimate.u / std::abs(estimate.value));
  }
  return row;
}

// As a table; without the columns of uncertainties where there are none.
void AddRows(HtmlPage& page, Rows rows) {
  const bool any =
      std::any_of(rows.begin() + 1, rows.end(), [](const auto& row) { return !row[2].empty(); });
  if (!any)
    for (auto& row : rows) row.erase(row.begin() + 2, row.begin() + 4);
  page.Table(rows);
}

void AddAngle(Rows& rows, const std::string& name, const std::string& share,
              const std::optional<photometry::BeamAngle>& angle) {
  if (!angle) return;
  rows.push_back(
      Row(fmt::format("{} ({} of the largest intensity)", name, share), angle->mean_deg, "°"));
  rows.push_back(Row(name + " along C0-C180", angle->along_c0_deg, "°"));
  rows.push_back(Row(name + " along C90-C270", angle->along_c90_deg, "°"));
}

void AddShare(Rows& rows, const std::string& name, const std::optional<Estimate>& share) {
  if (!share) return;
  rows.push_back(Row(name,
                     {100 * share->value, share->u ? std::optional(100 * *share->u) : share->u},
                     "% of the flux"));
}

void AddAsymmetry(Rows& rows, const std::string& plane, const std::optional<double>& share) {
  if (share)
    rows.push_back(Row("Not mirrored in the plane " + plane, {100 * *share, {}}, "% of the flux"));
}

Rows DistributionRows(const photometry::Distribution& d, const PhotometryNames& names) {
  Rows rows{{"quantity", "value", "u (k = 1)", "relative", "unit"}};
  rows.push_back(Row(names.flux, d.flux, names.flux_unit));
  rows.push_back(Row(names.intensity + " on the axis", d.axis, names.intensity_unit));
  const auto peak = photometry::DirectionOf(d.peak_direction);
  rows.push_back(
      Row(fmt::format("Largest, at C = {:.1f}°, gamma = {:.2f}°", peak.c_deg, peak.gamma_deg),
          d.peak, names.intensity_unit));
  AddAngle(rows, "Beam angle", "50 %", d.beam);
  AddAngle(rows, "Field angle", "10 %", d.field);
  AddShare(rows, "Downwards", d.downward_share);
  AddShare(rows, "Upwards", d.upward_share);
  AddAsymmetry(rows, "C0-C180", d.asymmetry_c0_c180);
  AddAsymmetry(rows, "C90-C270", d.asymmetry_c90_c270);
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k)
    if (const auto& distance = d.on_axis.distance_m[k])
      rows.push_back(Row(fmt::format("Inverse square within {} % on the axis, from",
                                     photometry::kInverseSquarePercent[k]),
                         *distance, "m"));
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k)
    if (const auto& distance = d.towards_peak.distance_m[k]; distance && peak.gamma_deg > 0.05)
      rows.push_back(Row(fmt::format("Inverse square within {} % towards the peak, from",
                                     photometry::kInverseSquarePercent[k]),
                         *distance, "m"));
  if (d.covered_gamma_deg)
    rows.push_back(Row("Whole filter plane seen up to gamma", {*d.covered_gamma_deg, {}}, "°"));
  return rows;
}

void AddPlots(HtmlPage& page, const photometry::Lamp& lamp, const PhotometryNames& names,
              const photometry::IntensityTable& table) {
  page.Heading(names.intensity + " by direction");
  page.Paragraph(kIntensityPlotsNote);
  page.Raw("<div class=\"row\">\n");
  const bool whole_sphere = table.gamma_deg.back() > 90;
  for (const std::string& svg : IntensityPlots(lamp, whole_sphere)) page.Raw(svg);
  page.Raw(SolidOf(lamp, whole_sphere));
  page.Raw("</div>\n");
}

// Every so many of `count`, at most `most` of them.
std::vector<std::size_t> Thinned(std::size_t count, std::size_t most) {
  std::vector<std::size_t> chosen;
  const std::size_t step = std::max<std::size_t>(1, (count + most - 1) / most);
  for (std::size_t k = 0; k < count; k += step) chosen.push_back(k);
  return chosen;
}

// Angles up to the first at which, and beyond which, there is no light in any plane.
std::size_t LitAngles(const photometry::IntensityTable& table) {
  std::size_t lit = 0;
  for (std::size_t c = 0; c < table.c_deg.size(); ++c)
    for (std::size_t g = 0; g < table.gamma_deg.size(); ++g)
      if (table.at(c, g).value != 0) lit = std::max(lit, g + 1);
  return std::min(lit + 1, table.gamma_deg.size());
}

void AddTable(HtmlPage& page, const photometry::IntensityTable& table,
              const PhotometryNames& names) {
  const auto planes = Thinned(table.c_deg.size(), 8);
  Rows rows{{"gamma"}};
  for (const std::size_t c : planes) rows[0].push_back(fmt::format("C {:.4g}°", table.c_deg[c]));
  for (const std::size_t g : Thinned(LitAngles(table), 24)) {
    auto& row = rows.emplace_back();
    row.push_back(fmt::format("{:.4g}°", table.gamma_deg[g]));
    for (const std::size_t c : planes) row.push_back(fmt::format("{:.4g}", table.at(c, g).value));
  }
  page.Paragraph(fmt::format(
      "{} in {}; all planes and angles, with their uncertainties where they are known, are in the "
      "files that -o X.json and -o X.csv write.",
      names.intensity, names.intensity_unit));
  page.Table(rows);
}

void AddPoints(HtmlPage& page, const std::vector<photometry::PointAnswer>& points,
               const PhotometryNames& names) {
  if (points.empty()) return;
  page.Heading(names.illuminance + " at points");
  for (const auto& answer : points) {
    const auto& p = answer.asked.p_m;
    Rows rows{{fmt::format("{}, at ({:.4g}, {:.4g}, {:.4g}) m", answer.asked.name, p.x, p.y, p.z),
               "value", "u (k = 1)", "relative", "unit"}};
    rows.push_back(Row(names.illuminance, answer.illuminance, names.illuminance_unit));
    rows.push_back(Row("mean spherical", answer.spherical, names.illuminance_unit));
    rows.push_back(Row("cylindrical", answer.cylindrical, names.illuminance_unit));
    if (answer.semicylindrical)
      rows.push_back(Row("semicylindrical", *answer.semicylindrical, names.illuminance_unit));
    const char* const kAxes[] = {"light vector, x", "light vector, y", "light vector, z"};
    for (std::size_t k = 0; k < 3; ++k)
      rows.push_back(Row(kAxes[k], answer.light_vector[k], names.illuminance_unit));
    AddRows(page, rows);
  }
}

void AddEyes(HtmlPage& page, const std::vector<photometry::EyeAnswer>& eyes,
             const PhotometryNames& names) {
  if (eyes.empty()) return;
  page.Heading("Luminance");
  for (const auto& answer : eyes) {
    Rows rows{{answer.asked.name, "value", "u (k = 1)", "relative", "unit"}};
    for (const auto& field : answer.fields)
      rows.push_back(Row(fmt::format("largest mean over {:g} mrad", field.mrad), field.largest,
                         names.LuminanceUnit()));
    if (answer.area) {
      rows.push_back(Row(fmt::format("mean of what is above {:g}", answer.asked.threshold),
                         answer.area->luminance, names.LuminanceUnit()));
      rows.push_back(Row("solid angle of that", {answer.area->solid_angle, {}}, "sr"));
    }
    if (answer.ugr) rows.push_back(Row("UGR of this lamp alone", *answer.ugr, ""));
    if (answer.plain_ugr)
      rows.push_back(Row("UGR of the opening, evenly bright", *answer.plain_ugr, ""));
    if (answer.veiling)
      rows.push_back(Row("veiling luminance", *answer.veiling, names.LuminanceUnit()));
    if (answer.threshold_increment)
      rows.push_back(Row("threshold increment", *answer.threshold_increment, "%"));
    AddRows(page, rows);
  }
}

void AddRatings(HtmlPage& page, const photometry::GlareAsked& asked,
                const std::vector<std::optional<Estimate>>& ratings) {
  Rows rows{{"from the axis"}};
  for (const double c : asked.c_deg) rows[0].push_back(fmt::format("C {:.4g}°", c));
  const std::size_t distances = asked.distances_m.size();
  for (std::size_t d = 0; d < distances; ++d) {
    auto& row = rows.emplace_back();
    row.push_back(fmt::format("{:g} m", asked.distances_m[d]));
    for (std::size_t c = 0; c < asked.c_deg.size(); ++c) {
      const auto& one = ratings[c * distances + d];
      row.push_back(!one     ? "-"
                    : one->u ? fmt::format("{:.1f} ± {:.2g}", one->value, *one->u)
                             : fmt::format("{:.1f}", one->value));
    }
  }
  page.Table(rows);
}

void AddGlare(HtmlPage& page, const std::vector<photometry::GlareAnswer>& glare,
              const PhotometryNames& names) {
  if (glare.empty()) return;
  page.Heading("Unified glare rating");
  for (const auto& answer : glare) {
    const auto& asked = answer.asked;
    page.Paragraph(fmt::format(
        "{}: of this lamp alone, for eyes {:g} m below it that look horizontally towards its axis, "
        "before {:g} {}. Of what is as bright as {:g} {} or brighter:",
        asked.name, asked.below_m, asked.background, names.LuminanceUnit(), asked.threshold,
        names.LuminanceUnit()));
    AddRatings(page, asked, answer.ugr);
    if (!asked.opening_m) continue;
    page.Paragraph(
        fmt::format("Of the whole opening of {:g} m x {:g} m, as if it were evenly bright:",
                    (*asked.opening_m)[0], (*asked.opening_m)[1]));
    AddRatings(page, asked, answer.plain_ugr);
  }
}

void AddPlanes(HtmlPage& page, const std::vector<photometry::PlaneAnswer>& planes,
               const PhotometryNames& names) {
  if (planes.empty()) return;
  page.Heading(names.illuminance + " on planes");
  for (const auto& answer : planes) {
    page.Raw("<div class=\"row\">\n");
    page.Raw(SvgIsolux(IsoluxOf(answer, names)));
    Rows rows{{answer.asked.name, "value", "u (k = 1)", "relative", "unit"}};
    rows.push_back(
        Row(fmt::format("mean of {} x {} points", answer.asked.columns, answer.asked.rows),
            answer.mean, names.illuminance_unit));
    rows.push_back(Row("smallest", answer.least, names.illuminance_unit));
    rows.push_back(Row("largest", answer.most, names.illuminance_unit));
    if (answer.uniformity) rows.push_back(Row("smallest / mean", *answer.uniformity, ""));
    if (answer.diversity) rows.push_back(Row("smallest / largest", *answer.diversity, ""));
    page.Raw("<div>\n");
    AddRows(page, rows);
    page.Raw("</div>\n</div>\n");
  }
}

}  // namespace

std::string PhotometryPage(const PhotometryReport& report, const photometry::Lamp& lamp) {
  const PhotometryNames names = NamesOf(report.distribution.unit);
  HtmlPage page("Photometry of " + std::filesystem::path(report.file).filename().string());
  page.Paragraph(
      fmt::format("{}, SHA-256 {}; luxfield {}.", report.file, report.sha256, LUXFIELD_VERSION));
  page.Paragraph(report.uncertainty);
  for (const std::string& remark : report.distribution.remarks)
    page.Paragraph("Note: " + remark + ".");
  AddRows(page, DistributionRows(report.distribution, names));
  AddPlots(page, lamp, names, report.table);
  AddTable(page, report.table, names);
  if (report.colour) AddColour(page, *report.colour);
  for (const HeadlampReport& headlamp : report.headlamps) AddHeadlamp(page, headlamp);
  AddPlanes(page, report.planes, names);
  AddPoints(page, report.points, names);
  AddEyes(page, report.eyes, names);
  AddGlare(page, report.glare, names);
  return page.Text();
}

}  // namespace luxfield::cli
