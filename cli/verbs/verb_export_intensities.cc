// luxfield export X.lf.exr -o X.ies, X.ldt, X.tm33.xml, X.gldf: intensities.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "luxfield/cli/verbs/verb_export.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/gldf.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/tm33.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

using formats::FarFieldUncertainty;
using formats::Photometry;

constexpr double kCoverage = 2;  // k of the uncertainties that are stated

std::string Name(const std::string& path) {
  const std::string name = std::filesystem::path(path).filename().string();
  return name.substr(0, name.size() - (name.ends_with(".lf.exr") ? 7 : 0));
}

// What the verb knows beside the table.
void AddKeywords(Photometry& table, const ExportOptions& options, const std::string& unit,
                 const std::optional<FarFieldUncertainty>& sigma, bool as_eulumdat) {
  auto& keywords = table.keywords;
  keywords.insert(
      keywords.begin(),
      {{"LUMINAIRE", Name(options.field)},
       {"LUMCAT", options.distance_m ? fmt::format("intensity at {:.6g} m", *options.distance_m)
                                     : std::string("far field")},
       {"TESTLAB", "luxfield " LUXFIELD_VERSION}});
  if (!sigma) return;
  const std::string flux = fmt::format("{:.3g} {}", kCoverage * sigma->flux, unit);
  const std::string peak =
      fmt::format("{:.3g} {}", kCoverage * sigma->peak, unit == "lm" ? "cd" : unit + "/sr");
  if (as_eulumdat) {  // whose field for date and user is free text
    keywords.emplace_back("ISSUEDATE",
                          fmt::format("U(flux) = {}, U(peak) = {}, k = 2 (noise)", flux, peak));
    return;
  }
  keywords.emplace_back("_UNCERTAINTY_FLUX", flux + " (k = 2, noise of the measurement)");
  keywords.emplace_back("_UNCERTAINTY_PEAK", peak + " (k = 2, noise of the measurement)");
}

std::string FileText(const formats::FarField& found, const ExportFormat& format,
                     const std::string& name) {
  const Photometry& table = found.table;
  if (format.name == "gldf")
    return formats::FormatGldf(table, found.opening_middle_m, "luxfield " LUXFIELD_VERSION, name);
  if (format.name == "tm-33-23") return formats::FormatTm33(table, name);
  if (format.name == "eulumdat") return formats::FormatEulumdat(table, name);
  return formats::FormatLm63(
      table,
      format.name == "lm-63-2019" ? formats::Lm63Version::k2019 : formats::Lm63Version::k2002,
      name);
}

void Print(const ExportOptions& options, const ExportFormat& format, const std::string& unit,
           const formats::FarField& found, double of_field, const core::Json& json) {
  const Photometry& table = found.table;
  const formats::Peak peak = formats::FindPeak(table);
  fmt::print("{}: {}, {} planes of {} angles{}\n", options.output, format.name,
             table.planes_deg.size(), table.angles_deg.size(),
             options.distance_m ? fmt::format(", intensity at {:.5g} m", *options.distance_m)
                                : std::string(", far field"));
  fmt::print("  flux         {:.6g} {} of the table, {:.6g} {} of the light field ({:+.4f} %)\n",
             formats::Flux(table), unit, of_field, unit, 100 * found.flux_error);
  fmt::print("  peak         {:.6g} {}/sr at C {:g}, gamma {:g}\n", peak.intensity_cd, unit,
             peak.plane_deg, peak.angle_deg);
  if (json.contains("uncertainty"))
    fmt::print("  uncertainty  flux {:.3g} {}, peak {:.3g} {}/sr (k = 2, noise)\n",
               json["uncertainty"]["flux"].get<double>(), unit,
               json["uncertainty"]["peak"].get<double>(), unit);
  fmt::print("  opening      {}\n  symmetry     {}\n", formats::Describe(table.opening),
             formats::Describe(formats::FindSymmetry(table)));
  fmt::print("  between      interpolation is up to {:.2g} % of the peak off\n",
             100 * found.interpolation_error());
}

}  // namespace

core::Json ExportIntensities(const ExportOptions& options, const ExportFormat& format,
                             const Fields& fields) {
  const Fields luminance = formats::LuminanceOf(fields);
  formats::FarField found =
      formats::SampleFarField(luminance, {options.plane_step_deg, options.angle_step_deg},
                              options.distance_m, options.field);
  Photometry& table = found.table;
  const std::string unit = UnitOf(fields);
  if (format.name == "tm-33-23") {
    if (unit == "W")
      throw InputError(options.field,
                       "is in W, and TM-33 asks for the wavelengths of radiant light",
                       "export .ies");
    table.absolute = unit == "lm";
  }
  std::optional<FarFieldUncertainty> sigma;
  if (!options.sigma.empty())
    sigma = formats::PropagateSigma(fields, lightfield::ReadLightFields(options.sigma), table,
                                    options.distance_m, options.sigma);
  AddKeywords(table, options, unit, sigma, format.name == "eulumdat" || format.name == "gldf");
  core::WriteFileAtomically(options.output, FileText(found, format, options.output));

  const double of_field = core::Luminance(lightfield::TotalFlux(fields));
  const formats::Peak peak = formats::FindPeak(table);
  core::Json json = {{"format", format.name},
                     {"planes", table.planes_deg.size()},
                     {"angles", table.angles_deg.size()},
                     {"unit", unit},
                     {"flux", formats::Flux(table)},
                     {"light_field_flux", of_field},
                     {"peak",
                      {{"intensity", peak.intensity_cd},
                       {"plane_deg", peak.plane_deg},
                       {"angle_deg", peak.angle_deg}}},
                     {"symmetry", formats::Describe(formats::FindSymmetry(table))},
                     {"interpolation_error", found.interpolation_error()}};
  if (options.distance_m) json["distance_m"] = *options.distance_m;
  if (sigma)
    json["uncertainty"] = {
        {"k", kCoverage}, {"flux", kCoverage * sigma->flux}, {"peak", kCoverage * sigma->peak}};
  Print(options, format, unit, found, of_field, json);
  if (options.check) {
    const auto written = core::ReadableAt(options.output);
    json["check"] = ReportChecks(
        options, format,
        {formats::CheckIntensities(written, found, luminance, options.distance_m),
         formats::CheckInterpolation(written, found, luminance, options.distance_m, options.seed)});
  }
  return json;
}

}  // namespace luxfield::cli
