#include "luxfield/cli/reports/certificate.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/cli/build_facts.h"
#include "luxfield/cli/pdf/pdf_document.h"
#include "luxfield/cli/reports/certificate_results.h"
#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/estimate_table.h"
#include "luxfield/cli/reports/eye_picture.h"
#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/cli/reports/photometry_plots.h"
#include "luxfield/cli/reports/received_report.h"
#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/reconstruct/budget/error_budget_json.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

using core::Json;
using reconstruct::QuantityBudget;
using Rows = std::vector<std::vector<std::string>>;

constexpr const char* kNotStated = "not stated";
constexpr double kMapHeight = 190;  // points: two rows of maps and the intensities share a page

std::string TextOf(const Certificate& certificate, const char* key) {
  const auto found = certificate.texts.find(key);
  return found == certificate.texts.end() ? kNotStated : found->second;
}

std::string CoverageText(const Certificate& certificate, const PhotometryReport& report) {
  const bool noise = report.distribution.flux.u.has_value();
  std::string text =
      "U is the expanded uncertainty: the standard uncertainty times the coverage factor k = 2, "
      "which for a normal distribution covers about 95 % (JCGM 100). ";
  if (!noise) text += "The noise of the measurement was not given with the light field. ";
  if (certificate.budget)
    text +=
        "It has the noise of the measurement and, of what is proportional to the light, what the "
        "budget of the flux states of all sources beside noise. Sources that are not stated are in "
        "no U.";
  else
    text +=
        "It is of noise alone: no budget was given, and exposure times, drift, geometry, filters "
        "and calibration are not in it.";
  if (report.quality.mismatch_u())
    text += " Of what is proportional to the light it also has the spectral mismatch.";
  return text;
}

const char* const kOnlyThisLamp =
    "The results are of the lamp named above, as received and operated as stated, alone. This "
    "certificate may be copied in full only, unless the laboratory agrees in writing.";

void AddIdentity(PdfPages& pages, const Certificate& certificate, const PhotometryReport& report) {
  pages.Title("Certificate of photometric measurement");
  Rows rows{{"stated by the laboratory", ""}};
  for (const auto& text : photometry::kCertificateTexts)
    rows.push_back({text.label, TextOf(certificate, text.key)});
  pages.Table(rows);
  for (const std::string& remark : report.distribution.remarks)
    pages.Paragraph("Note: " + remark + ".");
}

void AddResults(PdfPages& pages, const Certificate& certificate, const PhotometryReport& report) {
  pages.Heading("Results");
  Rows rows{{"quantity", "where", "value", "U (k = 2)", "unit"}};
  for (const CertificateResult& line : CertificateResults(certificate, report))
    if (line.rating && IsBelowScale({line.value, {}}))
      rows.push_back({line.quantity, line.where, BelowScaleText(), "", ""});
    else
      rows.push_back({line.quantity, line.where, RoundedTo(line.value, line.expanded),
                      line.expanded ? UncertaintyText(*line.expanded) : "not known", line.unit});
  pages.Table(rows);
  pages.Paragraph(CoverageText(certificate, report));
}

void AddPlots(PdfPages& pages, const PhotometryReport& report, const photometry::Lamp& lamp) {
  const PhotometryNames names = NamesOf(report.distribution.unit);
  pages.Heading(names.intensity + " by direction");
  pages.Plots(IntensityPlots(lamp, report.table.gamma_deg.back() > 90), 205);
  pages.Paragraph(kIntensityPlotsNote);
  if (report.planes.empty()) return;
  pages.Heading(names.illuminance + " on planes");
  std::vector<std::string> row;
  constexpr std::size_t kMostPlanes = 4;  // of those that are asked for, on the certificate
  for (std::size_t k = 0; k < std::min(kMostPlanes, report.planes.size()); ++k) {
    row.push_back(SvgIsolux(
        IsoluxOf(report.planes[k], ReceivedNames(report, report.planes[k].asked.weighting))));
    if (row.size() == 2 || k + 1 == std::min(kMostPlanes, report.planes.size())) {
      pages.Plots(row, kMapHeight);
      row.clear();
    }
  }
}

