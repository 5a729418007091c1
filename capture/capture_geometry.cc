#include "capture/capture_geometry.h"

#include <fmt/format.h>

#include <set>

#include "capture/expanded_plan.h"
#include "capture/frame_taker.h"
#include "capture/preflight.h"
#include "capture/session_description.h"
#include "core/error.h"
#include "core/json.h"
#include "core/progress.h"

namespace luxfield::capture {
namespace {

using core::FrameKind;
using core::FrameRecord;
using core::Json;

// Numbers of the views that are there.
template <typename Records>
std::set<int> ViewsIn(const Records& records) {
  std::set<int> views;
  for (const FrameRecord& record : records)
    if (record.kind == FrameKind::kTarget) views.insert(record.i);
  return views;
}

// A frame of the view with the longest exposure that keeps it below saturation_share.
Shot ShootBelowSaturation(const ExpandedGeometryPlan& expanded, FrameTaker& taker,
                          const hal::CameraCalibration& camera, const GeometryView& view,
                          FrameRecord& record) {
  const double range = camera.saturation_dn - camera.black_dn;
  for (int rung = static_cast<int>(expanded.ladder_s.size()) - 1; rung >= 0; --rung) {
    taker.Configure(rung);
    record.exposure_index = rung;
    Shot shot = taker.Shoot(record, [](const Shot&) { return std::string(); });
    const double share = (shot.statistics.brightest_dn - camera.black_dn) / range;
    if (share > expanded.plan.saturation_share) continue;
    constexpr double kLeast = 0.1;
    if (share < kLeast)
      throw InputError(fmt::format("plan \"{}\"", expanded.plan.name),
                       fmt::format("{} shows {:.2g} of the sensor's range in {} s", view.target,
                                   share, taker.exposure_s()),
                       "raise the light, or exposure.max_s");
    return shot;
  }
  throw InputError(
      fmt::format("plan \"{}\"", expanded.plan.name),
      fmt::format("{} is too bright even at {} s", view.target, expanded.ladder_s.front()),
      "dim the light, or lower exposure.min_s");
}

}  // namespace

CaptureSummary RunGeometryCapture(const GeometryPlan& plan, hal::Devices& devices,
                                  const std::filesystem::path& folder,
                                  const CaptureOptions& options) {
  const ExpandedGeometryPlan expanded = ExpandPlan(plan, devices);
  CheckDiskAndSafety(DryRun(expanded, devices).bytes, devices, folder);
  core::SessionWriter session = OpenSession(folder, ToJson(expanded), devices, options.resume);
  CaptureSummary summary;
  if (session.journal_says_sealed()) {
    session.Seal("complete");
    return summary;
  }
  const double start = devices.clock->MonotonicSeconds();
  const std::set<int> there = ViewsIn(session.committed_frames());
  FrameTaker taker(devices, session, expanded.ladder_s, plan.max_attempts, options, summary);
  session.StartEpoch(DescribeDevices(devices));
  taker.Home();
  taker.SelectShutter("open");
  core::Progress progress("capture", expanded.views.size());
  for (int n = 0; n < static_cast<int>(expanded.views.size()); ++n) {
    progress.Advance();
    if (there.contains(n)) continue;
    taker.PauseIfAsked(1);
    const GeometryView& view = expanded.views[n];
    taker.SelectTarget(view.target);
    taker.MoveTo(view.setpoint);
    FrameRecord record;
    record.kind = FrameKind::kTarget;
    record.i = n;
    const Shot shot = ShootBelowSaturation(expanded, taker, devices.rig.camera, view, record);
    taker.Commit(record, shot);
  }
  taker.SelectTarget("none");
  session.Seal("complete");
  summary.rig_s = devices.clock->MonotonicSeconds() - start;
  return summary;
}

int MissingGeometryFrames(const core::SessionReader& session) {
  const std::string file = (session.folder() / "plan.json").string();
  const std::set<int> there = ViewsIn(session.frames());
  int missing = 0;
  for (int n = 0; n < static_cast<int>(core::Field<Json>(session.plan(), "views", file).size());
       ++n)
    missing += !there.contains(n);
  return missing;
}

}  // namespace luxfield::capture
