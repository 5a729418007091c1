#include "capture/capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "capture/frame_check.h"
#include "capture/preflight.h"
#include "capture/session_description.h"
#include "core/error.h"
#include "core/json.h"
#include "core/progress.h"
#include "core/session_writer.h"

namespace luxfield::capture {
namespace {

using core::FrameKind;
using core::FrameRecord;
using core::Json;

// One run over one session.
class Run {
 public:
  Run(const ExpandedPlan& expanded, hal::Devices& devices, core::SessionWriter& session,
      const CaptureOptions& options)
      : expanded_(expanded),
        plan_(expanded.plan),
        devices_(devices),
        rig_(devices.rig),
        session_(session),
        options_(options),
        usable_(UsablePixels(devices.camera->capabilities(), devices.rig.camera)) {
    summary_.positions_total = static_cast<int>(expanded.positions.size());
  }

  CaptureSummary Capture() {
    const double start = devices_.clock->MonotonicSeconds();
    session_.StartEpoch(DescribeDevices(devices_));
    RecallReferences();
    const auto pending = Pending();
    Prepare(pending);
    core::Progress progress("capture", pending.size());
    TakeDarks(0);
    const int every = plan_.reference.every;
    for (std::size_t n = 0; n < pending.size(); ++n) {
      if (every > 0 && n % static_cast<std::size_t>(every) == 0) TakeReference();
      PauseIfAsked(1);
      TakePosition(pending[n]);
      ++summary_.positions;
      progress.Advance(
          1, fmt::format("{} frames, {} rejected, {} flagged, lamp {:.4f}", summary_.frames,
                         summary_.rejected, summary_.flagged, lamp_ratio_));
    }
    if (every > 0 && !pending.empty()) TakeReference();
    TakeDarks(plan_.dark_repeats);
    session_.Seal("complete");
    summary_.rig_s = devices_.clock->MonotonicSeconds() - start;
    return summary_;
  }

 private:
  std::vector<PlannedPosition> Pending() const {
    std::vector<PlannedPosition> pending;
    for (const PlannedPosition& p : expanded_.positions)
      if (!session_.PositionComplete(p.i, p.j)) pending.push_back(p);
    return pending;
  }

  // Home, tell the rig what is coming, warm up, look at the dark level.
  void Prepare(const std::vector<PlannedPosition>& pending) {
    devices_.stage->Home(Deadline(devices_, 300));
    const hal::StagePosition where = devices_.stage->Where();
    if (!where.homed)
      throw hal::HardwareError(hal::Fault::kNotHomed, devices_.stage->identity(), "home",
                               "is not homed after homing", "check its reference switches");
    session_.Append("home", {{"u_m", where.readback.x}, {"v_m", where.readback.y}});
    if (devices_.announce) {
      hal::VisitPlan visits;
      visits.epoch = session_.epoch();
      for (std::size_t n = 0; n < pending.size(); ++n) {
        if (plan_.reference.every > 0 && n % static_cast<std::size_t>(plan_.reference.every) == 0)
          visits.filter_centres.push_back(expanded_.reference);
        visits.filter_centres.push_back(pending[n].centre);
      }
      if (plan_.reference.every > 0) visits.filter_centres.push_back(expanded_.reference);
      devices_.announce(visits);
    }
    const WarmUp warm_up = WaitForLamp(plan_.warm_up, devices_);
    session_.Append("warm_up", {{"waited_s", warm_up.waited_s},
                                {"variation", warm_up.variation},
                                {"meter", warm_up.meter}});
    CheckDarkLevel();
  }

  void CheckDarkLevel() {
    SelectShutter("closed");
    Configure(0);
    const FrameStatistics s = Measure(Expose().image, usable_, rig_.camera);
    const hal::CameraCalibration& c = rig_.camera;
    const double expected =
        c.black_dn + c.gain_dn_per_e * c.dark_current_e_per_s * expanded_.ladder_s.front();
    if (std::abs(s.mean_dn - expected) > 0.01 * (c.saturation_dn - c.black_dn) + c.read_noise_dn)
      throw DeviceError(
          fmt::format("{}: the dark level is {:.1f} DN where the calibration says {:.1f}; close "
                      "the shutter, keep "
                      "light out, or calibrate again",
                      devices_.camera->identity(), s.mean_dn, expected));
  }

