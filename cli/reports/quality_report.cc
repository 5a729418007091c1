#include "luxfield/cli/reports/quality_report.h"

#include <fmt/format.h>

#include <algorithm>
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

// An index of ISO/CIE 19476 or CIE 244 with the reason why it has no number.
struct Index {
  const char *key, *name, *reason;
};
constexpr Index kSpectral = {"f1", "spectral mismatch, f1'", "takes quality.responsivity"};
constexpr Index kLinearity = {"f3", "linearity, f3", "takes quality.sensor_calibration"};
constexpr Index kRepeatability = {"repeatability", "repeatability from frame to frame",
                                  "takes quality.sensor_calibration"};
constexpr Index kNonuniformity = {"prnu", "non-uniformity from pixel to pixel",
                                  "takes quality.sensor_calibration"};
constexpr std::array kUnknown = {
    Index{"f_uv", "response to ultraviolet, f_UV", "takes a lamp and an edge filter"},
    Index{"f_ir", "response to infrared, f_IR", "takes a lamp and an edge filter"},
    Index{"f2", "directional response, f2",
          "takes a goniometer: no calibration of this program turns the camera"},
    Index{"f2_u", "surrounding field, f2,u",
          "takes a dark field in a bright ring: `calibrate glare` measures what is subtracted "
          "instead"},
    Index{"f4", "display unit, f4", "does not apply: codes are recorded, nothing is displayed"},
    Index{"f5", "fatigue, f5", "takes hours under constant light"},
    Index{"f6_t", "temperature, f6,T", "takes a climate chamber"},
    Index{"f6_h", "humidity, f6,H", "takes a climate chamber"},
    Index{"f7", "modulated light, f7", "takes light of known modulation"},
    Index{"f8", "polarisation, f8", "takes a polariser that is turned"},
    Index{"f9", "spatial non-uniformity, f9",
          "does not apply: each pixel is a field of its own, and the flat field divides"},
    Index{"f11", "range change, f11",
          "does not apply: ranges are exposure times, which f3 goes through"},
    Index{"f12", "focusing distance, f12", "does not apply: the focus of a bench is fixed"},
    Index{"uniformity", "uniformity after correction",
          "takes a second flat field, of another source, against the first"},
    Index{"size_of_source", "size of source", "takes a series of apertures before one source"},
    Index{"edge", "edge function", "takes a straight edge before a bright field"},
    Index{"smear", "smear", "takes a small source that saturates the sensor"},
    Index{"stability", "long-term stability", "takes calibrations over years"},
};

// The largest |channels[].`place`|, absent where no channel has a number there.
std::optional<double> LargestOf(const Json& calibration, const char* place) {
  const Json::json_pointer pointer(place);
  std::optional<double> largest;
  for (const Json& channel : calibration["channels"]) {
    if (!channel.is_object() || !channel.contains(pointer) || !channel[pointer].is_number())
      continue;
    largest = std::max(largest.value_or(0), std::abs(channel[pointer].get<double>()));
  }
  return largest;
}

void AddSensor(QualityReport* report, const std::filesystem::path& file) {
  if (file.empty()) return;
  const Json calibration = core::ReadJson(file);
  if (!calibration.is_object() ||
      calibration.value("format", std::string()) != "luxfield sensor calibration" ||
      !calibration.contains("channels") || !calibration["channels"].is_array())
    throw InputError(file.string(), "is no calibration of a sensor",
                     "name the file that `luxfield calibrate sensor` wrote");
  report->linearity_index = LargestOf(calibration, "/linearity/largest_deviation");
  report->repeatability = LargestOf(calibration, "/linearity/repeatability");
  report->nonuniformity = LargestOf(calibration, "/prnu");
  if (!report->linearity_index)
    throw InputError(file.string(), "holds no channels[].linearity.largest_deviation",
                     "calibrate the sensor with flats of several exposure times");
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

std::vector<Index> UnknownOf(const QualityReport& report) {
  std::vector<Index> unknown;
  if (!report.mismatch_index) unknown.push_back(kSpectral);
  if (!report.linearity_index) unknown.push_back(kLinearity);
  if (!report.repeatability) unknown.push_back(kRepeatability);
  if (!report.nonuniformity) unknown.push_back(kNonuniformity);
  unknown.insert(unknown.end(), kUnknown.begin(), kUnknown.end());
  return unknown;
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
  AddSensor(&report, asked.sensor_calibration);
  return report;
}

Json QualityJson(const QualityReport& report) {
  Json json = {{"beyond_planes_bound_" + NamesOf(report.unit).flux_key, report.beyond_planes_flux},
               {"spectral_mismatch_factor", OptionalJson(report.mismatch_factor)},
               {"spectral_mismatch_u_relative", OptionalJson(report.mismatch_u())},
               {"f1", OptionalJson(report.mismatch_index)},
               {"f3", OptionalJson(report.linearity_index)},
               {"repeatability", OptionalJson(report.repeatability)},
               {"prnu", OptionalJson(report.nonuniformity)},
               {"not_known", Json::object()}};
  for (const Index& index : UnknownOf(report)) json["not_known"][index.key] = index.reason;
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
  const auto add = [&](const Index& index, const std::optional<double>& value) {
    if (value) rows.push_back({index.name, "", "1", {*value, {}}});
  };
  add(kSpectral, report.mismatch_index);
  add(kLinearity, report.linearity_index);
  add(kRepeatability, report.repeatability);
  add(kNonuniformity, report.nonuniformity);
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
      "Indices of ISO/CIE 19476 and CIE 244 without a number:";
  for (const Index& index : UnknownOf(report))
    text += fmt::format("{} {} ({})", text.ends_with(':') ? "" : ";", index.name, index.reason);
  return text + ".";
}

}  // namespace luxfield::cli
