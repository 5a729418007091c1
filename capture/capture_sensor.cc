#include "capture/capture_sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "capture/expanded_plan.h"
#include "capture/frame_taker.h"
#include "capture/take_session.h"
#include "core/error.h"
#include "core/json.h"
#include "core/progress.h"

namespace luxfield::capture {
namespace {

using core::FrameKind;
using core::FrameRecord;
using core::Json;

using FrameKey = std::tuple<FrameKind, int, int, int>;  // kind, channel, rung, repeat

// All frames of a sensor plan in the order they are taken.
std::vector<FrameKey> PlannedFrames(int channels, int rungs, int pairs) {
  std::vector<FrameKey> frames;
  for (int rung = 0; rung < rungs; ++rung)
    for (int repeat = 0; repeat < 2 * pairs; ++repeat)
      frames.emplace_back(FrameKind::kDark, 0, rung, repeat);
  for (int channel = 0; channel < channels; ++channel)
    for (int repeat = 0; repeat < 2 * pairs; ++repeat)
      for (int step = 0; step < rungs; ++step)
        frames.emplace_back(FrameKind::kFlat, channel, repeat % 2 == 0 ? step : rungs - 1 - step,
                            repeat);
  return frames;
}

FrameKey KeyOf(const FrameRecord& record) {
  return {record.kind, record.channel, record.exposure_index, record.repeat};
}

// Exposure time that fills the sensor on average, from the longest exposure without a saturated
// pixel.
double TimeToFill(const ExpandedSensorPlan& expanded, FrameTaker& taker,
                  const hal::CameraCalibration& camera, int channel) {
  for (int rung = static_cast<int>(expanded.ladder_s.size()) - 1; rung >= 0; --rung) {
    taker.Configure(rung);
    FrameRecord place;
    place.channel = channel;
    place.exposure_index = rung;
    const FrameStatistics s = taker.Shoot(place).statistics;
    if (s.saturated_share > 0) continue;
    const double signal = s.mean_dn - camera.black_dn,
                 range = camera.saturation_dn - camera.black_dn;
    if (!(signal > 1e-3 * range))
      throw InputError(fmt::format("plan \"{}\"", expanded.plan.name),
                       fmt::format("the flat of {} s shows no light in channel {} (mean {:.6g} DN)",
                                   expanded.ladder_s[rung], channel, s.mean_dn),
                       "open the shutter, raise the light, or plan longer exposures");
    return taker.exposure_s() * range / signal;
  }
  throw InputError(fmt::format("plan \"{}\"", expanded.plan.name),
                   fmt::format("pixels are saturated even at exposure.min_s = {} s in channel {}",
                               expanded.ladder_s.front(), channel),
                   "dim the light, or lower exposure.min_s and max_s");
}

void CheckLadder(const ExpandedSensorPlan& expanded, double fill_s, int channel) {
  constexpr int kLevels = 6;
  const auto levels =
      std::count_if(expanded.ladder_s.begin(), expanded.ladder_s.end(),
                    [&](double t) { return t > 0.05 * fill_s && t < 0.95 * fill_s; });
  const bool saturates = expanded.ladder_s.back() >= 1.1 * fill_s;
  if (levels >= kLevels && saturates) return;
  throw InputError(
      fmt::format("plan \"{}\"", expanded.plan.name),
      fmt::format(
          "channel {} fills the sensor in {:.3g} s: {} of its exposures lie between 5 % and "
          "95 % of that, {} are needed, and the longest ({} s) {} saturate it",
          channel, fill_s, levels, kLevels, expanded.ladder_s.back(),
          saturates ? "does" : "does not"),
      fmt::format("set exposure.min_s = {:.3g} and max_s = {:.3g}, or change the light",
                  0.01 * fill_s, 1.4 * fill_s));
}

// What the session lacks.
void TakePending(const ExpandedSensorPlan& expanded, hal::Devices& devices,
                const core::SessionWriter& session, FrameTaker& taker) {
  const SensorPlan& plan = expanded.plan;
  std::set<FrameKey> there;
  for (const FrameRecord& record : session.committed_frames()) there.insert(KeyOf(record));
  std::vector<FrameKey> pending =
      PlannedFrames(plan.channels, static_cast<int>(expanded.ladder_s.size()), plan.pairs);
  std::erase_if(pending, [&](const FrameKey& key) { return there.contains(key); });

  if (devices.announce) {
    const hal::StagePosition where = devices.stage->Where();
    devices.announce({session.epoch(), {where.readback}});
  }
  taker.WarmUpLamp(plan.warm_up);
  taker.SelectPrint(0);
  taker.SelectShutter("open");
  for (int channel = 0; channel < plan.channels; ++channel) {
    taker.SelectChannel(channel);
    CheckLadder(expanded, TimeToFill(expanded, taker, devices.rig.camera, channel), channel);
  }

  core::Progress progress("capture", pending.size());
  for (const auto& [kind, channel, rung, repeat] : pending) {
    taker.PauseIfAsked(1);
    taker.SelectShutter(kind == FrameKind::kDark ? "closed" : "open");
    taker.SelectChannel(channel);
    taker.Configure(rung);
    FrameRecord record;
    record.kind = kind;
    record.channel = channel;
    record.exposure_index = rung;
    record.repeat = repeat;
    taker.Commit(record, taker.Shoot(record));
    progress.Advance();
  }
  taker.SelectShutter("open");
}

}  // namespace

CaptureSummary RunSensorCapture(const SensorPlan& plan, hal::Devices& devices,
                                const std::filesystem::path& folder,
                                const CaptureOptions& options) {
  const ExpandedSensorPlan expanded = ExpandPlan(plan, devices);
  return TakeSession(
      {ToJson(expanded), DryRun(expanded, devices).bytes, expanded.ladder_s, plan.max_attempts},
      devices, folder, options,
      [&](core::SessionWriter& session, FrameTaker& taker, CaptureSummary&) {
        TakePending(expanded, devices, session, taker);
      });
}

int MissingSensorFrames(const core::SessionReader& session) {
  const std::string file = (session.folder() / "plan.json").string();
  const auto exposure = core::Field<Json>(session.plan(), "exposure", file);
  const auto ladder = core::Field<std::vector<double>>(exposure, "ladder_s", file);
  std::set<FrameKey> there;
  for (const FrameRecord& record : session.frames()) there.insert(KeyOf(record));
  int missing = 0;
  for (const FrameKey& key :
       PlannedFrames(core::Field<int>(session.plan(), "channels", file),
                     static_cast<int>(ladder.size()), core::Field<int>(exposure, "pairs", file)))
    missing += !there.contains(key);
  return missing;
}

}  // namespace luxfield::capture