  // Reference exposures of earlier epochs: references compare only at equal exposure.
  void RecallReferences() {
    for (const FrameRecord& record : session_.committed_frames())
      if (record.kind == FrameKind::kReference) {
        reference_rung_.try_emplace(record.channel, record.exposure_index);
        reference_number_ = std::max(reference_number_, record.repeat + 1);
      }
    for (const auto& [channel, rate] : session_.first_reference_rates())
      first_reference_rate_[channel] = rate;
  }

  // --- devices ---

  void SelectShutter(const std::string& position) {
    if (devices_.shutter) devices_.shutter->Select(position, Deadline(devices_, 5));
  }
  void SelectChannel(int channel) {
    if (devices_.colour)
      devices_.colour->Select(devices_.colour->positions().at(channel), Deadline(devices_, 5));
  }
  void SelectPrint(int print) {
    if (devices_.print)
      devices_.print->Select(devices_.print->positions().at(print), Deadline(devices_, 5));
  }

  void MoveTo(hal::Vec2 centre) {
    const hal::StageLimits limits = devices_.stage->limits();
    const double longest = std::max(limits.max.x - limits.min.x, limits.max.y - limits.min.y);
    devices_.stage->MoveTo(centre,
                           Deadline(devices_, longest / limits.speed_m_per_s + limits.settle_s));
  }

  void Configure(int rung) {
    const double wanted = expanded_.ladder_s[rung];
    applied_ = devices_.camera->Configure({wanted}, Deadline(devices_, 5));
    // Half a step of the camera is rounding; more is a refusal that would falsify the bracket.
    const double step = devices_.camera->capabilities().exposure_step_s;
    if (std::abs(applied_.exposure_s - wanted) > 0.5 * step + 0.01 * wanted)
      throw hal::HardwareError(
          hal::Fault::kRefused, devices_.camera->identity(), "configure",
          fmt::format("asked for {} s, reads back {} s", wanted, applied_.exposure_s),
          "choose exposures the camera has");
  }

  hal::Frame Expose() {
    const double exposure = applied_.exposure_s + devices_.camera->capabilities().readout_s;
    return devices_.camera->Expose(Deadline(devices_, exposure));
  }

  double ReadMonitor() {
    return devices_.monitor ? devices_.monitor->Read(Deadline(devices_, 1)).value : 0;
  }

  // --- frames ---

  // Why a frame cannot be what was asked for; empty if it can. Checks against the one taken before.
  std::string Distrust(const hal::Frame& frame, double asked_at_s) const {
    if (frame.frame_id <= last_id_)
      return fmt::format("stale: frame id {} after {}", frame.frame_id, last_id_);
    if (frame.t_start_s < asked_at_s) return "stale: exposed before it was asked for";
    if (frame.settings.settings_epoch != applied_.settings_epoch ||
        frame.settings.exposure_s != applied_.exposure_s)
      return fmt::format("taken at {} s, not at {} s", frame.settings.exposure_s,
                         applied_.exposure_s);
    const bool noisy =
        rig_.camera.read_noise_dn > 0;  // without noise equal scenes give equal frames
    if (noisy && frame.image.dn == last_image_.dn && frame.image.value == last_image_.value)
      return "stale: equal to the frame before";
    return {};
  }

  struct Shot {
    hal::Frame frame;
    FrameStatistics statistics;
    double meter = 0;
    bool flagged = false;
    std::string reason;  // of the flag
    int attempt = 0;
  };

