#include "luxfield/reconstruct/bracket/session_plan.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"

namespace luxfield::reconstruct {
namespace {

using core::Field;
using core::Json;

lightfield::LuminaireGeometry ReadGeometry(const Json& json, const std::string& file) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = Field<double>(json, "delta_m", file);
  auto& grid = geometry.grid;
  grid.basis = lightfield::Basis::FromName(Field<std::string>(json, "basis", file),
                                           core::FieldOr(json, "basis_a", 0.5, file));
  grid.width = Field<int>(json, "grid_width", file);
  grid.height = Field<int>(json, "grid_height", file);
  grid.u0_m = Field<double>(json, "u0_m", file);
  grid.v0_m = Field<double>(json, "v0_m", file);
  grid.spacing_m = Field<double>(json, "spacing_m", file);
  const Json lattice = Field<Json>(json, "lattice", file);
  geometry.lattice = {Field<int>(lattice, "width", file),   Field<int>(lattice, "height", file),
                      Field<double>(lattice, "s0_m", file), Field<double>(lattice, "t1_m", file),
                      Field<double>(lattice, "ds_m", file), Field<double>(lattice, "dt_m", file)};
  geometry.channels = Field<int>(json, "channels", file);
  geometry.unit = lightfield::FluxUnitFromName(Field<std::string>(json, "unit", file));
  geometry.Validate(file);
  return geometry;
}

double Positive(const Json& json, const std::string& key, const std::string& file) {
  const double value = Field<double>(json, key, file);
  if (!(value > 0))
    throw InputError(file, fmt::format("{} = {} must be above 0", key, value),
                     "correct the plan and capture again");
  return value;
}

std::string Choice(const Json& json, const std::string& key, const std::string& a,
                   const std::string& b, const std::string& file) {
  std::string value = Field<std::string>(json, key, file);
  if (value != a && value != b)
    throw InputError(file, fmt::format("{} = '{}' is unknown", key, value),
                     fmt::format("use '{}' or '{}'", a, b));
  return value;
}

}  // namespace

SessionPlan ReadSessionPlan(const session::SessionReader& session) {
  const std::string plan_file = (session.folder() / "plan.json").string();
  const std::string session_file = (session.folder() / "session.json").string();
  SessionPlan result;
  result.geometry = ReadGeometry(Field<Json>(session.plan(), "geometry", plan_file), plan_file);

  const Json filter = Field<Json>(session.plan(), "filter", plan_file);
  if (Choice(filter, "kind", "basis", "dual", plan_file) == "dual")
    result.filter = lightfield::FilterKind::kDual;
  else
    result.filter_scale = Positive(filter, "scale", plan_file);

  const Json rig = Field<Json>(session.plan(), "rig", plan_file);
  result.rig = Choice(rig, "kind", "lensless", "reflector", plan_file);
  if (result.rig == "reflector") result.albedo = Positive(rig, "albedo", plan_file);

  const Json exposure = core::FieldOr<Json>(session.plan(), "exposure", Json::object(), plan_file);
  if (exposure.contains("mean_tolerance"))
    result.level_tolerance = Positive(exposure, "mean_tolerance", plan_file);

  const Json calibration = Field<Json>(session.session(), "calibration", session_file);
  result.image_from_sensor =
      Field<std::array<double, 9>>(calibration, "image_from_sensor", session_file);
  result.sensor = ReadSensorModel(Field<Json>(session.session(), "camera", session_file),
                                  session_file, session.folder(), result.geometry.channels);
  return result;
}

}  // namespace luxfield::reconstruct
