#include "luxfield/reconstruct/calibrate/geometry/calibrate_geometry.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_start.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/stated.h"
#include "luxfield/version.h"

namespace luxfield::reconstruct {
namespace {

using session::FrameKind;
using session::FrameRecord;

GeometryTargets TargetsOf(const session::PlanFile& plan, const std::string& file) {
  const session::PlannedTargets& stated = session::Stated(plan.targets, "targets", file);
  const session::PlannedStage& stage = session::Stated(plan.stage, "stage", file);
  GeometryTargets targets;
  targets.board = stated.board;
  targets.mask = stated.mask;
  targets.spacer_m = stated.spacer_m;
  targets.spacer_shift_m = stated.spacer_shift_m;
  targets.stage_repeatability_m = session::Stated(stage.repeatability_m, "repeatability_m", file);
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

std::vector<Shown> ViewsOf(const session::SessionReader& session, const session::PlanFile& plan,
                           const std::string& file) {
  const std::vector<session::PlannedView>& views = session::Stated(plan.views, "views", file);
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
    ChessboardView view = ViewOf(views[static_cast<std::size_t>(record.i)].target, file);
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
  const session::PlanFile plan = session::PlanOf(session);
  if (plan.kind != session::PlanKind::kGeometry)
    throw InputError(plan_file, "is not of kind \"geometry\"",
                     "capture a plan of that kind (docs/how-to/calibrate.md)");
  GeometryCalibration result;
  result.targets = TargetsOf(plan, plan_file);
  const session::SessionSetup setup = session::SetupOf(session);
  const rig::Homography stated =
      session::Stated(setup.image_from_sensor, "image_from_sensor", session_file);
  const rig::SensorModel sensor = session::SensorModelOf(setup, session_file, session.folder());
  const bool from_lamp =
      StatedSide(stated) > 0;  // the mask's u axis then points to falling columns

  const std::vector<Shown> shown = ViewsOf(session, plan, plan_file);
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
