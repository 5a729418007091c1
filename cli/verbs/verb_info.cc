// luxfield info FILE: what a file is and whether it is whole.
#include "luxfield/cli/info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "luxfield/cli/info_environment.h"
#include "luxfield/cli/info_photometry.h"
#include "luxfield/cli/verbs/info_geometry.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file_kind.h"
#include "luxfield/environment/environment_layouts.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/environment_sequence.h"
#include "luxfield/formats/ray_formats.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measured_filter.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/preprocess/table_io.h"
#include "luxfield/session/session_store.h"

namespace luxfield::cli {
namespace {

using core::Json;

void PrintProvenance(const lightfield::Provenance& provenance) {
  for (const auto& [key, value] : provenance) fmt::print("  made by      {} = {}\n", key, value);
}

// A file of several fields: each with the direction of its axis in the luminaire's frame.
Json InfoLightFields(const std::string& path,
                     const std::vector<lightfield::PosedLightField>& fields) {
  const auto unit = lightfield::FluxUnitName(fields.front().field.geometry.unit);
  const auto flux_of = [](const lightfield::LightField& field) {
    const auto flux = lightfield::TotalFlux(field);
    return field.geometry.channels == 3 ? core::Luminance({flux[0], flux[1], flux[2]}) : flux[0];
  };
  double flux = 0;
  Json list = Json::array();
  fmt::print("{}: light fields in {} directions\n", path, fields.size());
  for (const auto& [name, pose, field] : fields) {
    const auto axis = pose.Direction({0, 0, 1});
    const auto& origin = pose.translation_m;
    const auto [low, high] = std::minmax_element(field.data.begin(), field.data.end());
    flux += flux_of(field);
    fmt::print(
        "  {:<12} towards ({:.4g}, {:.4g}, {:.4g}), F's origin at ({:.5g}, {:.5g}, {:.5g}) mm\n",
        name, axis.x, axis.y, axis.z, 1e3 * origin.x, 1e3 * origin.y, 1e3 * origin.z);
    PrintGeometry(field.geometry);
    fmt::print("  C            {:.6g} to {:.6g} {} sr^-1 m^-4\n", *low, *high, unit);
    fmt::print("  flux         {:.6g} {}\n", flux_of(field), unit);
    Json json = GeometryJson(field.geometry);
    json["name"] = name;
    json["axis"] = {axis.x, axis.y, axis.z};
    json["origin_m"] = {origin.x, origin.y, origin.z};
    json["flux"] = lightfield::TotalFlux(field);
    json["luminance_flux"] = flux_of(field);
    json["c_min"] = *low;
    json["c_max"] = *high;
    list.push_back(std::move(json));
  }
  fmt::print("  total flux   {:.6g} {}\n", flux, unit);
  PrintProvenance(fields.front().field.provenance);
  return {{"kind", "light fields"},
          {"fields", std::move(list)},
          {"flux", lightfield::TotalFlux(fields)},
          {"luminance_flux", flux},
          {"unit", unit},
          {"provenance", fields.front().field.provenance}};
}

Json InfoLightField(const std::string& path) {
  const auto fields = lightfield::ReadLightFields(path);
  if (fields.size() > 1 || !fields.front().name.empty()) return InfoLightFields(path, fields);
  const lightfield::LightField& field = fields.front().field;
  const auto unit = lightfield::FluxUnitName(field.geometry.unit);
  const auto [low, high] = std::minmax_element(field.data.begin(), field.data.end());
  const auto flux = lightfield::TotalFlux(field);
  const auto axis = lightfield::FarFieldIntensity(field, {0, 0, 1});
  fmt::print("{}: light field\n", path);
  PrintGeometry(field.geometry);
  fmt::print("  C            {:.6g} to {:.6g} {} sr^-1 m^-4\n", *low, *high, unit);
  fmt::print(
      "  flux         {:.6g} {}{}, intensity on axis {:.6g} {}/sr\n", core::Luminance(flux), unit,
      field.geometry.channels == 3
          ? fmt::format(" (luminance of R G B {:.6g} {:.6g} {:.6g})", flux[0], flux[1], flux[2])
          : std::string(),
      core::Luminance(axis), unit);
  PrintProvenance(field.provenance);
  Json json = GeometryJson(field.geometry);
  json["kind"] = "light field";
  json["flux"] = flux;  // of each channel
  json["luminance_flux"] = core::Luminance(flux);
  json["luminance_intensity_on_axis"] = core::Luminance(axis);
  json["c_min"] = *low;
  json["c_max"] = *high;
  json["provenance"] = field.provenance;
  return json;
}

Json InfoMeasurements(const std::string& path) {
  const lightfield::Measurements measurements = lightfield::ReadMeasurements(path);
  std::size_t unknown = 0, dark = 0, total = 0;
  std::vector<float> relative;
  for (const auto& position : measurements.positions) {
    for (const auto mask : position.mask) {
      unknown += (mask & lightfield::kUnknownMask) != 0;
      dark += (mask & lightfield::kTooDark) != 0;
    }
    total += position.mask.size();
    for (std::size_t k = 0; k < position.irradiance.size(); k += 97)
      if (position.irradiance[k] > 0)
        relative.push_back(position.sigma[k] / position.irradiance[k]);
  }
  double median = 0;
  if (!relative.empty()) {
    std::nth_element(relative.begin(), relative.begin() + std::ptrdiff_t(relative.size() / 2),
                     relative.end());
    median = relative[relative.size() / 2];
  }
  fmt::print("{}: measurements, irradiance on I behind {} filters\n", path,
             measurements.positions.size());
  PrintGeometry(measurements.geometry);
  fmt::print(
      "  values       {:.3f} % unknown, {:.3f} % near the noise floor, median sigma/E {:.3g} %\n",
      100.0 * double(unknown) / double(total), 100.0 * double(dark) / double(total), 100 * median);
  PrintProvenance(measurements.provenance);
  Json json = GeometryJson(measurements.geometry);
  json["kind"] = "measurements";
  json["unknown_share"] = double(unknown) / double(total);
  json["median_relative_sigma"] = median;
  json["provenance"] = measurements.provenance;
  return json;
}

Json InfoSession(const std::string& path) {
  const session::SessionReader session(path);
  std::size_t flagged = 0;
  std::map<session::FrameKind, std::size_t> counts;
  double longest = 0, shortest = INFINITY;
  for (const auto& frame : session.frames()) {
    ++counts[frame.kind];
    flagged += frame.flagged;
    longest = std::max(longest, frame.exposure_s);
    shortest = std::min(shortest, frame.exposure_s);
  }
  fmt::print("{}: capture session, {}\n", path,
             session.sealed() ? "sealed" : "not sealed (paused or interrupted: resume it)");
  using enum session::FrameKind;
  fmt::print(
      "  frames       {} at filter positions, {} dark, {} flat, {} reference, {} of targets; {} "
      "flagged\n",
      counts[kPosition], counts[kDark], counts[kFlat], counts[kReference], counts[kTarget],
      flagged);
  if (!session.frames().empty())
    fmt::print("  exposures    {:.6g} to {:.6g} s\n", shortest, longest);
  fmt::print("  plan         {}\n", session.plan_id());
  return {{"kind", "session"},
          {"sealed", session.sealed()},
          {"frames", session.frames().size()},
          {"flagged", flagged},
          {"plan_id", session.plan_id()}};
}

Json InfoRays(const std::string& path) {
  const formats::RaySummary summary = formats::SummariseRays(path);
  const formats::RayFileHeader& header = summary.header;
  const std::string format = formats::RayFormatName(summary.format);
  const auto flux = [](const std::optional<double>& value, const char* unit) {
    return value ? fmt::format("{:.6g} {}", *value, unit) : std::string("unknown");
  };
  const bool tm25 = summary.format == formats::RayFormat::kTm25;
  fmt::print("{}: {} ray file{}\n", path, format,
             tm25 ? fmt::format(", version {}", header.version) : std::string());
  fmt::print("  rays         {}\n  flux         {}, {}\n", header.ray_count,
             flux(header.luminous_flux_lm, "lm"), flux(header.radiant_flux_w, "W"));
  if (tm25) fmt::print("  date         {}\n", header.date_time);
  for (const auto& text : header.texts)
    if (!text.empty()) fmt::print("  text         {}\n", text);
  Json json = {{"kind", "rays"}, {"format", format}, {"rays", header.ray_count}};
  if (tm25) json["version"] = header.version;
  if (header.luminous_flux_lm) json["luminous_flux_lm"] = *header.luminous_flux_lm;
  if (header.radiant_flux_w) json["radiant_flux_w"] = *header.radiant_flux_w;
  return json;
}

Json InfoFilter(const std::string& path) {
  const lightfield::MeasuredFilter filter = lightfield::ReadMeasuredFilter(path);
  const auto& lattice = filter.lattice;
  fmt::print("{}: measured filter, {} of {}, spacing {:.6g} mm, scale {:.6g}\n", path,
             filter.prints.size() == 2 ? "a dual pair" : "a print", filter.basis.name(),
             1e3 * filter.spacing_m, filter.filter_scale);
  fmt::print("  texels       {} x {} of {:.4g} x {:.4g} mm\n", lattice.width, lattice.height,
             1e3 * lattice.ds_m, 1e3 * lattice.dt_m);
  fmt::print(
      "  its marks    off by ({:.4g}, {:.4g}) um +- {:.2g}, turned by {:.4g} mrad +- {:.2g}\n",
      1e6 * filter.shift_m.x, 1e6 * filter.shift_m.y, 1e6 * filter.shift_sigma_m,
      1e3 * filter.rotation_rad, 1e3 * filter.rotation_sigma_rad);
  return {{"kind", "filter"},
          {"basis", filter.basis.name()},
          {"spacing_m", filter.spacing_m},
          {"prints", filter.prints.size()},
          {"shift_x_m", filter.shift_m.x},
          {"shift_y_m", filter.shift_m.y},
          {"rotation_rad", filter.rotation_rad}};
}

Json InfoPicture(const std::string& path) {
  const core::ExrReader reader(path);
  fmt::print("{}: OpenEXR, {} part{}\n", path, reader.parts().size(),
             reader.parts().size() == 1 ? "" : "s");
  for (std::size_t i = 0; i < std::min<std::size_t>(reader.parts().size(), 20); ++i) {
    const auto& part = reader.parts()[i];
    std::string channels;
    for (const auto& channel : part.channels) channels += " " + channel;
    fmt::print("  {:<12} {} x {}:{}\n", part.name.empty() ? "(unnamed)" : part.name, part.width,
               part.height, channels);
  }
  for (const auto& [name, value] : reader.parts().front().attributes)
    std::visit([&name = name](const auto& v) { fmt::print("  {} = {}\n", name, v); }, value);
  return {{"kind", "picture"}, {"parts", reader.parts().size()}};
}

Json InfoTables(const std::string& path) {
  const preprocess::Tables tables = preprocess::ReadTables(path);
  int dark = 0;
  for (int m = 0; m < tables.count(); ++m) dark += tables.Total(m) == 0;
  fmt::print("{}: sampling tables\n", path);
  fmt::print("  images       {} x {}, of {} x {} texels; {} all zero\n", tables.grid_width,
             tables.grid_height, tables.width, tables.height, dark);
  fmt::print("  made from    light field with SHA-256 {}\n", tables.light_field_sha256);
  return {{"kind", "tables"},
          {"grid_width", tables.grid_width},
          {"grid_height", tables.grid_height},
          {"width", tables.width},
          {"height", tables.height},
          {"all_zero_images", dark},
          {"light_field_sha256", tables.light_field_sha256}};
}

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

// Of OpenEXR files only those that say so: most are pictures.
bool IsEnvironment(const std::string& path, const std::string& name) {
  for (const char* radiance : {".hdr", ".rgbe", ".pic"})
    if (name.ends_with(radiance)) return true;
  return name.ends_with(".exr") && environment::SaysEnvironmentLayout(core::ExrReader(path));
}

void RequireFrames(const std::string& folder) {
  if (core::WhatIs(folder) != core::FileKind::kFolder) return;
  throw InputError(folder, "is a folder that holds neither a session nor .exr or .hdr frames",
                   "name a file in it");
}

Json Info(const std::string& path, const std::string& layout, const InfoOfToml& info_of_toml) {
  const std::string name = LowerCase(path);
  const core::FileKind kind = core::WhatIs(path);
  if (core::IsSession(kind)) return InfoSession(path);
  RequireFrames(path);
  if (kind == core::FileKind::kIntensity) return InfoPhotometry(path);
  if (name.ends_with(".l3d")) return InfoLampShape(path);
  if (kind == core::FileKind::kRays || name.ends_with(".tm25ray")) return InfoRays(path);
  if (environment::IsEnvironmentSequence(path)) return InfoEnvironmentSequence(path, layout);
  if (!layout.empty()) return InfoEnvironment(path, layout);
  if (name.ends_with(".lf.exr")) return InfoLightField(path);
  if (name.ends_with(".meas.exr")) return InfoMeasurements(path);
  if (name.ends_with(".tab.exr")) return InfoTables(path);
  if (name.ends_with(".filter.exr")) return InfoFilter(path);
  if (IsEnvironment(path, name)) return InfoEnvironment(path, layout);
  if (name.ends_with(".exr")) return InfoPicture(path);
  if (name.ends_with(".toml")) return info_of_toml(path);
  throw InputError(
      path, fmt::format("is {}, of which this verb knows nothing", core::NameOf(kind)),
      "give a session folder, a folder or .txt list of .hdr or .exr frames, .lf.exr, .meas.exr, "
      ".tab.exr, .filter.exr, .exr, .hdr, a ray file, .ies, .ldt, .tm33.xml, .gldf, .l3d or .toml");
}

}  // namespace

void AddInfo(Program& program, InfoOfToml info_of_toml) {
  auto path = std::make_shared<std::string>();
  auto layout = std::make_shared<std::string>();
  CLI::App& verb = program.AddVerb("info", [path, layout, info_of_toml = std::move(info_of_toml)] {
    return Info(*path, *layout, info_of_toml);
  });
  verb.add_option(
          "FILE", *path,
          "Any file luxfield reads or writes, a session folder, or a folder or .txt list of "
          "environment frames")
      ->required();
  verb.add_option("--layout", *layout,
                  fmt::format("Read a picture as an environment map: {} (default: an OpenEXR "
                              "file's envmap attribute; .hdr of 2 : 1 and 1 : 6 by their shape)",
                              environment::EnvironmentLayoutNames()));
}

}  // namespace luxfield::cli
