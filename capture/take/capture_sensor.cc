#include "luxfield/capture/take/capture_sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/capture/take/frame_taker.h"
#include "luxfield/capture/take/take_session.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/rig/cfa.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/plan_json.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/stated.h"

namespace luxfield::capture {
namespace {

using session::FrameKind;
using session::FrameRecord;

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

// The usable pixels that see a channel: of a mosaic those of its colour.
std::vector<PixelRun> PixelsOfChannel(const FrameTaker& taker,
                                      const hal::CameraCapabilities& camera, const std::string& cfa,
                                      int channel) {
  if (cfa.empty()) return taker.usable();
  std::vector<PixelRun> pixels;
  for (const PixelRun& run : taker.usable())
    for (std::size_t k = run.begin; k < run.end; ++k)
      if (rig::CfaChannel(cfa, static_cast<int>(k / camera.width),
                          static_cast<int>(k % camera.width)) == channel)
        pixels.push_back({k, k + 1});
  return pixels;
}

// Exposure time that fills `pixels` on average, from the longest exposure without a saturated one.
double TimeToFill(const ExpandedSensorPlan& expanded, FrameTaker& taker,
                  const std::vector<PixelRun>& pixels, const rig::SensorModel& camera,
                  int channel) {
  for (int rung = static_cast<int>(expanded.ladder_s.size()) - 1; rung >= 0; --rung) {
    taker.Configure(rung);
    FrameRecord place;
    place.channel = channel % expanded.channels_in_turn;
    place.exposure_index = rung;
    const FrameStatistics s = Measure(*taker.Shoot(place).image, pixels, camera);
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

// `full_s` fills the brightest channel that a frame shows: from there on the frame does not count.
void CheckLadder(const ExpandedSensorPlan& expanded, double fill_s, double full_s, int channel) {
  constexpr int kLevels = 6;
  const auto levels =
      std::count_if(expanded.ladder_s.begin(), expanded.ladder_s.end(),
                    [&](double t) { return t > 0.05 * fill_s && t < 0.95 * full_s; });
  const bool saturates = expanded.ladder_s.back() >= 1.1 * full_s;
  if (levels >= kLevels && saturates) return;
  const std::string until =
      full_s == fill_s ? "that"
                       : fmt::format("the {:.3g} s that fill its brightest colour", full_s);
  throw InputError(
      fmt::format("plan \"{}\"", expanded.plan.name),
      fmt::format(
          "channel {} fills the sensor in {:.3g} s: {} of its exposures lie between 5 % of that "
          "and 95 % of {}, {} are needed, and the longest ({} s) {} saturate it",
          channel, fill_s, levels, until, kLevels, expanded.ladder_s.back(),
          saturates ? "does" : "does not"),
      fmt::format("set exposure.min_s = {:.3g} and max_s = {:.3g}, take more levels, or change the "
                  "light",
                  0.01 * full_s, 1.4 * full_s));
}

void CheckLight(const ExpandedSensorPlan& expanded, FrameTaker& taker,
                const hal::Devices& devices) {
  const rig::SensorModel& camera = devices.rig.camera;
  std::vector<double> fill_s;
  for (int channel = 0; channel < expanded.plan.channels; ++channel) {
    taker.SelectChannel(channel % expanded.channels_in_turn);
    const std::vector<PixelRun> pixels =
        PixelsOfChannel(taker, devices.camera->capabilities(), camera.cfa, channel);
    fill_s.push_back(TimeToFill(expanded, taker, pixels, camera, channel));
  }
  const double brightest_s = *std::min_element(fill_s.begin(), fill_s.end());
  for (int channel = 0; channel < expanded.plan.channels; ++channel)
    CheckLadder(expanded, fill_s[channel], camera.cfa.empty() ? fill_s[channel] : brightest_s,
                channel);
}

// What the session lacks.
void TakePending(const ExpandedSensorPlan& expanded, hal::Devices& devices,
                 const session::SessionWriter& session, FrameTaker& taker) {
  const SensorPlan& plan = expanded.plan;
  std::set<FrameKey> there;
  for (const FrameRecord& record : session.committed_frames()) there.insert(KeyOf(record));
  std::vector<FrameKey> pending = PlannedFrames(
      expanded.channels_in_turn, static_cast<int>(expanded.ladder_s.size()), plan.pairs);
  std::erase_if(pending, [&](const FrameKey& key) { return there.contains(key); });

  if (devices.announce) {
    const hal::StagePosition where = devices.stage->Where();
    devices.announce({session.epoch(), {where.readback}});
  }
  taker.WarmUpLamp(plan.warm_up);
  taker.SelectPrint(0);
  taker.SelectShutter("open");
  CheckLight(expanded, taker, devices);

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
  return TakeSession({ToJson(ToPlanFile(expanded)), DryRun(expanded, devices).bytes,
                      expanded.ladder_s, plan.max_attempts},
                     devices, folder, options,
                     [&](session::SessionWriter& session, FrameTaker& taker, CaptureSummary&) {
                       TakePending(expanded, devices, session, taker);
                     });
}

int MissingSensorFrames(const session::SessionReader& session) {
  const std::string file = (session.folder() / "plan.json").string();
  const session::PlanFile plan = session::PlanOf(session);
  const session::PlannedExposures& exposure = session::Stated(plan.exposure, "exposure", file);
  std::set<FrameKey> there;
  for (const FrameRecord& record : session.frames()) there.insert(KeyOf(record));
  int missing = 0;
  const session::SessionSetup setup = session::SetupOf(session);
  const auto& camera =
      session::Stated(setup.camera, "camera", (session.folder() / "session.json").string());
  const int channels_in_turn =
      camera.cfa.empty() ? session::Stated(plan.channels, "channels", file) : 1;
  for (const FrameKey& key :
       PlannedFrames(channels_in_turn, static_cast<int>(exposure.ladder_s.size()),
                     session::Stated(exposure.pairs, "pairs", file)))
    missing += !there.contains(key);
  return missing;
}

}  // namespace luxfield::capture
