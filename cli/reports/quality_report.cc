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

// Why an index has no number: a file was not given, no calibration of this program has the set-up, or
// it does not apply to what the program measures with.
enum class Lack { kFile, kSetUp, kNothing };

// An index of ISO/CIE 19476 or CIE 244; docs/photometry.md says where names come from.
struct Index {
  const char *key, *name;
  Lack lack;
  const char* reason;
};
constexpr Index kSpectral = {"f1", "spectral mismatch, f1'", Lack::kFile,
                             "takes quality.responsivity"};
constexpr Index kLinearity = {"f3", "linearity, f3", Lack::kFile,
                              "takes quality.sensor_calibration"};
constexpr Index kRepeatability = {"repeatability", "repeatability from frame to frame", Lack::kFile,
                                  "takes quality.sensor_calibration"};
constexpr Index kNonuniformity = {"prnu", "non-uniformity from pixel to pixel", Lack::kFile,
                                  "takes quality.sensor_calibration"};
constexpr std::array kUnknown = {
    Index{"ultraviolet", "response to ultraviolet", Lack::kSetUp,
          "takes a lamp and an edge filter"},
    Index{"infrared", "response to infrared", Lack::kSetUp, "takes a lamp and an edge filter"},
    Index{"f2", "directional response, f2", Lack::kSetUp,
          "takes a goniometer: no calibration of this program turns the camera"},
    Index{"surrounding_field", "surrounding field", Lack::kSetUp,
          "takes a dark field in a bright ring: `calibrate glare` measures what is subtracted "
          "instead"},
    Index{"f5", "fatigue, f5", Lack::kSetUp, "takes hours under constant light"},
    Index{"temperature", "temperature", Lack::kSetUp, "takes a climate chamber"},
    Index{"humidity", "humidity", Lack::kSetUp, "takes a climate chamber"},
    Index{"f7", "modulated light, f7", Lack::kSetUp, "takes light of known modulation"},
    Index{"polarisation", "polarisation", Lack::kSetUp, "takes a polariser that is turned"},
    Index{"uniformity", "uniformity after correction", Lack::kSetUp,
          "takes a second flat field, of another source, against the first"},
    Index{"size_of_source", "size of source", Lack::kSetUp,
          "takes a series of apertures before one source"},
    Index{"edge", "edge function", Lack::kSetUp, "takes a straight edge before a bright field"},
    Index{"smear", "smear", Lack::kSetUp, "takes a small source that saturates the sensor"},
    Index{"stability", "long-term stability", Lack::kSetUp, "takes calibrations over years"},
    Index{"f4", "display unit, f4", Lack::kNothing, "codes are recorded, nothing is displayed"},
    Index{"spatial_response", "spatial response of the receiver", Lack::kNothing,
          "each pixel is a field of its own, and the flat field divides"},
    Index{"range_change", "range change", Lack::kNothing,
          "ranges are exposure times, which f3 goes through"},
    Index{"focusing_distance", "focusing distance", Lack::kNothing,
          "the focus of a bench is fixed"},
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
  for (const Index& index : UnknownOf(report))
    json["not_known"][index.key] =
        (index.lack == Lack::kNothing ? "does not apply: " : "") + std::string(index.reason);
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

std::vector<std::string> QualityRemarks(const QualityReport& report) {
  const std::vector<Index> unknown = UnknownOf(report);
  // "name (reason); name (reason)", reasons where they say more than the sentence does.
  const auto named = [&](Lack lack) {
    std::string text;
    for (const Index& index : unknown)
      if (index.lack == lack)
        text += (text.empty() ? "" : "; ") + std::string(index.name) +
                (lack == Lack::kSetUp ? "" : fmt::format(" ({})", index.reason));
    return text;
  };
  std::vector<std::string> remarks{
      "The bound on light beyond the planes holds while no direction beyond what was seen is "
      "brighter than the brightest at its border; light that passes the filter by is not bounded."};
  if (const std::string text = named(Lack::kFile); !text.empty())
    remarks.push_back("Without a number, since ask.toml names no file for them: " + text + ".");
  remarks.push_back(
      "Indices of ISO/CIE 19476 and CIE 244 that no calibration of this program has the set-up "
      "for: " +
      named(Lack::kSetUp) + ". Indices that do not apply: " + named(Lack::kNothing) + ".");
  return remarks;
}

}  // namespace luxfield::cli
