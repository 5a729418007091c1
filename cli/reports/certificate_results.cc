#include "luxfield/cli/reports/certificate_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/cli/reports/received_report.h"

namespace luxfield::cli {
namespace {

using photometry::Estimate;
using reconstruct::ErrorSource;
using reconstruct::QuantityBudget;

const QuantityBudget* FluxBudget(const Certificate& certificate) {
  if (!certificate.budget) return nullptr;
  for (const QuantityBudget& quantity : certificate.budget->quantities)
    if (quantity.name == "flux") return &quantity;
  return nullptr;
}

// How a quantity hangs on the level of the light.
enum class Scales { kWithLight, kAsUgr, kNot };

// What a relative change of all of the light is worth.
double PerLight(double value, Scales scales) {
  switch (scales) {
    case Scales::kWithLight:
      return value;
    case Scales::kAsUgr:  // 8 log10 of the square of the luminance
      return 16 / std::numbers::ln10;
    case Scales::kNot:
      break;
  }
  return 0;
}

class Lines {
 public:
  explicit Lines(std::optional<double> common) : common_(common) {}

  void Add(std::string quantity, std::string where, const Estimate& estimate, std::string unit,
           Scales scales) {
    CertificateResult line{std::move(quantity),     std::move(where), std::move(unit),
                           estimate.value,          estimate.u,       {},
                           scales == Scales::kAsUgr};
    if (estimate.u) {
      const double shared = common_.value_or(0) * PerLight(estimate.value, scales);
      line.expanded = 2 * std::hypot(*estimate.u, shared);
    }
    lines_.push_back(std::move(line));
  }
  void Add(std::string quantity, std::string where, const std::optional<Estimate>& estimate,
           std::string unit, Scales scales) {
    if (estimate) Add(std::move(quantity), std::move(where), *estimate, std::move(unit), scales);
  }
  std::vector<CertificateResult>& lines() { return lines_; }

