#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "luxfield/cli/reports/colour_report.h"
#include "luxfield/cli/reports/estimate_table.h"
#include "luxfield/cli/reports/eye_report.h"
#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/cli/reports/photometry_plots.h"
#include "luxfield/cli/reports/photometry_report.h"
#include "luxfield/cli/reports/received_report.h"
#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

using photometry::Estimate;
using Rows = EstimateRows;

void AddAngle(Rows& rows, const std::string& name, const std::string& share,
              const std::optional<photometry::BeamAngle>& angle) {
  if (!angle) return;
  rows.push_back(EstimateRow(fmt::format("{} ({} of the largest intensity)", name, share),
                             angle->mean_deg, "°"));
  rows.push_back(EstimateRow(name + " along C0-C180", angle->along_c0_deg, "°"));
  rows.push_back(EstimateRow(name + " along C90-C270", angle->along_c90_deg, "°"));
}

void AddShare(Rows& rows, const std::string& name, const std::optional<Estimate>& share) {
  if (!share) return;
  rows.push_back(
      EstimateRow(name, {100 * share->value, share->u ? std::optional(100 * *share->u) : share->u},
                  "% of the flux"));
}

void AddPeakDirection(Rows& rows, const std::optional<photometry::DirectionUncertainty>& u) {
  if (!u) return;
  for (const auto& [name, angle] : {std::pair{"Its direction along C0-C180", u->along_c0_deg},
                                    {"Its direction across that", u->across_deg}})
    rows.push_back({name, "", UncertaintyText(angle), "", "°"});
}

Rows DistributionRows(const photometry::Distribution& d, const PhotometryNames& names) {
  Rows rows{EstimateHead("quantity")};
  rows.push_back(EstimateRow(names.flux, d.flux, names.flux_unit));
  rows.push_back(EstimateRow(names.intensity + " on the axis", d.axis, names.intensity_unit));
  const auto peak = photometry::DirectionOf(d.peak_direction);
  const std::string where = PeakText(d);
  rows.push_back(EstimateRow("Largest" + (where.empty() ? "" : ", at " + where), d.peak,
                             names.intensity_unit));
  AddPeakDirection(rows, d.peak_direction_u);
  AddAngle(rows, "Beam angle", "50 %", d.beam);
  AddAngle(rows, "Field angle", "10 %", d.field);
  AddShare(rows, "Downwards", d.downward_share);
  AddShare(rows, "Upwards", d.upward_share);
  AddShare(rows, "Not mirrored in the plane C0-C180", d.asymmetry_c0_c180);
  AddShare(rows, "Not mirrored in the plane C90-C270", d.asymmetry_c90_c270);
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k)
    if (const auto& distance = d.on_axis.distance_m[k])
      rows.push_back(EstimateRow(fmt::format("Inverse square within {} % on the axis, from",
                                             photometry::kInverseSquarePercent[k]),
                                 *distance, "m"));
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k)
    if (const auto& distance = d.towards_peak.distance_m[k]; distance && peak.gamma_deg > 0.05)
      rows.push_back(EstimateRow(fmt::format("Inverse square within {} % towards the peak, from",
                                             photometry::kInverseSquarePercent[k]),
                                 *distance, "m"));
  if (d.covered_gamma_deg)
    rows.push_back(
        EstimateRow("Whole filter plane seen up to gamma", {d.covered_gamma_deg->value, {}}, "°"));
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
  double largest = 0;
  for (const Estimate& one : table.intensity) largest = std::max(largest, std::abs(one.value));
  constexpr double kRounding = 1e-7;  // of the largest: C are floats
  for (const std::size_t g : Thinned(LitAngles(table), 24)) {
    auto& row = rows.emplace_back();
    row.push_back(fmt::format("{:.4g}°", table.gamma_deg[g]));
    for (const std::size_t c : planes) {
      const Estimate& one = table.at(c, g);
      const bool lit = std::abs(one.value) > kRounding * largest;
      row.push_back(!lit ? "0" : one.u ? RoundedTo(one.value, one.u) : Digits(one.value, 4));
    }
  }
  const bool says_unit = names.intensity.ends_with(names.intensity_unit);  // "Intensity, relative"
  page.Paragraph(fmt::format(
      "{}{}; all planes and angles, with their uncertainties where they are known, are in the "
      "files that -o X.json and -o X.csv write.",
      names.intensity, says_unit ? "" : " in " + names.intensity_unit));
  page.Table(rows);
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
      row.push_back(!one                 ? "-"
                    : IsBelowScale(*one) ? BelowScaleText()
                    : one->u ? RoundedTo(one->value, one->u) + " ± " + UncertaintyText(*one->u)
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
        "before {:g} {}; a dash where it is not in view or dark. Of what is as bright as {:g} {} "
        "or "
        "brighter:",
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

}  // namespace

std::string PhotometryPage(const PhotometryReport& report, const photometry::Lamp& lamp) {
  const PhotometryNames names = NamesOf(report.distribution.unit);
  HtmlPage page("Photometry of " + std::filesystem::path(report.file).filename().string());
  page.Paragraph(
      fmt::format("{}, SHA-256 {}; luxfield {}.", report.file, report.sha256, LUXFIELD_VERSION));
  page.Paragraph(report.uncertainty);
  for (const std::string& remark : report.distribution.remarks)
    page.Paragraph("Note: " + remark + ".");
  AddEstimates(page, DistributionRows(report.distribution, names));
  AddPlots(page, lamp, names, report.table);
  AddTable(page, report.table, names);
  if (report.colour) AddColour(page, *report.colour);
  for (const HeadlampReport& headlamp : report.headlamps) AddHeadlamp(page, headlamp);
  AddReceived(page, report);
  AddEyes(page, lamp, report.file, report.eyes, names);
  AddGlare(page, report.glare, names);
  page.Heading("Quality of the measurement");
  page.Table(QualityTable(report.quality));
  for (const std::string& remark : QualityRemarks(report.quality)) page.Paragraph(remark);
  return page.Text();
}

}  // namespace luxfield::cli