  // Exposes with the present settings until a frame passes, at most max_attempts times. `doubt` may
  // object to a frame that is fresh: its sentence, or empty.
  template <typename Doubt>
  Shot Shoot(const FrameRecord& place, Doubt&& doubt) {
    for (int attempt = 0;; ++attempt) {
      StopIfAsked();
      const double before = ReadMonitor(), asked = devices_.clock->MonotonicSeconds();
      Shot shot{Expose(), {}, 0, false, {}, attempt};
      shot.meter = 0.5 * (before + ReadMonitor());
      shot.statistics = Measure(shot.frame.image, usable_, rig_.camera);
      shot.reason = Distrust(shot.frame, asked);
      const bool fresh = shot.reason.empty();
      if (fresh) shot.reason = doubt(shot);
      if (fresh) {
        last_id_ = shot.frame.frame_id;
        last_image_ = shot.frame.image;
      }
      if (shot.reason.empty()) return shot;
      if (attempt + 1 == plan_.exposure.max_attempts) {
        if (!fresh)  // a stale frame or one with wrong settings is no measurement at all
          throw hal::HardwareError(
              hal::Fault::kProtocol, devices_.camera->identity(), "expose",
              fmt::format("{} attempts gave no fresh frame ({})", attempt + 1, shot.reason),
              "reconnect the camera and resume");
        shot.flagged = true;
        return shot;
      }
      ++summary_.rejected;
      session_.Append("frame_rejected", {{"reason", shot.reason},
                                         {"i", place.i},
                                         {"j", place.j},
                                         {"exposure_index", place.exposure_index},
                                         {"attempt", attempt}});
    }
  }

  void Commit(FrameRecord record, const Shot& shot) {
    record.requested_exposure_s = expanded_.ladder_s[record.exposure_index];
    record.exposure_s = shot.frame.settings.exposure_s;
    const hal::StagePosition where = devices_.stage->Where();
    record.stage_u_m = where.readback.x;
    record.stage_v_m = where.readback.y;
    record.t_start_s = shot.frame.t_start_s;
    record.meter = record.kind == FrameKind::kDark ? 0 : shot.meter;
    record.attempt = shot.attempt;
    record.flagged = shot.flagged;
    Json checks = ToJson(shot.statistics);
    if (shot.flagged) checks["flag"] = shot.reason;
    session_.CommitFrame(record, shot.frame.image, checks);
    ++summary_.frames;
    summary_.flagged += shot.flagged;
    if (options_.on_frame) options_.on_frame(summary_);
  }

  void TakeDarks(int first_repeat) {
    SelectShutter("closed");
    for (int rung = 0; rung < static_cast<int>(expanded_.ladder_s.size()); ++rung) {
      Configure(rung);
      for (int repeat = 0; repeat < plan_.dark_repeats; ++repeat) {
        PauseIfAsked(1);
        FrameRecord record;
        record.kind = FrameKind::kDark;
        record.exposure_index = rung;
        record.repeat = first_repeat + repeat;
        Commit(record, Shoot(record, [](const Shot&) { return std::string(); }));
      }
    }
    SelectShutter("open");
  }

  // Brightest signal in DN per second, from frames that only serve to find it: from the middle of
  // the ladder down while anything is saturated, up while nothing stands out of the noise.
  double ProbeRate(const FrameRecord& place) {
    const hal::CameraCalibration& c = rig_.camera;
    const int top = static_cast<int>(expanded_.ladder_s.size()) - 1;
    const double dim =
        c.black_dn + std::max(20 * c.read_noise_dn, 0.02 * (c.saturation_dn - c.black_dn));
    bool came_down = false;
    for (int rung = top / 2;;) {
      Configure(rung);
      const Shot shot = Shoot(place, [](const Shot&) { return std::string(); });
      const FrameStatistics& s = shot.statistics;
      session_.Append("probe", {{"i", place.i},
                                {"j", place.j},
                                {"print", place.print},
                                {"channel", place.channel},
                                {"exposure_s", applied_.exposure_s},
                                {"brightest_dn", s.brightest_dn},
                                {"saturated_share", s.saturated_share}});
      const bool saturated = s.brightest_dn >= plan_.exposure.saturation_share * c.saturation_dn;
      if (saturated && rung > 0) {
        --rung;
        came_down = true;
      } else if (!saturated && !came_down && s.brightest_dn < dim && rung < top) {
        ++rung;
      } else {
        return std::max(0.0, s.brightest_dn - c.black_dn) / applied_.exposure_s;
      }
    }
  }

