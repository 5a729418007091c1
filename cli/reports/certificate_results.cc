#include "luxfield/cli/reports/certificate_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
enum class Scales { kWithLight, kNot };

class Lines {
 public:
  explicit Lines(std::optional<double> common) : common_(common) {}

  void Add(std::string quantity, std::string where, const Estimate& estimate, std::string unit,
           Scales scales) {
    CertificateResult line{std::move(quantity), std::move(where), std::move(unit),
                           estimate.value,      estimate.u,       {}};
    if (estimate.u) {
      const double shared = scales == Scales::kWithLight ? common_.value_or(0) * estimate.value : 0;
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
  for (const auto& path : report.paths) {
    const PhotometryNames own = ReceivedNames(report, path.asked.weighting);
    lines.Add("Dose of " + own.Received(path.asked.receiver.shape), path.asked.name, path.dose,
              own.DoseUnit(), Scales::kWithLight);
  }
  for (const auto& eye : report.eyes)
    for (const auto& field : eye.fields) {
      lines.Add(fmt::format("Largest mean luminance over {:g} mrad", field.mrad), eye.asked.name,
                field.largest, names.LuminanceUnit(), Scales::kWithLight);
      lines.Add(fmt::format("Peak luminance within these {:g} mrad", field.mrad), eye.asked.name,
                field.peak, names.LuminanceUnit(), Scales::kWithLight);
    }
  return lines.lines();
}

}  // namespace luxfield::cli
