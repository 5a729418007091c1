#include "luxfield/reconstruct/calibrate/geometry/geometry_calibration_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"

namespace luxfield::reconstruct {
namespace {

using core::Field;
using core::Json;
using lightfield::Vec2;

constexpr const char* kFormat = "luxfield geometry calibration";
constexpr int kVersion = 1;

Json Pair(Vec2 v) { return Json::array({v.x, v.y}); }

Json NoiseJson(const DetectionNoise& noise) {
  return {{"corners", noise.corners}, {"left_out", noise.left_out},
          {"rms_px", noise.rms_px},   {"predicted_px", noise.predicted},
          {"factor", noise.factor},   {"degrees", noise.degrees}};
}

Json ViewsJson(const GeometryCalibration& c) {
  Json views = Json::array();
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    const ChessboardView& view = c.views[n];
    Json corners = Json::array();
    for (const ViewResidual& r : c.geometry.residuals[n])
      corners.push_back({{"i", r.i},
                         {"j", r.j},
                         {"column", r.at.x},
                         {"row", r.at.y},
                         {"residual_px", Pair(r.residual_px)},
                         {"sigma_px", r.sigma_px},
                         {"left_out", r.left_out}});
    Json json = {
        {"file", view.file}, {"target", view.mask ? "mask" : "board"}, {"corners", corners}};
    if (view.mask) {
      json["on_spacer"] = view.on_spacer;
      json["setpoint_m"] = Pair(view.setpoint_m);
    } else {
      json["pose"] = view.board;
    }
    views.push_back(std::move(json));
  }
  return views;
}

void RequireSame(const Json& json, const char* key, int of_session, const std::string& file) {
  const int value = Field<int>(json, key, file);
  if (value != of_session)
    throw InputError(
        file, fmt::format("{} = {}, but the session's camera has {}", key, value, of_session),
        "use the calibration of this lab");
}

double SigmaOfDelta(const Json& json, const std::string& file) {
  for (const Json& parameter : Field<std::vector<Json>>(json, "parameters", file))
    if (Field<std::string>(parameter, "name", file) == "delta")
      return Field<double>(parameter, "sigma", file);
  throw InputError(file, "parameters hold no 'delta'", "calibrate the geometry again");
}

TiltedPlanes ReadTilts(const Json& json, const std::array<std::array<double, 3>, 2>& axes,
                       const std::string& file) {
  using Pairs = std::vector<std::array<double, 2>>;
  const auto tilt = Field<std::array<double, 2>>(json, "filter_tilt_rad", file);
  TiltedPlanes tilts{{tilt[0], tilt[1]}, {axes[0][2], axes[1][2]}, SigmaOfDelta(json, file), 0};
  for (const auto& sigma : Field<Pairs>(json, "place_sigma_m", file))
    tilts.place_sigma_m = std::max({tilts.place_sigma_m, sigma[0], sigma[1]});
  return tilts;
}

}  // namespace

Json ToJson(const GeometryCalibration& c) {
  const Geometry& g = c.geometry;
  Json parameters = Json::array(), places = Json::array(), axes = Json::array();
  for (const GeometryParameter& p : g.parameters)
    parameters.push_back(
        {{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"sigma", p.sigma}});
  for (const Vec2 sigma : g.place_sigma_m) places.push_back(Pair(sigma));
  for (const auto& axis : g.stage_axes) axes.push_back(Json::array({axis.x, axis.y, axis.z}));
  Json json = {{"format", kFormat},
               {"version", kVersion},
               {"rig", g.lens ? "reflector" : "lensless"},
               {"width", g.width},
               {"height", g.height},
               {"image_from_sensor", g.image_from_sensor.row_major()},
               {"place_sigma_m", places},
               {"lens", nullptr},
               {"delta_m", g.delta_m},
               {"filter_tilt_rad", Pair(g.filter_tilt_rad)},
               {"stage_axes", axes},
               {"parameters", parameters},
               {"covariance", g.covariance},
               {"fit_chi_squared", g.chi_squared},
               {"fit_degrees", g.degrees},
               {"mask_noise", NoiseJson(g.masks)},
               {"views", ViewsJson(c)},
               {"not_found", c.not_found},
               {"provenance", c.provenance}};
  if (g.lens) {
    json["lens"] = {{"focal_px", Pair(g.lens->focal_px)},
                    {"centre_px", Pair(g.lens->centre_px)},
                    {"distortion", g.lens->distortion}};
    json["board_noise"] = NoiseJson(g.boards);
  }
  return json;
}

void WriteGeometryCalibration(const std::filesystem::path& path,
                              const GeometryCalibration& calibration) {
  core::WriteJson(path, ToJson(calibration));
}

bool IsGeometryCalibration(const std::filesystem::path& path) {
  return Field<std::string>(core::ReadJson(path), "format", path.string()) == kFormat;
}

std::string ApplyGeometryCalibration(const std::filesystem::path& path, SessionPlan& plan) {
  const std::string file = path.string(), bytes = core::ReadFile(path);
  const Json json = core::ParseJson(bytes, file);
  if (Field<std::string>(json, "format", file) != kFormat)
    throw InputError(file, "is not a geometry calibration",
                     "write one with `luxfield calibrate geometry`");
  if (Field<int>(json, "version", file) != kVersion)
    throw InputError(file,
                     fmt::format("has version {}, this program reads {}",
                                 Field<int>(json, "version", file), kVersion),
                     "calibrate the geometry again");
  RequireSame(json, "width", plan.sensor.width, file);
  RequireSame(json, "height", plan.sensor.height, file);
  const auto rig = Field<std::string>(json, "rig", file), planned = rig::RigKindName(plan.rig);
  if (rig != planned)
    throw InputError(file, fmt::format("is of a {} rig, the session of a {} one", rig, planned),
                     "use the calibration of this lab");
  const double delta_m = Field<double>(json, "delta_m", file);
  if (!(std::abs(delta_m - plan.geometry.delta_m) < 0.1 * plan.geometry.delta_m))
    throw InputError(file,
                     fmt::format("delta_m = {} is not within 10 % of the plan's {}", delta_m,
                                 plan.geometry.delta_m),
                     "use the calibration of this lab");
  plan.geometry.delta_m = delta_m;
  plan.image_from_sensor = Field<std::array<double, 9>>(json, "image_from_sensor", file);
  const auto axes = Field<std::array<std::array<double, 3>, 2>>(json, "stage_axes", file);
  plan.stage_axes = {{{axes[0][0], axes[0][1]}, {axes[1][0], axes[1][1]}}};
  plan.tilts = ReadTilts(json, axes, file);
  const Json lens = Field<Json>(json, "lens", file);
  if (!lens.is_null()) {
    const auto focal = Field<std::array<double, 2>>(lens, "focal_px", file);
    const auto centre = Field<std::array<double, 2>>(lens, "centre_px", file);
    plan.lens = rig::Lens{{focal[0], focal[1]},
                          {centre[0], centre[1]},
                          Field<std::array<double, 4>>(lens, "distortion", file)};
    if (!(focal[0] > 0 && focal[1] > 0))
      throw InputError(file, "lens.focal_px must be above 0", "calibrate the geometry again");
  }
  return core::Sha256(bytes);
}

}  // namespace luxfield::reconstruct