  void TakeBracket(const PlannedPosition& p, int print, int channel) {
    FrameRecord record;
    record.i = p.i;
    record.j = p.j;
    record.print = print;
    record.channel = channel;
    const Rungs rungs =
        ChooseRungs(ProbeRate(record), expanded_.ladder_s, plan_.exposure, rig_.camera);
    session_.Append("bracket", {{"i", p.i},
                                {"j", p.j},
                                {"print", print},
                                {"channel", channel},
                                {"first", rungs.first},
                                {"last", rungs.last}});
    core::RawFrame shorter;
    double shorter_exposure_s = 0;
    for (int rung = rungs.first; rung <= rungs.last; ++rung) {
      record.exposure_index = rung;
      Configure(rung);
      for (record.repeat = 0; record.repeat < plan_.exposure.repeats; ++record.repeat) {
        const auto doubt = [&](const Shot& shot) -> std::string {
          if (rung == rungs.first && shot.statistics.saturated_share > 0)
            return fmt::format("{:.3g} of the pixels saturated in the shortest exposure",
                               shot.statistics.saturated_share);
          if (shorter.size() == 0) return {};
          const auto ratio =
              LevelRatio(shot.frame.image, shot.frame.settings.exposure_s, shorter,
                         shorter_exposure_s, usable_, rig_.camera, plan_.exposure.mean_tolerance);
          if (ratio && std::abs(*ratio - 1) > plan_.exposure.mean_tolerance)
            return fmt::format("level is {:.3g} of what the shorter exposure predicts", *ratio);
          return {};
        };
        Shot shot = Shoot(record, doubt);
        Commit(record, shot);
        if (record.repeat + 1 == plan_.exposure.repeats && !shot.flagged) {
          shorter_exposure_s = shot.frame.settings.exposure_s;
          shorter = std::move(shot.frame.image);
        }
      }
    }
  }

  void TakePosition(const PlannedPosition& p) {
    MoveTo(p.centre);
    for (int print = 0; print < expanded_.prints; ++print) {
      SelectPrint(print);
      for (int channel = 0; channel < plan_.geometry.channels; ++channel) {
        SelectChannel(channel);
        TakeBracket(p, print, channel);
      }
    }
    session_.CompletePosition(p.i, p.j);
  }

  void TakeReference() {
    PauseIfAsked(1);
    MoveTo(expanded_.reference);
    SelectPrint(0);
    for (int channel = 0; channel < plan_.geometry.channels; ++channel) {
      SelectChannel(channel);
      FrameRecord record;
      record.kind = FrameKind::kReference;
      record.channel = channel;
      record.repeat = reference_number_;
      if (!reference_rung_.contains(channel))
        reference_rung_[channel] =
            ChooseRungs(ProbeRate(record), expanded_.ladder_s, plan_.exposure, rig_.camera).first;
      record.exposure_index = reference_rung_[channel];
      Configure(record.exposure_index);
      const Shot shot = Shoot(record, [](const Shot&) { return std::string(); });
      Commit(record, shot);
      const double rate =
          (shot.statistics.mean_dn - rig_.camera.black_dn) / shot.frame.settings.exposure_s;
      const double first = first_reference_rate_.try_emplace(channel, rate).first->second;
      lamp_ratio_ = first > 0 ? rate / first : 1;
      session_.Append("reference", {{"number", reference_number_},
                                    {"channel", channel},
                                    {"mean_rate", rate},
                                    {"ratio", lamp_ratio_}});
      summary_.lamp_ratio_min = std::min(summary_.lamp_ratio_min, lamp_ratio_);
      summary_.lamp_ratio_max = std::max(summary_.lamp_ratio_max, lamp_ratio_);
      if (std::abs(lamp_ratio_ - 1) > plan_.reference.max_drift && !options_.accept_drift) {
        Pause("drift");
        throw DeviceError(
            fmt::format("the lamp gives {:.4f} of its first reference, the plan allows a change of "
                        "{}; let it settle and "
                        "resume, or resume with --accept-drift",
                        lamp_ratio_, plan_.reference.max_drift));
      }
    }
    ++reference_number_;
    ++summary_.references;
  }

