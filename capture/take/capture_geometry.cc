#include "luxfield/capture/take/capture_geometry.h"

#include <set>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/capture/take/below_saturation.h"
#include "luxfield/capture/take/take_session.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/plan_json.h"
#include "luxfield/session/stated.h"

namespace luxfield::capture {
namespace {

using session::FrameKind;
using session::FrameRecord;

// Numbers of the views that are there.
template <typename Records>
std::set<int> ViewsIn(const Records& records) {
  std::set<int> views;
  for (const FrameRecord& record : records)
    if (record.kind == FrameKind::kTarget) views.insert(record.i);
  return views;
}

// What the session lacks.
void TakePending(const ExpandedGeometryPlan& expanded, hal::Devices& devices,
                 const session::SessionWriter& session, FrameTaker& taker) {
  const GeometryPlan& plan = expanded.plan;
  const std::set<int> there = ViewsIn(session.committed_frames());
  taker.SelectShutter("open");
  core::Progress progress("capture", expanded.views.size());
  for (int n = 0; n < static_cast<int>(expanded.views.size()); ++n) {
    progress.Advance();
    if (there.contains(n)) continue;
    taker.PauseIfAsked(1);
    const session::PlannedView& view = expanded.views[n];
    taker.SelectTarget(view.target);
    taker.MoveTo(*view.setpoint);
    FrameRecord record;
    record.kind = FrameKind::kTarget;
    record.i = n;
    const Shot shot = ShootBelowSaturation(taker, expanded.ladder_s, plan.saturation_share,
                                           devices.rig.camera, plan.name, view.target, record);
    taker.Commit(record, shot);
  }
  taker.SelectTarget("none");
}

}  // namespace

CaptureSummary RunGeometryCapture(const GeometryPlan& plan, hal::Devices& devices,
                                  const std::filesystem::path& folder,
                                  const CaptureOptions& options) {
  const ExpandedGeometryPlan expanded = ExpandPlan(plan, devices);
  return TakeSession({ToJson(ToPlanFile(expanded)), DryRun(expanded, devices).bytes,
                      expanded.ladder_s, plan.max_attempts},
                     devices, folder, options,
                     [&](session::SessionWriter& session, FrameTaker& taker, CaptureSummary&) {
                       TakePending(expanded, devices, session, taker);
                     });
}

int MissingGeometryFrames(const session::SessionReader& session) {
  const std::string file = (session.folder() / "plan.json").string();
  const std::set<int> there = ViewsIn(session.frames());
  int missing = 0;
  const session::PlanFile plan = session::PlanOf(session);
  const auto views = static_cast<int>(session::Stated(plan.views, "views", file).size());
  for (int n = 0; n < views; ++n) missing += !there.contains(n);
  return missing;
}

}  // namespace luxfield::capture
