#include "luxfield/reconstruct/calibrate/geometry/calibrate_geometry.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/reconstruct/bracket/noise_model.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_start.h"
#include "luxfield/version.h"

namespace luxfield::reconstruct {
namespace {

using core::Field;
using core::Json;
using session::FrameKind;
using session::FrameRecord;

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

GeometryTargets ReadTargets(const Json& plan, const std::string& file) {
  const Json json = Field<Json>(plan, "targets", file);
  GeometryTargets targets;
  if (json.contains("board")) targets.board = ReadChessboard(json.at("board"), file);
  targets.mask = ReadChessboard(Field<Json>(json, "mask", file), file);
  targets.spacer_m = Field<double>(json, "spacer_m", file);
  targets.spacer_shift_m = Field<double>(json, "spacer_shift_m", file);
  targets.stage_repeatability_m =
      Field<double>(Field<Json>(plan, "stage", file), "repeatability_m", file);
  if (!(targets.spacer_m > 0))
    throw InputError(file, fmt::format("targets.spacer_m = {} must be above 0", targets.spacer_m),
                     "correct the lab and capture again");
  return targets;
}

// "board on image plane", "board 3", "mask", "mask on spacer".
ChessboardView ViewOf(const std::string& target, const std::string& file) {
  ChessboardView view;
  view.mask = target.starts_with("mask");
  view.on_spacer = target == "mask on spacer";
  if (!view.mask && target != "board on image plane") {
    const std::string number = target.starts_with("board ") ? target.substr(6) : "";
    if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos ||
        number.size() > 6)
      throw InputError(file, fmt::format("target \"{}\" is unknown", target),
                       "capture again with this version");
    view.board = std::stoi(number);
  }
  return view;
}

struct Shown {
  ChessboardView view;
  const FrameRecord* record;
};

std::vector<Shown> ViewsOf(const session::SessionReader& session, const std::string& file) {
  const Json views = Field<Json>(session.plan(), "views", file);
  std::vector<Shown> shown;
  const FrameRecord* before = nullptr;
  int arrival = 0;
  std::set<int> there;
  for (const FrameRecord& record : session.frames()) {
    if (record.kind != FrameKind::kTarget) continue;
    if (record.i < 0 || record.i >= static_cast<int>(views.size()))
      throw InputError(
          (session.folder() / "journal.jsonl").string(),
          fmt::format("frame '{}' of view {} is not in plan.json", record.file, record.i),
          "run `luxfield verify` on the session");
    if (!there.insert(record.i).second) continue;
    ChessboardView view = ViewOf(Field<std::string>(views[record.i], "target", file), file);
    view.file = record.file;
    view.setpoint_m = {record.stage_u_m, record.stage_v_m};
    const bool moved =
        before && (before->stage_u_m != record.stage_u_m || before->stage_v_m != record.stage_v_m ||
                   before->epoch != record.epoch);
    view.arrival = arrival += moved;
    before = &record;
    shown.push_back({view, &record});
  }
  return shown;
}

}  // namespace

GeometryCalibration CalibrateGeometry(const session::SessionReader& session, bool check_hashes) {
  const std::string plan_file = (session.folder() / "plan.json").string(),
                    session_file = (session.folder() / "session.json").string();
  if (core::FieldOr<std::string>(session.plan(), "kind", "light-field", plan_file) != "geometry")
    throw InputError(plan_file, "is not of kind \"geometry\"",
                     "capture a plan of that kind (docs/how-to/calibrate.md)");
  GeometryCalibration result;
  result.targets = ReadTargets(session.plan(), plan_file);
  const Json calibration = Field<Json>(session.session(), "calibration", session_file);
  const auto stated = Field<std::array<double, 9>>(calibration, "image_from_sensor", session_file);
  const Json camera = Field<Json>(session.session(), "camera", session_file);
  const SensorModel sensor = ReadSensorModel(
      camera, session_file, session.folder(),
      static_cast<int>(Field<Json>(camera, "responsivity_e_per_s_per_w_m2", session_file).size()));
  const bool from_lamp =
      StatedSide(stated) > 0;  // the mask's u axis then points to falling columns

  const std::vector<Shown> shown = ViewsOf(session, plan_file);
  std::vector<const FrameRecord*> records;
  core::Progress progress("find targets", shown.size() * (result.targets.board ? 2 : 1));
  for (const Shown& s : shown) {
    core::ThrowIfInterrupted();
    const SignalImage image = MakeSignalImage(session.ReadFrame(*s.record, check_hashes), sensor);
    ChessboardView view = s.view;
    view.corners = FindChessboard(
        image, view.mask || !result.targets.board ? result.targets.mask : *result.targets.board,
        view.mask && !from_lamp);
    progress.Advance();
    if (view.corners.empty()) {
      result.not_found.push_back(view.file);
      continue;
    }
    result.views.push_back(std::move(view));
    records.push_back(s.record);
  }
  const auto fit = [&] {
    try {
      return FitGeometry(result.targets, result.views, sensor.width, sensor.height, stated);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", session.folder().string(), error.what()));
    }
  };
  result.geometry = fit();
  if (result.geometry.lens) {
    for (std::size_t n = 0; n < result.views.size(); ++n) {
      core::ThrowIfInterrupted();
      auto& corners = result.views[n].corners;
      corners = RefineCorners(MakeSignalImage(session.ReadFrame(*records[n], false), sensor),
                              corners, *result.geometry.lens);
      progress.Advance();
    }
    result.geometry = fit();
  }
  std::string hashes;
  for (const FrameRecord& record : session.frames()) hashes += record.sha256;
  result.provenance = {{"session_plan", session.plan_id()},
                       {"frames_sha256", core::Sha256(hashes)},
                       {"software", "luxfield " LUXFIELD_VERSION}};
  return result;
}

}  // namespace luxfield::reconstruct