// At most two pictures, the first that are asked for.
void AddEyes(PdfPages& pages, const PhotometryReport& report, const photometry::Lamp& lamp) {
  constexpr std::size_t kMost = 2;
  std::vector<std::string> pictures;
  std::string note;
  for (const auto& answer : report.eyes) {
    const auto eye = PictureAsked(lamp, answer.asked);
    if (!eye || pictures.size() == kMost) continue;
    if (note.empty()) note = EyePictureNote(answer, NamesOf(report.distribution.unit));
    pictures.push_back(SvgEyePicture(lamp, answer, *eye, NamesOf(report.distribution.unit)));
  }
  if (pictures.empty()) return;
  pages.Heading(NamesOf(report.distribution.unit).LuminanceTitle());
  pages.Plots(pictures, kMapHeight);
  if (!note.empty()) pages.Paragraph(note);
}

void AddHeadlamps(PdfPages& pages, const PhotometryReport& report) {
  for (const HeadlampReport& headlamp : report.headlamps) {
    pages.Heading(headlamp.headlamp.asked.name);
    pages.Paragraph(fmt::format("{} ({}).", headlamp.headlamp.asked.regulation.name,
                                headlamp.headlamp.asked.regulation.source));
    for (const std::string& text : HeadlampParagraphs(headlamp.headlamp)) pages.Paragraph(text);
    pages.Table(RequirementTable(headlamp.headlamp));
    pages.Plots({HeadlampMaps(headlamp)[0]}, 230);
    pages.Paragraph(kHeadlampMapsNote);
  }
}

void AddQuality(PdfPages& pages, const QualityReport& quality) {
  pages.Heading("Quality of the measurement");
  pages.Table(QualityTable(quality));
  for (const std::string& remark : QualityRemarks(quality)) pages.Paragraph(remark);
}

void AddBudget(PdfPages& pages, const Certificate& certificate, const QualityReport& quality) {
  pages.Heading("Uncertainty budget");
  const double mismatch = quality.mismatch_u().value_or(0);
  if (!certificate.budget) {
    pages.Paragraph("No budget was given (--session).");
    if (quality.mismatch_u())
      pages.Paragraph(fmt::format("Spectral mismatch, relative: {:.3f} %.", 100 * mismatch));
    return;
  }
  Rows rows{{"source"}};
  const auto& quantities = certificate.budget->quantities;
  constexpr std::size_t kMost = 4;
  const std::size_t shown = std::min(kMost, quantities.size());
  for (std::size_t k = 0; k < shown; ++k) rows[0].push_back(quantities[k].name + ", %");
  const auto percent = [](const QuantityBudget& q, double sigma) {
    return q.value == 0 ? std::string("-") : fmt::format("{:.3f}", 100 * sigma / std::abs(q.value));
  };
  for (int s = 0; s < reconstruct::kErrorSources; ++s) {
    const auto source = static_cast<reconstruct::ErrorSource>(s);
    auto& row = rows.emplace_back();
    row.push_back(reconstruct::ErrorSourceName(source));
    for (std::size_t k = 0; k < shown; ++k) {
      const auto& sigma = quantities[k].of(source);
      row.push_back(sigma ? percent(quantities[k], *sigma) : kNotStated);
    }
  }
  auto& of_mismatch = rows.emplace_back();
  of_mismatch.push_back("spectral mismatch");
  for (std::size_t k = 0; k < shown; ++k)
    of_mismatch.push_back(quality.mismatch_u() ? fmt::format("{:.3f}", 100 * mismatch)
                                               : kNotStated);
  auto& total = rows.emplace_back();
  total.push_back("combined standard uncertainty");
  for (std::size_t k = 0; k < shown; ++k)
    total.push_back(
        percent(quantities[k], std::hypot(quantities[k].Total(), mismatch * quantities[k].value)));
  pages.Table(rows);
}

