// luxfield export X.lf.exr --to radiance, blender, mitsuba: the lamp as a light of another renderer.
#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "luxfield/bridges/gltf_lamp.h"
#include "luxfield/bridges/lamp_atlas.h"
#include "luxfield/bridges/pbrt_lamp.h"
#include "luxfield/bridges/radiance_source.h"
#include "luxfield/bridges/usd_lamp.h"
#include "luxfield/cli/verbs/conformance_sheet.h"
#include "luxfield/cli/verbs/verb_export.h"
#include "luxfield/core/error.h"

namespace luxfield::cli {
namespace {

core::Json FileNames(const std::vector<std::filesystem::path>& files) {
  core::Json names = core::Json::array();
  for (const auto& file : files) names.push_back(file.string());
  return names;
}

void PrintOthers(const std::vector<std::filesystem::path>& files) {
  for (std::size_t k = 1; k < files.size(); ++k) fmt::print(" {}", files[k].filename().string());
  fmt::print("\n");
}

void PrintNegative(double share, const char* program) {
  if (share > 0)
    fmt::print(
        "  negative     {:.3g} % of the flux, at most, is negative light, which {} leaves out\n",
        100 * share, program);
}

core::Json ToRadiance(const ExportOptions& options, const ExportFormat& format,
                      const Fields& fields) {
  const auto written = bridges::WriteRadianceSource(options.output, fields, options.field);
  fmt::print("{}: a light source of {} polygons for Radiance, and beside it", options.output,
             written.polygons);
  PrintOthers(written.files);
  fmt::print("  unit         {}\n", UnitOf(fields) == "lm"
                                        ? "luminance in cd/m^2 over 179, as Radiance counts it"
                                        : "radiance as the light field has it");
  PrintNegative(written.negative_share, "Radiance");
  return {{"format", format.name},
          {"files", FileNames(written.files)},
          {"polygons", written.polygons},
          {"negative_share", written.negative_share}};
}

core::Json ToMitsuba(const ExportOptions& options, const ExportFormat& format,
                     const Fields& fields) {
  const auto files = bridges::WriteMitsubaLamp(options.output, fields, options.field);
  fmt::print("{}: {} for Mitsuba 3 to include, and beside it", options.output,
             fields.size() == 1 ? "an emitter" : "emitters");
  PrintOthers(files);
  fmt::print("  emitter      import luxfield_mitsuba before loading it (docs/bridges.md)\n");
  return {{"format", format.name}, {"files", FileNames(files)}};
}

core::Json ToBlender(const ExportOptions& options, const ExportFormat& format,
                     const Fields& fields) {
  const auto files = bridges::WriteLampAtlas(options.output, fields, options.field);
  fmt::print("{}: a lamp for Blender's Cycles, and beside it", options.output);
  PrintOthers(files);
  fmt::print(
      "  add-on       File > Import > Luxfield lamp, of luxfield_lamp.py (docs/bridges.md)\n");
  return {{"format", format.name}, {"files", FileNames(files)}};
}

core::Json ToGltf(const ExportOptions& options, const ExportFormat& format, const Fields& fields) {
  const lightfield::LightField& field = OnlyField(options, fields, "a glTF light");
  web::FitOptions fit;
  fit.seed = options.seed;
  const auto written = bridges::WriteGltfLamp(options.output, field, options.field, fit);
  fmt::print("{}: a glTF file of {}: LUXFIELD_light_field, EXT_lights_ies, KHR_lights_punctual\n",
             options.output, FormatBytes(double(written.bytes)));
  const core::Json zones = ReportZones(written.fitted);
  core::Json json{{"format", format.name},
                  {"files", {options.output}},
                  {"bytes", written.bytes},
                  {"stated_error", written.fitted.stated_error()},
                  {"zones", zones}};
  if (options.check)
    json["check"] = ReportChecks(options, format,
                                 {CheckVolume(bridges::ReadGltfLamp(options.output), field, fit)});
  return json;
}

core::Json ReportDeviations(const std::vector<bridges::FarDeviation>& deviations) {
  core::Json rows = core::Json::array();
  for (const bridges::FarDeviation& d : deviations) {
    fmt::print("  at {:>5g} m    {:.2g} % of the brightest off, at most\n", d.distance_m,
               100 * d.largest);
    rows.push_back({{"distance_m", d.distance_m}, {"largest", d.largest}});
  }
  return rows;
}

core::Json ToUsd(const ExportOptions& options, const ExportFormat& format, const Fields& fields) {
  const auto written = bridges::WriteUsdLamp(
      options.output, OnlyField(options, fields, "a rectangle of UsdLux"), options.field);
  fmt::print("{}: a rectangle with an intensity profile for OpenUSD, and beside it",
             options.output);
  PrintOthers(written.files);
  return {{"format", format.name},
          {"files", FileNames(written.files)},
          {"deviations", ReportDeviations(written.deviations)}};
}

core::Json ToPbrt(const ExportOptions& options, const ExportFormat& format, const Fields& fields) {
  const auto written = bridges::WritePbrtLamp(options.output, fields, options.field);
  fmt::print("{}: {} projectors for pbrt-v4, their pictures in {}/\n", options.output,
             written.projectors, written.files.back().parent_path().filename().string());
  PrintNegative(written.negative_share, "pbrt");
  core::Json near = ReportDeviations(written.near);
  fmt::print("{}: the far field as a goniometric light, and beside it {}\n",
             written.files[1].string(), written.files[2].filename().string());
  return {{"format", format.name},
          {"files", FileNames(written.files)},
          {"projectors", written.projectors},
          {"negative_share", written.negative_share},
          {"deviations", std::move(near)},
          {"far_deviations", ReportDeviations(written.far)}};
}

}  // namespace

core::Json ExportBridge(const ExportOptions& options, const ExportFormat& format,
                        const Fields& fields) {
  if (format.name == "gltf") return ToGltf(options, format, fields);
  std::optional<ForeignJudge> judge;
  if (options.check) {
    OnlyField(options, fields, "a conformance sheet");
    if (UnitOf(fields) != "lm")
      throw InputError(options.field, "is in " + UnitOf(fields) + ", and --check compares lx",
                       "drop --check");
    judge = FindJudge(format.name);
  }
  core::Json json = format.name == "mitsuba"   ? ToMitsuba(options, format, fields)
                    : format.name == "pbrt"    ? ToPbrt(options, format, fields)
                    : format.name == "usd"     ? ToUsd(options, format, fields)
                    : format.name == "blender" ? ToBlender(options, format, fields)
                                               : ToRadiance(options, format, fields);
  if (judge)
    json["check"] = WriteConformanceSheet(*judge, options.field, options.output, options.seed,
                                          json.value("negative_share", 0.0));
  return json;
}

}  // namespace luxfield::cli
