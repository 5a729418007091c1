#include "luxfield/capture/take/capture_filter.h"

#include <fmt/format.h>

#include <optional>
#include <set>
#include <tuple>

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

using FrameKey = std::tuple<FrameKind, int, int, int>;  // kind, view, rung, repeat

constexpr int kRungsBetween = 3;  // of a ladder in factors of 2

int LongestRung(int first, int exposures) { return first + kRungsBetween * (exposures - 1); }

// All frames in the order they are taken, once the empty holder has chosen its rung.
std::vector<FrameKey> PlannedFrames(int views, int first, int exposures, int repeats) {
  std::vector<FrameKey> frames;
  const auto add = [&](FrameKind kind, int view, int last) {
    for (int rung = first; rung <= last; rung += kRungsBetween)
      for (int repeat = 0; repeat < repeats; ++repeat)
        frames.emplace_back(kind, view, rung, repeat);
  };
  for (int view = 0; view < views; ++view)
    add(FrameKind::kTarget, view, view == 0 ? first : LongestRung(first, exposures));
  add(FrameKind::kDark, -1, LongestRung(first, exposures));
  return frames;
}

template <typename Records>
std::set<FrameKey> KeysOf(const Records& records) {
  std::set<FrameKey> keys;
  for (const FrameRecord& r : records) keys.insert({r.kind, r.i, r.exposure_index, r.repeat});
  return keys;
}

// The rung that the empty holder has chosen, if it was photographed.
std::optional<int> FirstRung(const std::set<FrameKey>& keys) {
  for (const auto& [kind, view, rung, repeat] : keys)
    if (kind == FrameKind::kTarget && view == 0) return rung;
  return {};
}

int ChooseFirstRung(const ExpandedFilterPlan& expanded, const hal::Devices& devices,
                    FrameTaker& taker) {
  const FilterPlan& plan = expanded.plan;
  taker.SelectTarget(expanded.views[0]);
  FrameRecord record;
  record.kind = FrameKind::kTarget;
  ShootBelowSaturation(taker, expanded.ladder_s, plan.saturation_share, devices.rig.camera,
                       plan.name, expanded.views[0], record);
  const int first = record.exposure_index, top = static_cast<int>(expanded.ladder_s.size()) - 1;
  if (LongestRung(first, plan.exposures) > top)
    throw InputError(
        fmt::format("plan \"{}\"", plan.name),
        fmt::format("{} takes {:.3g} s, {} exposures of a print end at {} times that, above "
                    "exposure.max_s",
                    expanded.views[0], expanded.ladder_s[first], plan.exposures,
                    1 << kRungsBetween * (plan.exposures - 1)),
        "raise the light or exposure.max_s, or take fewer exposures");
  return first;
}

// What the session lacks.
void TakePending(const ExpandedFilterPlan& expanded, const hal::Devices& devices,
                 const session::SessionWriter& session, FrameTaker& taker) {
  const FilterPlan& plan = expanded.plan;
  taker.SelectShutter("open");
  const std::set<FrameKey> there = KeysOf(session.committed_frames());
  const std::optional<int> chosen = FirstRung(there);
  const int first = chosen ? *chosen : ChooseFirstRung(expanded, devices, taker);
  std::vector<FrameKey> pending =
      PlannedFrames(static_cast<int>(expanded.views.size()), first, plan.exposures, plan.repeats);
  std::erase_if(pending, [&](const FrameKey& key) { return there.contains(key); });
  core::Progress progress("capture", pending.size());
  for (const auto& [kind, view, rung, repeat] : pending) {
    taker.PauseIfAsked(1);
    const bool dark = kind == FrameKind::kDark;
    taker.SelectShutter(dark ? "closed" : "open");
    taker.SelectTarget(dark ? "none" : expanded.views[view]);
    taker.Configure(rung);
    FrameRecord record;
    record.kind = kind;
    record.i = view;
    record.exposure_index = rung;
    record.repeat = repeat;
    taker.Commit(record, taker.Shoot(record));
    progress.Advance();
  }
  taker.SelectTarget("none");
  taker.SelectShutter("open");
}

}  // namespace

CaptureSummary RunFilterCapture(const FilterPlan& plan, hal::Devices& devices,
                                const std::filesystem::path& folder,
                                const CaptureOptions& options) {
  const ExpandedFilterPlan expanded = ExpandPlan(plan, devices);
  return TakeSession({ToJson(ToPlanFile(expanded)), DryRun(expanded, devices).bytes,
                      expanded.ladder_s, plan.max_attempts},
                     devices, folder, options,
                     [&](session::SessionWriter& session, FrameTaker& taker, CaptureSummary&) {
                       TakePending(expanded, devices, session, taker);
                     });
}

int MissingFilterFrames(const session::SessionReader& session) {
  const std::string file = (session.folder() / "plan.json").string();
  const session::PlanFile plan = session::PlanOf(session);
  const session::PlannedExposures& exposure = session::Stated(plan.exposure, "exposure", file);
  const std::set<FrameKey> there = KeysOf(session.frames());
  int missing = 0;
  for (const FrameKey& key : PlannedFrames(
           static_cast<int>(session::Stated(plan.views, "views", file).size()),
           FirstRung(there).value_or(0), session::Stated(exposure.exposures, "exposures", file),
           session::Stated(exposure.repeats, "repeats", file)))
    missing += !there.contains(key);
  return missing;
}

}  // namespace luxfield::capture
