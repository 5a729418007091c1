#include "luxfield/capture/take/frame_taker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/capture/take/preflight.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"

namespace luxfield::capture {

using core::Json;
using session::FrameKind;
using session::FrameRecord;

FrameTaker::FrameTaker(hal::Devices& devices, session::SessionWriter* session,
                       const std::vector<double>& ladder_s, int max_attempts,
                       const CaptureOptions& options, CaptureSummary& summary)
    : devices_(devices),
      session_(session),
      ladder_s_(ladder_s),
      max_attempts_(max_attempts),
      options_(options),
      summary_(summary),
      usable_(UsablePixels(devices.camera->capabilities(), devices.rig.camera)),
      guard_(devices),
      clock_offset_s_(ClockOffset(*devices.clock)) {}

// Runs an action; where the safety inputs end it, the journal says that the session pauses.
template <typename Action>
void FrameTaker::PauseWhereStopped(Action&& action) {
  try {
    action();
  } catch (const hal::HardwareError& error) {
    if (error.fault == hal::Fault::kStopped) Pause(error.what());
    throw;
  }
}

void FrameTaker::RequireSafe() {
  PauseWhereStopped([this] { guard_.ThrowIfUnsafe(); });
}

// A trip ends what a device is doing; the error then is what tripped.
template <typename Action>
void FrameTaker::Drive(Action&& action) {
  RequireSafe();
  try {
    action();
  } catch (const hal::HardwareError& error) {
    if (error.fault == hal::Fault::kStopped) RequireSafe();
    throw;
  }
}

void FrameTaker::Note(const std::string& type, const Json& fields) {
  if (session_) session_->Append(type, fields);
}

void FrameTaker::WarmUpLamp(const WarmUpPolicy& policy) {
  WarmUp warm_up;
  PauseWhereStopped([&] { warm_up = WaitForLamp(policy, devices_, guard_); });
  lamp_variation_ = policy.variation;
  Note(
      "warm_up",
      {{"waited_s", warm_up.waited_s}, {"variation", warm_up.variation}, {"meter", warm_up.meter}});
  LogSupply();
}

void FrameTaker::LogSupply() {
  if (!devices_.supply) return;
  hal::SupplyState state;
  Drive([&] { state = devices_.supply->State(); });  // which gives way to a trip's order
  Json fields = Json::object();
  if (std::isfinite(state.voltage_v)) fields["voltage_v"] = state.voltage_v;
  if (std::isfinite(state.current_a)) fields["current_a"] = state.current_a;
  if (!fields.empty()) Note("supply", fields);
}

void FrameTaker::SelectShutter(const std::string& position) {
  if (devices_.shutter) devices_.shutter->Select(position, Deadline(devices_, 5));
}
void FrameTaker::SelectChannel(int channel) {
  if (devices_.colour)
    devices_.colour->Select(devices_.colour->positions().at(channel), Deadline(devices_, 5));
}
void FrameTaker::SelectPrint(int print) {
  if (devices_.print)
    devices_.print->Select(devices_.print->positions().at(print), Deadline(devices_, 5));
}

void FrameTaker::SelectTarget(const std::string& target) {
  constexpr double kByHand_s = 3600;
  if (devices_.target) devices_.target->Select(target, Deadline(devices_, kByHand_s));
}

void FrameTaker::Home() {
  stands_at_.reset();
  Drive([this] { devices_.stage->Home(Deadline(devices_, 300)); });
  RequireSafe();
  const hal::StagePosition where = devices_.stage->Where();
  if (!where.homed)
    throw hal::HardwareError(hal::Fault::kNotHomed, devices_.stage->identity(), "home",
                             "is not homed after homing", "check its reference switches");
  Note("home", {{"u_m", where.readback.x}, {"v_m", where.readback.y}});
}

// Records carry both clocks; where they part the journal says so.
void FrameTaker::WatchClock() {
  constexpr double kTolerance_s = 1;  // leap seconds and slewing stay below
  const double offset_s = ClockOffset(*devices_.clock);
  if (std::abs(offset_s - clock_offset_s_) <= kTolerance_s) return;
  Note("clock_jump", {{"by_s", offset_s - clock_offset_s_}});
  clock_offset_s_ = offset_s;
}

void FrameTaker::MoveTo(hal::Vec2 centre) {
  WatchClock();
  stands_at_.reset();
  const hal::StageLimits limits = devices_.stage->limits();
  const double longest = std::max(limits.max.x - limits.min.x, limits.max.y - limits.min.y);
  Drive([&] {
    devices_.stage->MoveTo(centre,
                           Deadline(devices_, longest / limits.speed_m_per_s + limits.settle_s));
  });
}

void FrameTaker::ConfigureExposure(double wanted) {
  applied_ = devices_.camera->Configure({wanted}, Deadline(devices_, 5));
  // Half a step of the camera is rounding; more is a refusal that would falsify the bracket.
  const double step = devices_.camera->capabilities().exposure_step_s;
  if (std::abs(applied_.exposure_s - wanted) > 0.5 * step + 0.01 * wanted)
    throw hal::HardwareError(
        hal::Fault::kRefused, devices_.camera->identity(), "configure",
        fmt::format("asked for {} s, reads back {} s", wanted, applied_.exposure_s),
        "choose exposures the camera has");
}

hal::Frame FrameTaker::Expose() {
  const double exposure = applied_.exposure_s + devices_.camera->capabilities().readout_s;
  RequireSafe();
  hal::Frame frame = devices_.camera->Expose(Deadline(devices_, exposure));
  RequireSafe();  // the lamp may have gone off during the exposure
  return frame;
}

FrameStatistics FrameTaker::Statistics(const session::RawFrame& frame) const {
  return Measure(frame, usable_, devices_.rig.camera);
}

// 0: no monitor. NaN where it tells nothing about the lamp.
double FrameTaker::ReadMonitor() {
  if (!devices_.monitor) return 0;
  const hal::Reading reading = devices_.monitor->Read(Deadline(devices_, 1));
  const bool sound = !reading.over_range && std::isfinite(reading.value) && reading.value >= 0;
  return sound ? reading.value : std::numeric_limits<double>::quiet_NaN();
}

// The frame's monitor reading, or the objection to it; the reading is then "none".
std::string FrameTaker::JudgeMonitor(const FrameRecord& place, double before, double after,
                                     Shot& shot) const {
  shot.meter = 0;
  if (place.kind == FrameKind::kDark) return {};
  if (std::isnan(before) || std::isnan(after))
    return fmt::format("{}: over range, below 0 or no number beside the exposure",
                       devices_.monitor->identity());
  const double mean = 0.5 * (before + after);
  if (std::abs(after - before) > lamp_variation_ * mean)
    return fmt::format(
        "{}: reads {} before the exposure and {} after it, more than a variation of {} apart: an "
        "unsteady lamp or a damaged answer",
        devices_.monitor->identity(), before, after, lamp_variation_);
  shot.meter = mean;
  return {};
}

// Why a frame cannot be what was asked for; empty if it can. Checks against the one taken before.
std::string FrameTaker::Distrust(const Shot& shot, double asked_at_s) const {
  const hal::Frame& frame = shot.frame;
  const session::RawFrame &image = *shot.image, &last = *last_image_;
  if (frame.frame_id <= last_id_)
    return fmt::format("stale: frame id {} after {}", frame.frame_id, last_id_);
  if (frame.t_start_s < asked_at_s) return "stale: exposed before it was asked for";
  if (frame.settings.settings_epoch != applied_.settings_epoch ||
      frame.settings.exposure_s != applied_.exposure_s)
    return fmt::format("taken at {} s, not at {} s", frame.settings.exposure_s,
                       applied_.exposure_s);
  // Without noise equal scenes give equal frames, and so does a sensor that is saturated all over.
  const bool noisy = devices_.rig.camera.read_noise_dn > 0 &&
                     shot.statistics.brightest_dn != shot.statistics.mean_dn;
  if (noisy && image.dn == last.dn && image.value == last.value)
    return "stale: equal to the frame before";
  return {};
}

Shot FrameTaker::Shoot(const FrameRecord& place, const Doubt& doubt) {
  for (int attempt = 0;; ++attempt) {
    StopIfAsked();
    const double before = ReadMonitor(), asked = devices_.clock->MonotonicSeconds();
    double after = 0;
    Shot shot;
    shot.attempt = attempt;
    bool fresh = false;
    try {
      shot.frame = Expose();
    } catch (const hal::HardwareError& error) {
      if (error.fault != hal::Fault::kIncomplete) throw;
      shot.reason = error.what();
    }
    if (shot.reason.empty()) {
      after = ReadMonitor();
      shot.image = std::make_shared<session::RawFrame>(std::move(shot.frame.image));
      shot.statistics = Statistics(*shot.image);
      shot.reason = Distrust(shot, asked);
      fresh = shot.reason.empty();
    }
    if (fresh) {
      shot.reason = JudgeMonitor(place, before, after, shot);
      if (shot.reason.empty() && doubt) shot.reason = doubt(shot);
      last_id_ = shot.frame.frame_id;
      last_image_ = shot.image;
    }
    if (shot.reason.empty()) return shot;
    if (attempt + 1 == max_attempts_) {
      if (!fresh)  // a stale frame or one with wrong settings is no measurement at all
        throw hal::HardwareError(
            hal::Fault::kProtocol, devices_.camera->identity(), "expose",
            fmt::format("{} attempts gave no fresh frame ({})", attempt + 1, shot.reason),
            "reconnect the camera and resume");
      shot.flagged = true;
      return shot;
    }
    ++summary_.rejected;
    Note("frame_rejected", {{"reason", shot.reason},
                            {"i", place.i},
                            {"j", place.j},
                            {"exposure_index", place.exposure_index},
                            {"attempt", attempt}});
  }
}

// Faults of a stage that has lost its position, whatever place it names.
hal::HardwareError FrameTaker::Lost(hal::Fault fault, const std::string& problem) const {
  hal::HardwareError error(fault, devices_.stage->identity(), "where", problem,
                           "look what disturbed it, then resume, which homes it");
  error.position_lost = true;
  return error;
}

hal::StagePosition FrameTaker::AskStage() {
  const hal::StagePosition where = devices_.stage->Where();
  if (!where.homed)
    throw Lost(hal::Fault::kNotHomed, "has lost its position since it arrived" +
                                          (where.lost.empty() ? "" : ": " + where.lost));
  return where;
}

// An answer that is not where the stage was sent to, or says that it moves, may be a garbled one:
// it takes two in a row that agree. Frames of one place are of one place: a stage that stands
// elsewhere than at the first of them has been displaced.
hal::Vec2 FrameTaker::WhereItStands() {
  constexpr int kAnswers = 5;
  constexpr double kRounding_m = 1e-9;
  const double near_m = devices_.stage->limits().resolution_m + kRounding_m;
  const auto agree = [&](hal::Vec2 a, hal::Vec2 b) {
    return std::abs(a.x - b.x) <= near_m && std::abs(a.y - b.y) <= near_m;
  };
  hal::StagePosition where = AskStage();
  bool certain = !where.moving && agree(where.readback, where.setpoint);
  for (int n = 1; !certain && n < kAnswers; ++n) {
    const hal::StagePosition again = AskStage();
    certain = !where.moving && !again.moving && agree(where.readback, again.readback);
    where = again;
  }
  if (!certain)
    throw Lost(hal::Fault::kProtocol,
               fmt::format("{} answers in a row do not name one place where it stands, the last "
                           "({} m, {} m)",
                           kAnswers, where.readback.x, where.readback.y));
  if (!stands_at_) stands_at_ = where.readback;
  if (!agree(where.readback, *stands_at_))
    throw Lost(hal::Fault::kProtocol,
               fmt::format("stands at ({} m, {} m), where it had arrived at ({} m, {} m)",
                           where.readback.x, where.readback.y, stands_at_->x, stands_at_->y));
  return where.readback;
}

void FrameTaker::Commit(FrameRecord record, const Shot& shot) {
  record.requested_exposure_s = ladder_s_[record.exposure_index];
  record.exposure_s = shot.frame.settings.exposure_s;
  // A bracket counts once CompletePosition has asked again: in between, controllers that answer a
  // few times a second are left alone.
  const bool ask = record.kind != FrameKind::kPosition || !stands_at_;
  const hal::Vec2 where = ask ? WhereItStands() : *stands_at_;
  record.stage_u_m = where.x;
  record.stage_v_m = where.y;
  record.t_start_s = shot.frame.t_start_s;
  record.meter = record.kind == FrameKind::kDark ? 0 : shot.meter;
  record.attempt = shot.attempt;
  record.flagged = shot.flagged;
  Json checks = ToJson(shot.statistics);
  if (shot.flagged) checks["flag"] = shot.reason;
  if (std::isfinite(shot.frame.temperature_c)) checks["temperature_c"] = shot.frame.temperature_c;
  session_->CommitFrameBehind(std::move(record), shot.image, std::move(checks));
  ++summary_.frames;
  summary_.flagged += shot.flagged;
  if (options_.on_frame) options_.on_frame(summary_);
}

void FrameTaker::CompletePosition(int i, int j) {
  WhereItStands();
  session_->CompletePosition(i, j);
}

void FrameTaker::Rest(double duration_s) {
  constexpr double kStep_s = 1;
  const double end = devices_.clock->MonotonicSeconds() + duration_s;
  for (;;) {
    RequireSafe();
    PauseIfAsked(1);
    const double left = end - devices_.clock->MonotonicSeconds();
    if (!(left > 0)) return;
    Sleep(devices_, std::min(left, kStep_s));
  }
}

void FrameTaker::Pause(const std::string& reason) { Note("paused", {{"reason", reason}}); }

void FrameTaker::PauseIfAsked(int count) {
  if (core::InterruptCount() < count) return;
  Pause(count == 1 ? "asked to pause" : "asked to stop");
  if (!session_) throw Interrupted("stopped before the session began; start again");
  throw Interrupted(fmt::format("{}: paused after {} new frames; continue with --resume",
                                session_->folder().string(), summary_.frames));
}

// Between two frames of a bracket only the second Ctrl-C counts.
void FrameTaker::StopIfAsked() {
  if (core::InterruptCount() < 2) return;
  devices_.camera->Abort();
  devices_.stage->Stop();
  PauseIfAsked(2);
}

}  // namespace luxfield::capture