// As of `luxfield budget`, with the spectral mismatch as one more source.
Json BudgetJson(const Certificate& certificate, const QualityReport& quality) {
  if (!certificate.budget) return {};
  Json json = reconstruct::ToJson(*certificate.budget);
  const auto relative = quality.mismatch_u();
  for (std::size_t k = 0; k < certificate.budget->quantities.size(); ++k) {
    const QuantityBudget& quantity = certificate.budget->quantities[k];
    Json& one = json["quantities"][k];
    const double mismatch = relative.value_or(0) * std::abs(quantity.value),
                 total = std::hypot(quantity.Total(), mismatch);
    one["sources"]["spectral mismatch"] = relative ? Json(mismatch) : Json();
    one["sigma"] = total;
    one["relative"] = quantity.value == 0 ? 0.0 : total / std::abs(quantity.value);
  }
  return json;
}

void AddSetUp(PdfPages& pages, const Certificate& certificate) {
  pages.Heading("Set-up");
  if (certificate.set_up.empty()) pages.Paragraph("No session was given (--session).");
  Rows rows{{"item", "as recorded by the program"}};
  for (const auto& [item, value] : certificate.set_up) rows.push_back({item, value});
  if (rows.size() > 1) pages.Table(rows);
}

void AddFiles(PdfPages& pages, const Certificate& certificate) {
  pages.Heading("Files and program");
  Rows rows{{"file", "name", "SHA-256"}};
  for (const HashedFile& file : certificate.files)
    rows.push_back({file.role, file.file, file.sha256});
  pages.Table(rows);
  pages.Paragraph(fmt::format("Evaluated by luxfield {}.", LUXFIELD_VERSION));
  pages.Paragraph(kOnlyThisLamp);
}

}  // namespace

core::Json CertificateJson(const Certificate& certificate, const PhotometryReport& report) {
  Json texts = Json::object();
  for (const auto& text : photometry::kCertificateTexts) {
    const auto found = certificate.texts.find(text.key);
    texts[text.key] = found == certificate.texts.end() ? Json() : Json(found->second);
  }
  Json files = Json::array(), set_up = Json::array(), results = Json::array();
  for (const HashedFile& file : certificate.files)
    files.push_back({{"role", file.role}, {"file", file.file}, {"sha256", file.sha256}});
  for (const auto& [item, value] : certificate.set_up)
    set_up.push_back({{"item", item}, {"value", value}});
  for (const CertificateResult& line : CertificateResults(certificate, report))
    results.push_back({{"quantity", line.quantity},
                       {"where", line.where},
                       {"unit", line.unit},
                       {"value", line.value},
                       {"u_noise", OptionalJson(line.u)},
                       {"U", OptionalJson(line.expanded)}});
  return {
      {"format", "luxfield-certificate"},
      {"version", 1},
      {"laboratory", texts},
      {"coverage", {{"k", 2}, {"text", CoverageText(certificate, report)}}},
      {"results", results},
      {"photometry", ToJson(report)},
      {"budget", BudgetJson(certificate, report.quality)},
      {"set_up", set_up},
      {"files", files},
      {"program", {{"name", "luxfield"}, {"version", LUXFIELD_VERSION}, {"build", BuildFacts()}}},
      {"statement", kOnlyThisLamp}};
}

void WriteCertificate(const std::filesystem::path& pdf, const Certificate& certificate,
                      const PhotometryReport& report, const photometry::Lamp& lamp) {
  const PdfFacts facts{
      "Certificate of photometric measurement",
      fmt::format("Certificate {}, {}; light field SHA-256 {}.", TextOf(certificate, "number"),
                  TextOf(certificate, "laboratory"), report.sha256)};
  WritePdf(pdf, facts, [&](PdfPages& pages) {
    AddIdentity(pages, certificate, report);
    AddResults(pages, certificate, report);
    AddPlots(pages, report, lamp);
    AddEyes(pages, report, lamp);
    AddHeadlamps(pages, report);
    AddQuality(pages, report.quality);
    AddBudget(pages, certificate, report.quality);
    AddSetUp(pages, certificate);
    AddFiles(pages, certificate);
  });
}

}  // namespace luxfield::cli
