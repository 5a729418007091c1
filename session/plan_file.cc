#include "luxfield/session/plan_file.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/session/optional_field.h"
#include "luxfield/session/plan_json.h"
#include "luxfield/session/session_store.h"

namespace luxfield::session {
namespace {

using core::Field;
using core::FieldOr;
using core::Json;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;

constexpr std::pair<PlanKind, const char*> kKinds[] = {{PlanKind::kLightField, "light-field"},
                                                       {PlanKind::kSensor, "sensor"},
                                                       {PlanKind::kGeometry, "geometry"},
                                                       {PlanKind::kGlare, "glare"},
                                                       {PlanKind::kFilter, "filter"}};

void SetPoint(Json& json, const char* key, const std::optional<Vec2>& value) {
  if (value) json[key] = {value->x, value->y};
}

std::optional<Vec2> GetPoint(const Json& json, const char* key, const std::string& file) {
  const auto point = Get<std::pair<double, double>>(json, key, file);
  if (!point) return std::nullopt;
  return Vec2{point->first, point->second};
}

// The part of the plan under a key, read by `read(object, file)`.
template <typename Read>
auto Part(const Json& plan, const char* key, const std::string& file, Read&& read)
    -> std::optional<decltype(read(plan, file))> {
  if (!plan.contains(key)) return std::nullopt;
  return read(plan.at(key), file);
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

PlanKind ReadKind(const Json& plan, const std::string& file) {
  const auto name = FieldOr<std::string>(plan, "kind", "light-field", file);
  for (const auto& [kind, known] : kKinds)
    if (name == known) return kind;
  throw InputError(file, fmt::format("kind = '{}' is unknown", name),
                   "use 'light-field', 'sensor', 'geometry', 'glare' or 'filter'");
}

Json ToJson(const LuminaireGeometry& geometry) {
  const auto& grid = geometry.grid;
  const auto& lattice = geometry.lattice;
  return {{"delta_m", geometry.delta_m},
          {"basis", grid.basis.name()},
          {"basis_a", grid.basis.a},
          {"grid_width", grid.width},
          {"grid_height", grid.height},
          {"u0_m", grid.u0_m},
          {"v0_m", grid.v0_m},
          {"spacing_m", grid.spacing_m},
          {"lattice",
           {{"width", lattice.width},
            {"height", lattice.height},
            {"s0_m", lattice.s0_m},
            {"t1_m", lattice.t1_m},
            {"ds_m", lattice.ds_m},
            {"dt_m", lattice.dt_m}}},
          {"channels", geometry.channels},
          {"unit", lightfield::FluxUnitName(geometry.unit)}};
}

LuminaireGeometry ReadGeometry(const Json& json, const std::string& file) {
  LuminaireGeometry geometry;
  geometry.delta_m = Field<double>(json, "delta_m", file);
  auto& grid = geometry.grid;
  try {  // names know no file
    grid.basis = lightfield::Basis::FromName(Field<std::string>(json, "basis", file),
                                             FieldOr(json, "basis_a", 0.5, file));
    geometry.unit = lightfield::FluxUnitFromName(Field<std::string>(json, "unit", file));
  } catch (const InputError& error) {
    const std::string what = error.what();
    if (what.starts_with(file)) throw;
    throw InputError(fmt::format("{}: {}", file, what));
  }
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
  geometry.Validate(file);
  return geometry;
}

Json ToJson(const PlannedFilter& filter) {
  const bool dual = filter.kind == lightfield::FilterKind::kDual;
  return {{"kind", dual ? "dual" : "basis"}, {"scale", filter.scale}};
}

PlannedFilter ReadFilter(const Json& json, const std::string& file) {
  PlannedFilter filter;
  if (Choice(json, "kind", "basis", "dual", file) == "dual") {
    filter.kind = lightfield::FilterKind::kDual;
    filter.scale = FieldOr(json, "scale", 1.0, file);
  } else {
    filter.scale = Positive(json, "scale", file);
  }
  return filter;
}

Json ToJson(const PlannedRig& rig) {
  return {{"kind", rig::RigKindName(rig.kind)}, {"albedo", rig.albedo}};
}

PlannedRig ReadRig(const Json& json, const std::string& file) {
  PlannedRig rig;
  if (Choice(json, "kind", "lensless", "reflector", file) == "reflector") {
    rig.kind = rig::RigKind::kReflector;
    rig.albedo = Positive(json, "albedo", file);
  } else {
    rig.albedo = FieldOr(json, "albedo", 1.0, file);
  }
  return rig;
}

Json ToJson(const PlannedExposures& e) {
  Json json = {{"ladder_s", e.ladder_s}};
  Set(json, "saturation_share", e.saturation_share);
  Set(json, "relevant_share", e.relevant_share);
  Set(json, "floor_sigmas", e.floor_sigmas);
  Set(json, "mean_tolerance", e.mean_tolerance);
  Set(json, "flicker", e.flicker);
  Set(json, "pwm_hz", e.pwm_hz);
  Set(json, "repeats", e.repeats);
  Set(json, "pairs", e.pairs);
  Set(json, "exposures", e.exposures);
  Set(json, "max_attempts", e.max_attempts);
  return json;
}

PlannedExposures ReadExposures(const Json& json, const std::string& file) {
  PlannedExposures e;
  e.ladder_s = FieldOr(json, "ladder_s", std::vector<double>(), file);
  e.saturation_share = Get<double>(json, "saturation_share", file);
  e.relevant_share = Get<double>(json, "relevant_share", file);
  e.floor_sigmas = Get<double>(json, "floor_sigmas", file);
  if (json.contains("mean_tolerance")) e.mean_tolerance = Positive(json, "mean_tolerance", file);
  e.flicker = Get<double>(json, "flicker", file);
  e.pwm_hz = Get<double>(json, "pwm_hz", file);
  e.repeats = Get<int>(json, "repeats", file);
  e.pairs = Get<int>(json, "pairs", file);
  e.exposures = Get<int>(json, "exposures", file);
  e.max_attempts = Get<int>(json, "max_attempts", file);
  return e;
}

Json ToJson(const PlannedReference& r) {
  return {{"every", r.policy.every},
          {"max_drift", r.policy.max_drift},
          {"resume_share", r.policy.resume_share},
          {"interval_s", r.policy.interval_s},
          {"max_wait_s", r.policy.max_wait_s},
          {"u_m", r.place.x},
          {"v_m", r.place.y}};
}

PlannedReference ReadReference(const Json& json, const std::string& file) {
  PlannedReference r;
  ReferencePolicy& policy = r.policy;
  policy.every = FieldOr(json, "every", policy.every, file);
  policy.max_drift = FieldOr(json, "max_drift", policy.max_drift, file);
  policy.resume_share = FieldOr(json, "resume_share", policy.resume_share, file);
  policy.interval_s = FieldOr(json, "interval_s", policy.interval_s, file);
  policy.max_wait_s = FieldOr(json, "max_wait_s", policy.max_wait_s, file);
  r.place = {FieldOr(json, "u_m", 0.0, file), FieldOr(json, "v_m", 0.0, file)};
  return r;
}

Json ToJson(const WarmUpPolicy& w) {
  return {{"window_s", w.window_s},
          {"interval_s", w.interval_s},
          {"variation", w.variation},
          {"max_wait_s", w.max_wait_s}};
}

WarmUpPolicy ReadWarmUp(const Json& json, const std::string& file) {
  WarmUpPolicy w;
  w.window_s = FieldOr(json, "window_s", w.window_s, file);
  w.interval_s = FieldOr(json, "interval_s", w.interval_s, file);
  w.variation = FieldOr(json, "variation", w.variation, file);
  w.max_wait_s = FieldOr(json, "max_wait_s", w.max_wait_s, file);
  return w;
}

Json ToJson(const std::vector<PlannedPosition>& positions) {
  Json json = Json::array();
  for (const PlannedPosition& p : positions)
    json.push_back({{"i", p.i}, {"j", p.j}, {"u_m", p.centre.x}, {"v_m", p.centre.y}});
  return json;
}

std::vector<PlannedPosition> ReadPositions(const Json& json, const std::string& file) {
  std::vector<PlannedPosition> positions;
  for (const Json& p : json)
    positions.push_back({Field<int>(p, "i", file),
                         Field<int>(p, "j", file),
                         {Field<double>(p, "u_m", file), Field<double>(p, "v_m", file)}});
  return positions;
}

Json ToJson(const PlannedStage& stage) {
  Json json = Json::object();
  SetPoint(json, "min_m", stage.min_m);
  SetPoint(json, "max_m", stage.max_m);
  Set(json, "speed_m_per_s", stage.speed_m_per_s);
  Set(json, "repeatability_m", stage.repeatability_m);
  return json;
}

PlannedStage ReadStage(const Json& json, const std::string& file) {
  return {GetPoint(json, "min_m", file), GetPoint(json, "max_m", file),
          Get<double>(json, "speed_m_per_s", file), Get<double>(json, "repeatability_m", file)};
}

Json ToJson(const rig::Chessboard& board) {
  return {{"columns", board.columns}, {"rows", board.rows}, {"pitch_m", board.pitch_m}};
}

rig::Chessboard ReadChessboard(const Json& json, const std::string& file) {
  const rig::Chessboard board{Field<int>(json, "columns", file), Field<int>(json, "rows", file),
                              Field<double>(json, "pitch_m", file)};
  if (board.columns < 3 || board.rows < 3 || (board.columns + board.rows) % 2 == 0 ||
      !(board.pitch_m > 0))
    throw InputError(file,
                     fmt::format("a target of {} x {} corners, pitch {} m, cannot be used",
                                 board.columns, board.rows, board.pitch_m),
                     "take an odd and an even number of at least 3, and a pitch above 0");
  return board;
}

Json ToJson(const PlannedTargets& targets) {
  Json json = {{"mask", ToJson(targets.mask)},
               {"spacer_m", targets.spacer_m},
               {"spacer_shift_m", targets.spacer_shift_m}};
  if (targets.board) json["board"] = ToJson(*targets.board);
  return json;
}

PlannedTargets ReadTargets(const Json& json, const std::string& file) {
  PlannedTargets targets;
  targets.board = Part(json, "board", file, ReadChessboard);
  targets.mask = ReadChessboard(Field<Json>(json, "mask", file), file);
  targets.spacer_m = Field<double>(json, "spacer_m", file);
  targets.spacer_shift_m = Field<double>(json, "spacer_shift_m", file);
  if (!(targets.spacer_m > 0))
    throw InputError(file, fmt::format("targets.spacer_m = {} must be above 0", targets.spacer_m),
                     "correct the lab and capture again");
  return targets;
}

Json ToJson(const std::vector<PlannedView>& views) {
  Json json = Json::array();
  for (const PlannedView& view : views) {
    Json one = {{"target", view.target}};
    if (view.setpoint) {
      one["u_m"] = view.setpoint->x;
      one["v_m"] = view.setpoint->y;
    }
    json.push_back(std::move(one));
  }
  return json;
}

std::vector<PlannedView> ReadViews(const Json& json, const std::string& file) {
  std::vector<PlannedView> views;
  for (const Json& one : json) {
    PlannedView view{Field<std::string>(one, "target", file), std::nullopt};
    if (one.contains("u_m") || one.contains("v_m"))
      view.setpoint = Vec2{Field<double>(one, "u_m", file), Field<double>(one, "v_m", file)};
    views.push_back(std::move(view));
  }
  return views;
}

const Json& ListIn(const Json& plan, const char* key, const std::string& file) {
  if (!plan.at(key).is_array())
    throw InputError(file, fmt::format("field '{}' is no list", key),
                     "restore the file from its writer");
  return plan.at(key);
}

}  // namespace

std::string PlanKindName(PlanKind kind) {
  for (const auto& [known, name] : kKinds)
    if (kind == known) return name;
  return "";
}

Json ToJson(const PlanFile& plan) {
  Json json = {{"name", plan.name}};
  if (plan.kind != PlanKind::kLightField) json["kind"] = PlanKindName(plan.kind);
  const auto set = [&json](const char* key, const auto& part) {
    if (part) json[key] = ToJson(*part);
  };
  Set(json, "channels", plan.channels);
  set("geometry", plan.geometry);
  set("filter", plan.filter);
  set("rig", plan.rig);
  set("exposure", plan.exposure);
  set("reference", plan.reference);
  set("warm_up", plan.warm_up);
  if (plan.dark_repeats) json["darks"] = {{"repeats", *plan.dark_repeats}};
  set("positions", plan.positions);
  set("stage", plan.stage);
  set("targets", plan.targets);
  if (plan.sheet) json["sheet"] = Json::parse(rig::SheetText(*plan.sheet));
  set("views", plan.views);
  return json;
}

PlanFile PlanFromJson(const Json& json, const std::string& file) {
  PlanFile plan;
  plan.kind = ReadKind(json, file);
  plan.name = FieldOr<std::string>(json, "name", "", file);
  plan.channels = Get<int>(json, "channels", file);
  plan.geometry = Part(json, "geometry", file, ReadGeometry);
  plan.filter = Part(json, "filter", file, ReadFilter);
  plan.rig = Part(json, "rig", file, ReadRig);
  plan.exposure = Part(json, "exposure", file, ReadExposures);
  plan.reference = Part(json, "reference", file, ReadReference);
  plan.warm_up = Part(json, "warm_up", file, ReadWarmUp);
  plan.dark_repeats = Part(json, "darks", file, [](const Json& darks, const std::string& where) {
    return Field<int>(darks, "repeats", where);
  });
  if (json.contains("positions"))
    plan.positions = ReadPositions(ListIn(json, "positions", file), file);
  plan.stage = Part(json, "stage", file, ReadStage);
  plan.targets = Part(json, "targets", file, ReadTargets);
  plan.sheet = Part(json, "sheet", file, [](const Json& sheet, const std::string& where) {
    return rig::ParseFilterSheet(sheet.dump(), where);
  });
  if (json.contains("views")) plan.views = ReadViews(ListIn(json, "views", file), file);
  return plan;
}

PlanFile PlanOf(const SessionReader& session) {
  return PlanFromJson(session.plan(), (session.folder() / "plan.json").string());
}

}  // namespace luxfield::session
