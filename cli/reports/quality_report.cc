#include "luxfield/cli/reports/quality_report.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/core/error.h"
#include "luxfield/photometry/beyond_planes.h"
#include "luxfield/photometry/spectra.h"

namespace luxfield::cli {
namespace {

using core::Json;

// An index of ISO/CIE 19476 with what it takes to know it.
struct Index {
  const char *key, *name, *takes;
};
constexpr Index kSpectral = {"f1", "spectral mismatch, f1'", "quality.responsivity"};
constexpr Index kLinearity = {"f3", "linearity, f3", "quality.sensor_calibration"};
constexpr std::array kUnknown = {
    Index{"f_uv", "response to ultraviolet, f_UV", "a measurement with a lamp and an edge filter"},
    Index{"f_ir", "response to infrared, f_IR", "a measurement with a lamp and an edge filter"},
    Index{"f2", "directional response, f2",
          "a goniometer: no calibration of this program turns the camera"},
    Index{"f5", "fatigue, f5", "hours under constant light"},
    Index{"f6", "temperature, f6", "a climate chamber"},
    Index{"f7", "modulated light, f7", "light of known modulation"},
    Index{"f8", "polarisation, f8", "a polariser that is turned"},
};

std::optional<double> LargestDeviation(const std::filesystem::path& file) {
  const Json calibration = core::ReadJson(file);
  if (!calibration.is_object() ||
      calibration.value("format", std::string()) != "luxfield sensor calibration" ||
      !calibration.contains("channels") || !calibration["channels"].is_array())
    throw InputError(file.string(), "is no calibration of a sensor",
                     "name the file that `luxfield calibrate sensor` wrote");
  std::optional<double> largest;
  for (const Json& channel : calibration["channels"]) {
    const Json::json_pointer place("/linearity/largest_deviation");
    if (!channel.is_object() || !channel.contains(place) || !channel[place].is_number()) continue;
    largest = std::max(largest.value_or(0), std::abs(channel[place].get<double>()));
  }
  if (!largest)
    throw InputError(file.string(), "holds no channels[].linearity.largest_deviation",
                     "calibrate the sensor with flats of several exposure times");
  return largest;
}

void AddMismatch(QualityReport* report, const photometry::QualityAsked& asked) {
  if (asked.responsivity.empty()) return;
  const auto responsivity = photometry::ReadSpectrum(asked.responsivity);
  const auto seen = [](const std::filesystem::path& file, auto&& of) {
    try {
      return of();
    } catch (const std::invalid_argument&) {
      throw InputError(file.string(), "has no light that camera and eye see",
                       "check its wavelengths, in nm, and values");
    }
  };
  report->mismatch_index =
      seen(asked.responsivity, [&] { return SpectralMismatchIndex(responsivity); });
  if (asked.lamp_spectrum.empty()) return;
  const auto lamp = photometry::ReadSpectrum(asked.lamp_spectrum);
  const auto calibration = asked.calibration_spectrum.empty()
                               ? photometry::IlluminantA()
                               : photometry::ReadSpectrum(asked.calibration_spectrum);
  report->mismatch_factor = seen(
      asked.lamp_spectrum, [&] { return SpectralMismatchFactor(responsivity, lamp, calibration); });
}

}  // namespace

std::optional<double> QualityReport::mismatch_u() const {
  if (!mismatch_factor) return {};
  return std::abs(*mismatch_factor - 1) / std::sqrt(3.0);
}

QualityReport QualityOf(const photometry::Lamp& lamp, const photometry::QualityAsked& asked) {
  QualityReport report;
  report.unit = lamp.unit;
  report.beyond_planes_flux = photometry::FluxBeyondPlanesBound(lamp);
  AddMismatch(&report, asked);
  if (!asked.sensor_calibration.empty())
    report.linearity_index = LargestDeviation(asked.sensor_calibration);
  return report;
}

Json QualityJson(const QualityReport& report) {
  Json json = {{"beyond_planes_bound_" + NamesOf(report.unit).flux_key, report.beyond_planes_flux},
               {"spectral_mismatch_factor", OptionalJson(report.mismatch_factor)},
               {"spectral_mismatch_u_relative", OptionalJson(report.mismatch_u())},
               {"f1", OptionalJson(report.mismatch_index)},
               {"f3", OptionalJson(report.linearity_index)},
               {"not_known", Json::object()}};
  const auto unknown = [&](const Index& index) { json["not_known"][index.key] = index.takes; };
  if (!report.mismatch_index) unknown(kSpectral);
  if (!report.linearity_index) unknown(kLinearity);
  for (const Index& index : kUnknown) unknown(index);
  return json;
}

std::vector<NumberRow> QualityRows(const QualityReport& report) {
  std::vector<NumberRow> rows;
  rows.push_back({"flux beyond the planes, at most",
                  "",
                  NamesOf(report.unit).flux_unit,
                  {report.beyond_planes_flux, {}}});
  if (report.mismatch_factor)
    rows.push_back({"spectral mismatch factor", "", "1", {*report.mismatch_factor, {}}});
  if (report.mismatch_index)
    rows.push_back({kSpectral.name, "", "1", {*report.mismatch_index, {}}});
  if (report.linearity_index)
    rows.push_back({kLinearity.name, "", "1", {*report.linearity_index, {}}});
  return rows;
}

std::vector<std::vector<std::string>> QualityTable(const QualityReport& report) {
  std::vector<std::vector<std::string>> rows{{"quality", "value", "unit"}};
  for (const NumberRow& row : QualityRows(report))
    rows.push_back({row.quantity, fmt::format("{:.4g}", row.value.value), row.unit});
  return rows;
}

std::string QualityRemark(const QualityReport& report) {
  std::string text =
      "The bound on light beyond the planes holds while no direction beyond what was seen is "
      "brighter than the brightest at its border; light that passes the filter by is not bounded. "
      "Not known:";
  const auto add = [&](const Index& index) {
    text +=
        fmt::format("{} {} (takes {})", text.ends_with(':') ? "" : ";", index.name, index.takes);
  };
  if (!report.mismatch_index) add(kSpectral);
  if (!report.linearity_index) add(kLinearity);
  for (const Index& index : kUnknown) add(index);
  return text + ".";
}

}  // namespace luxfield::cli
