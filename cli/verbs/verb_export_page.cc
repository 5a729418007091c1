// luxfield export X.lf.exr -o lamp.html
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "luxfield/cli/verbs/verb_export.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/web/lamp_page.h"

namespace luxfield::cli {

const lightfield::LightField& OnlyField(const ExportOptions& options, const Fields& fields,
                                        const char* what) {
  if (fields.size() != 1 || fields.front().luminaire_from_field != lightfield::RigidPose{})
    throw InputError(
        options.field, fmt::format("holds {} light fields with frames of their own", fields.size()),
        fmt::format("{} holds one pair of planes; import the lamp again with one face", what));
  return fields.front().field;
}

formats::ExportCheck CheckVolume(const web::FittedVolume& read, const lightfield::LightField& field,
                                 const web::FitOptions& fit) {
  formats::ExportCheck check{"exact light field from 2 cm to 20 m, as docs/web.md counts it"};
  check.stated_error = read.stated_error();
  for (web::ErrorZone zone : read.zones) {
    if (zone.on_image_plane) continue;
    web::MeasureZone(field, read.volume, fit.receivers, 2 * fit.seed + 1, zone);
    check.receivers += zone.receivers;
    check.max_rel_error = std::max(check.max_rel_error, zone.stated_error / web::kStatedMargin);
  }
  return check;
}

core::Json ReportZones(const web::FittedVolume& fitted) {
  fmt::print("  {:<28} {:>13} {:>14}\n", "height above F", "stated error", "relative RMSE");
  core::Json zones = core::Json::array();
  for (const web::ErrorZone& zone : fitted.zones) {
    fmt::print("  {:<28} {:>13} {:>14}\n",
               fmt::format("{:.4g} to {:.4g} m{}", zone.z_first_m, zone.z_last_m,
                           zone.on_image_plane ? " (about I)" : ""),
               web::PercentText(zone.stated_error), web::PercentText(zone.rel_rmse));
    zones.push_back({{"z_first_m", zone.z_first_m},
                     {"z_last_m", zone.z_last_m},
                     {"about_image_plane", zone.on_image_plane},
                     {"stated_error", zone.stated_error},
                     {"rel_rmse", zone.rel_rmse},
                     {"receivers", zone.receivers}});
  }
  return zones;
}

core::Json ExportPage(const ExportOptions& options, const ExportFormat& format,
                      const Fields& fields) {
  const lightfield::LightField& field = OnlyField(options, fields, "a page");
  const std::filesystem::path file = options.field;
  web::FitOptions fit;
  fit.seed = options.seed;
  const web::PageResult result = web::WriteLampPage(
      options.output, field,
      {file.stem().stem().string(), file.filename().string(), core::Sha256OfFile(file)}, fit);
  fmt::print("{}: a page of {}\n", options.output, FormatBytes(double(result.bytes)));
  const core::Json zones = ReportZones(result.fitted);
  core::Json json{{"format", format.name},
                  {"bytes", result.bytes},
                  {"stated_error", result.fitted.stated_error()},
                  {"zones", zones}};
  if (options.check)
    json["check"] =
        ReportChecks(options, format, {CheckVolume(web::ReadLampPage(options.output), field, fit)});
  return json;
}

}  // namespace luxfield::cli