 private:
  std::optional<double> common_;
  std::vector<CertificateResult> lines_;
};

void AddDistribution(Lines* lines, const photometry::Distribution& d,
                     const PhotometryNames& names) {
  lines->Add(names.flux, "", d.flux, names.flux_unit, Scales::kWithLight);
  lines->Add(names.intensity, "C = 0°, gamma = 0°", d.axis, names.intensity_unit,
             Scales::kWithLight);
  lines->Add("Largest " + std::string(1, static_cast<char>(std::tolower(names.intensity[0]))) +
                 names.intensity.substr(1),
             PeakText(d), d.peak, names.intensity_unit, Scales::kWithLight);
  if (d.beam)
    lines->Add("Beam angle, 50 %", "mean of both planes", d.beam->mean_deg, "°", Scales::kNot);
  if (d.field)
    lines->Add("Field angle, 10 %", "mean of both planes", d.field->mean_deg, "°", Scales::kNot);
  for (std::size_t k = 0; k < photometry::kInverseSquarePercent.size(); ++k)
    lines->Add("Inverse square law holds from",
               fmt::format("axis, within {} %", photometry::kInverseSquarePercent[k]),
               d.on_axis.distance_m[k], "m", Scales::kNot);
}

void AddEye(Lines* lines, const photometry::EyeAnswer& eye, const PhotometryNames& names) {
  const std::string &where = eye.asked.name, luminance = names.LuminanceUnit();
  for (const auto& field : eye.fields) {
    lines->Add(fmt::format("Largest mean {} over {:g} mrad", names.Luminance(), field.mrad), where,
               field.largest, luminance, Scales::kWithLight);
    lines->Add(fmt::format("Peak {} within these {:g} mrad", names.Luminance(), field.mrad), where,
               field.peak, luminance, Scales::kWithLight);
  }
  if (eye.area)
    lines->Add(
        fmt::format("Luminous area, projected, above {:g} {}", eye.asked.threshold, luminance),
        where, eye.area->projected_m2, "m²", Scales::kNot);
  lines->Add("UGR of this lamp alone", where, eye.ugr, "1", Scales::kAsUgr);
  lines->Add("UGR of the opening, evenly bright", where, eye.plain_ugr, "1", Scales::kAsUgr);
  lines->Add("Veiling " + names.Luminance(), where, eye.veiling, luminance, Scales::kWithLight);
  lines->Add("Threshold increment", where, eye.threshold_increment, "%", Scales::kWithLight);
}

// The largest of a table of ratings.
void AddGlare(Lines* lines, const photometry::GlareAnswer& glare) {
  const auto add = [&](const char* name, const std::vector<std::optional<Estimate>>& ratings) {
    const auto largest = std::max_element(
        ratings.begin(), ratings.end(),
        [](const auto& a, const auto& b) { return b && (!a || a->value < b->value); });
    if (largest != ratings.end()) lines->Add(name, glare.asked.name, *largest, "1", Scales::kAsUgr);
  };
  add("Largest UGR of this lamp alone", glare.ugr);
  add("Largest UGR of the opening, evenly bright", glare.plain_ugr);
}

void AddColour(Lines* lines, const photometry::ColourDistribution& colour) {
  const std::string where = "all of the flux";
  if (colour.mean) {
    lines->Add("Chromaticity, x", where, colour.mean->x, "1", Scales::kNot);
    lines->Add("Chromaticity, y", where, colour.mean->y, "1", Scales::kNot);
    lines->Add("Correlated colour temperature", where, colour.mean->kelvin, "K", Scales::kNot);
    lines->Add("Duv", where, colour.mean->duv, "1", Scales::kNot);
  }
  if (colour.largest_deviation)
    lines->Add("Largest distance in u', v' from that",
               fmt::format("C = {:.1f}°, gamma = {:.1f}°", colour.largest_at.c_deg,
                           colour.largest_at.gamma_deg),
               *colour.largest_deviation, "1", Scales::kNot);
}

}  // namespace

std::optional<double> CommonRelative(const Certificate& certificate,
                                     const PhotometryReport& report) {
  const QuantityBudget* flux = FluxBudget(certificate);
  const auto mismatch = report.quality.mismatch_u();
  if (!flux || flux->value == 0) return mismatch;
  double sum = 0;
  for (int s = 0; s < reconstruct::kErrorSources; ++s) {
    const auto source = static_cast<ErrorSource>(s);
    if (source == ErrorSource::kPhotonNoise || source == ErrorSource::kReadNoise) continue;
    if (const auto& sigma = flux->of(source)) sum += *sigma * *sigma;
  }
  return std::hypot(std::sqrt(sum) / std::abs(flux->value), mismatch.value_or(0));
}

std::vector<CertificateResult> CertificateResults(const Certificate& certificate,
                                                  const PhotometryReport& report) {
  const PhotometryNames names = NamesOf(report.distribution.unit);
  Lines lines(CommonRelative(certificate, report));
  AddDistribution(&lines, report.distribution, names);
  if (const QuantityBudget* flux = FluxBudget(certificate); flux && flux->value != 0)
    lines.lines()[0].expanded =
        2 * std::hypot(flux->Total() / flux->value, report.quality.mismatch_u().value_or(0)) *
        std::abs(lines.lines()[0].value);
  for (const auto& point : report.points) {
    const PhotometryNames own = ReceivedNames(report, point.asked.weighting);
    lines.Add(own.illuminance, point.asked.name, point.illuminance, own.illuminance_unit,
              Scales::kWithLight);
  }
  for (const auto& plane : report.planes) {
    const PhotometryNames own = ReceivedNames(report, plane.asked.weighting);
    const std::string title = own.IlluminanceTitle(plane.asked.receiver.shape);
    lines.Add(title + ", mean", plane.asked.name, plane.mean, own.illuminance_unit,
              Scales::kWithLight);
    lines.Add(title + ", largest", plane.asked.name, plane.most, own.illuminance_unit,
              Scales::kWithLight);
    lines.Add("Uniformity, smallest / mean", plane.asked.name, plane.uniformity, "1", Scales::kNot);
  }
  for (const auto& volume : report.volumes) {
    const PhotometryNames own = ReceivedNames(report, volume.asked.middle.weighting);
    const std::string title = own.IlluminanceTitle(volume.asked.middle.receiver.shape);
    for (const auto& [which, estimate] :
         {std::pair{", mean", &volume.mean}, {", largest", &volume.most}})
      lines.Add(title + which, volume.asked.middle.name, *estimate, own.illuminance_unit,
                Scales::kWithLight);
  }
  for (const auto& path : report.paths) {
    const PhotometryNames own = ReceivedNames(report, path.asked.weighting);
    lines.Add("Dose of " + own.Received(path.asked.receiver.shape), path.asked.name, path.dose,
              own.DoseUnit(), Scales::kWithLight);
  }
  for (const auto& eye : report.eyes) AddEye(&lines, eye, names);
  for (const auto& glare : report.glare) AddGlare(&lines, glare);
  if (report.colour) AddColour(&lines, *report.colour);
  return lines.lines();
}

}  // namespace luxfield::cli
