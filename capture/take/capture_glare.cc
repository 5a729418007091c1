#include "luxfield/capture/take/capture_glare.h"

#include <algorithm>
#include <map>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/capture/take/below_saturation.h"
#include "luxfield/capture/take/take_session.h"
#include "luxfield/core/progress.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/plan_json.h"
#include "luxfield/session/stated.h"

namespace luxfield::capture {
namespace {

using session::FrameKind;
using session::FrameRecord;

// How many frames there are of every place, and darks of every exposure time used.
struct Taken {
  std::map<int, int> places;
  std::map<int, int> darks;  // by rung; 0 where a place has frames but none is dark

  template <typename Records>
  explicit Taken(const Records& records) {
    for (const FrameRecord& record : records) {
      if (record.kind == FrameKind::kTarget) {
        ++places[record.i];
        darks.try_emplace(record.exposure_index, 0);
      } else if (record.kind == FrameKind::kDark) {
        ++darks[record.exposure_index];
      }
    }
  }
};

// What the session lacks.
void TakePending(const ExpandedGlarePlan& expanded, hal::Devices& devices,
                 const session::SessionWriter& session, FrameTaker& taker) {
  const GlarePlan& plan = expanded.plan;
  taker.SelectShutter("open");
  Taken taken(session.committed_frames());
  core::Progress progress("capture", expanded.targets.size());
  for (int n = 0; n < static_cast<int>(expanded.targets.size()); ++n) {
    progress.Advance();
    if (taken.places[n] >= plan.repeats) continue;
    taker.PauseIfAsked(1);
    taker.SelectTarget(expanded.targets[n]);
    FrameRecord record;
    record.kind = FrameKind::kTarget;
    record.i = n;
    Shot shot = ShootBelowSaturation(taker, expanded.ladder_s, plan.saturation_share,
                                     devices.rig.camera, plan.name, expanded.targets[n], record);
    for (record.repeat = 0;; ++record.repeat) {
      taker.Commit(record, shot);
      if (record.repeat + 1 == plan.repeats) break;
      shot = taker.Shoot(record);
    }
    taken.darks.try_emplace(record.exposure_index, 0);
  }
  taker.SelectTarget("none");
  taker.SelectShutter("closed");
  for (const auto& [rung, there] : taken.darks) {
    taker.Configure(rung);
    for (int repeat = there; repeat < plan.repeats; ++repeat) {
      FrameRecord record;
      record.kind = FrameKind::kDark;
      record.exposure_index = rung;
      record.repeat = repeat;
      taker.Commit(record, taker.Shoot(record));
    }
  }
  taker.SelectShutter("open");
}

}  // namespace

CaptureSummary RunGlareCapture(const GlarePlan& plan, hal::Devices& devices,
                               const std::filesystem::path& folder, const CaptureOptions& options) {
  const ExpandedGlarePlan expanded = ExpandPlan(plan, devices);
  return TakeSession({ToJson(ToPlanFile(expanded)), DryRun(expanded, devices).bytes,
                      expanded.ladder_s, plan.max_attempts},
                     devices, folder, options,
                     [&](session::SessionWriter& session, FrameTaker& taker, CaptureSummary&) {
                       TakePending(expanded, devices, session, taker);
                     });
}

int MissingGlareFrames(const session::SessionReader& session) {
  const std::string file = (session.folder() / "plan.json").string();
  const session::PlanFile plan = session::PlanOf(session);
  const int repeats =
      session::Stated(session::Stated(plan.exposure, "exposure", file).repeats, "repeats", file);
  const auto places = static_cast<int>(session::Stated(plan.views, "views", file).size());
  Taken taken(session.frames());
  int missing = 0;
  for (int n = 0; n < places; ++n) missing += std::max(0, repeats - taken.places[n]);
  for (const auto& [rung, there] : taken.darks) missing += std::max(0, repeats - there);
  return missing;
}

}  // namespace luxfield::capture