  // --- stopping ---

  void Pause(const std::string& reason) { session_.Append("paused", {{"reason", reason}}); }

  void PauseIfAsked(int count) {
    if (core::InterruptCount() < count) return;
    Pause(count == 1 ? "asked to pause" : "asked to stop");
    throw Interrupted(fmt::format("{}: paused after {} new positions; continue with --resume",
                                  session_.folder().string(), summary_.positions));
  }

  // Between two frames of a bracket only the second Ctrl-C counts.
  void StopIfAsked() {
    if (core::InterruptCount() < 2) return;
    devices_.camera->Abort();
    devices_.stage->Stop();
    PauseIfAsked(2);
  }

  const ExpandedPlan& expanded_;
  const Plan& plan_;
  hal::Devices& devices_;
  const hal::RigDescription& rig_;
  core::SessionWriter& session_;
  const CaptureOptions& options_;
  std::vector<char> usable_;
  CaptureSummary summary_;

  hal::AppliedSettings applied_;
  std::uint64_t last_id_ = 0;
  core::RawFrame last_image_;
  std::map<int, int> reference_rung_;  // by channel
  std::map<int, double> first_reference_rate_;
  int reference_number_ = 0;
  double lamp_ratio_ = 1;
};

}  // namespace

Json ToJson(const CaptureSummary& s) {
  return {{"positions", s.positions},
          {"positions_total", s.positions_total},
          {"frames", s.frames},
          {"rejected", s.rejected},
          {"flagged", s.flagged},
          {"references", s.references},
          {"lamp_ratio_min", s.lamp_ratio_min},
          {"lamp_ratio_max", s.lamp_ratio_max},
          {"rig_s", s.rig_s}};
}

CaptureSummary RunCapture(const Plan& plan, hal::Devices& devices,
                          const std::filesystem::path& folder, const CaptureOptions& options) {
  const ExpandedPlan expanded = ExpandPlan(plan, devices);
  CheckDiskAndSafety(expanded, devices, folder);
  const Json plan_json = ToJson(expanded);
  const bool resume = options.resume && core::SessionWriter::HasSession(folder);
  const SessionDescription description = DescribeSession(devices);
  core::SessionWriter session =
      resume ? core::SessionWriter::Resume(folder, plan_json, *devices.clock)
             : core::SessionWriter::Create(folder, plan_json, description.session,
                                           description.files, *devices.clock);
  if (session.journal_says_sealed()) {
    session.Seal("complete");
    CaptureSummary summary;
    summary.positions_total = static_cast<int>(expanded.positions.size());
    return summary;
  }
  return Run(expanded, devices, session, options).Capture();
}

core::SessionCheck VerifySession(const std::filesystem::path& folder) {
  core::SessionCheck check = core::VerifySession(folder);
  try {
    const core::SessionReader reader(folder);
    std::set<std::pair<int, int>> there;
    for (const FrameRecord& record : reader.frames())
      if (record.kind == FrameKind::kPosition) there.insert({record.i, record.j});
    const std::string file = (folder / "plan.json").string();
    int missing = 0;
    for (const Json& p : core::Field<Json>(reader.plan(), "positions", file))
      missing += !there.contains({core::Field<int>(p, "i", file), core::Field<int>(p, "j", file)});
    if (missing > 0)
      check.problems.push_back(fmt::format("{}: {} of {} positions are missing; resume the capture",
                                           folder.string(), missing,
                                           reader.plan()["positions"].size()));
  } catch (const InputError& error) {
    if (check.problems.empty()) check.problems.push_back(error.what());
  }
  return check;
}

}  // namespace luxfield::capture
