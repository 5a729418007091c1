#include "luxfield/capture/take/capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "luxfield/capture/plan/bracket_rungs.h"
#include "luxfield/capture/take/frame_taker.h"
#include "luxfield/capture/take/lamp_pulses.h"
#include "luxfield/capture/take/missing_frames.h"
#include "luxfield/capture/take/preflight.h"
#include "luxfield/capture/take/probe_rate.h"
#include "luxfield/capture/take/session_description.h"
#include "luxfield/capture/take/take_session.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/pause.h"
#include "luxfield/core/progress.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/plan_json.h"
#include "luxfield/session/session_writer.h"

namespace luxfield::capture {
namespace {

using core::Json;
using session::FrameKind;
using session::FrameRecord;

// One run over one session.
class Run {
 public:
  Run(const ExpandedPlan& expanded, hal::Devices& devices, session::SessionWriter& session,
      FrameTaker& taker, CaptureSummary& summary, const CaptureOptions& options)
      : expanded_(expanded),
        plan_(expanded.plan),
        devices_(devices),
        rig_(devices.rig),
        session_(session),
        options_(options),
        taker_(taker),
        summary_(summary) {}

  void Capture() {
    RecallReferences();
    Announce(Pending());
    taker_.WarmUpLamp(plan_.warm_up);
    CheckDarkLevel();
    CheckFlicker();
    for (Epoch end = TakeEpoch(); end != Epoch::kComplete; end = TakeEpoch()) {
      if (end == Epoch::kDrift)
        WaitInsideBand();
      else
        WaitForUser();
      session_.StartEpoch(DescribeDevices(devices_));
      Announce(Pending());
    }
  }

 private:
  // How an epoch ends: the session is complete, a reference is outside the band, or the user wants
  // to pause.
  enum class Epoch { kComplete, kDrift, kPause };

  // Takes all that the session lacks, as far as it comes.
  Epoch TakeEpoch() {
    const std::vector<PlannedPosition> pending = Pending();
    core::Progress progress("capture", pending.size());
    TakeDarks(0);
    const auto every = static_cast<std::size_t>(plan_.reference.every);
    for (std::size_t n = 0; n < pending.size(); ++n) {
      if (every > 0 && n % every == 0 && !TakeReference()) return Epoch::kDrift;
      taker_.PauseIfAsked(1);
      if (core::PauseWanted()) return Epoch::kPause;
      TakePosition(pending[n]);
      progress.Advance(
          1, fmt::format("{} frames, {} rejected, {} flagged, lamp {:.4f}", summary_.frames,
                         summary_.rejected, summary_.flagged, lamp_ratio_));
    }
    if (every > 0 && !pending.empty() && !TakeReference()) return Epoch::kDrift;
    TakeDarks(plan_.dark_repeats);
    return Epoch::kComplete;
  }

  std::vector<PlannedPosition> Pending() const {
    std::vector<PlannedPosition> pending;
    for (const PlannedPosition& p : expanded_.positions)
      if (!session_.PositionComplete(p.i, p.j)) pending.push_back(p);
    return pending;
  }

  // Tells the rig what is coming.
  void Announce(const std::vector<PlannedPosition>& pending) {
    if (!devices_.announce) return;
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

  void CheckDarkLevel() {
    taker_.SelectShutter("closed");
    taker_.Configure(0);
    const FrameStatistics s = taker_.Statistics(taker_.Expose().image);
    const rig::SensorModel& c = rig_.camera;
    const double expected =
        c.black_dn + c.gain_dn_per_e * c.dark_current_e_per_s * expanded_.ladder_s.front();
    if (std::abs(s.mean_dn - expected) > 0.01 * (c.saturation_dn - c.black_dn) + c.read_noise_dn)
      throw DeviceError(
          fmt::format("{}: the dark level is {:.1f} DN where the calibration says {:.1f}; close "
                      "the shutter, keep "
                      "light out, or calibrate again",
                      devices_.camera->identity(), s.mean_dn, expected));
  }

  // Where the capture begins, at the exposure of the references: the shortest a bright place gets.
  void CheckFlicker() {
    const auto pending = Pending();
    if (plan_.exposure.flicker == 0 || pending.empty()) return;
    FaceLamp(taker_, plan_.reference.every > 0 ? expanded_.reference : pending.front().centre);
    FrameRecord record;
    record.kind = FrameKind::kReference;
    record.exposure_index = ReferenceRung(record);
    const double stated_hz = PwmHz(plan_.exposure, rig_);
    const LampPulses pulses =
        LookForPulses(taker_, devices_, record, plan_.exposure.flicker, stated_hz > 0);
    session_.Append("flicker", ToJson(pulses, stated_hz));
    RequireSteadyFrames(pulses, stated_hz, plan_.exposure);
  }

  // Exposures at which references compare.
  int ReferenceRung(const FrameRecord& place) {
    if (!reference_rung_.contains(place.channel))
      reference_rung_[place.channel] = ChooseRungs(ProbeRate(taker_, place, expanded_, rig_.camera),
                                                   expanded_.ladder_s, plan_.exposure, rig_.camera)
                                           .first;
    return reference_rung_[place.channel];
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

  void TakeDarks(int first_repeat) {
    taker_.SelectShutter("closed");
    for (int rung = 0; rung < static_cast<int>(expanded_.ladder_s.size()); ++rung) {
      taker_.Configure(rung);
      for (int repeat = 0; repeat < plan_.dark_repeats; ++repeat) {
        taker_.PauseIfAsked(1);
        FrameRecord record;
        record.kind = FrameKind::kDark;
        record.exposure_index = rung;
        record.repeat = first_repeat + repeat;
        taker_.Commit(record, taker_.Shoot(record));
      }
    }
    taker_.SelectShutter("open");
  }

  void TakeBracket(const PlannedPosition& p, int print, int channel) {
    FrameRecord record;
    record.i = p.i;
    record.j = p.j;
    record.print = print;
    record.channel = channel;
    const Rungs rungs = ChooseRungs(ProbeRate(taker_, record, expanded_, rig_.camera),
                                    expanded_.ladder_s, plan_.exposure, rig_.camera);
    session_.Append("bracket", {{"i", p.i},
                                {"j", p.j},
                                {"print", print},
                                {"channel", channel},
                                {"first", rungs.first},
                                {"last", rungs.last}});
    std::shared_ptr<const session::RawFrame> shorter;
    double shorter_exposure_s = 0;
    for (int rung = rungs.first; rung <= rungs.last; ++rung) {
      record.exposure_index = rung;
      taker_.Configure(rung);
      for (record.repeat = 0; record.repeat < plan_.exposure.repeats; ++record.repeat) {
        const auto doubt = [&](const Shot& shot) -> std::string {
          if (rung == rungs.first && shot.statistics.saturated_share > 0)
            return fmt::format("{:.3g} of the pixels saturated in the shortest exposure",
                               shot.statistics.saturated_share);
          if (!shorter) return {};
          const auto ratio =
              LevelRatio(*shot.image, shot.frame.settings.exposure_s, *shorter, shorter_exposure_s,
                         taker_.usable(), rig_.camera, plan_.exposure.mean_tolerance);
          if (ratio && std::abs(*ratio - 1) > plan_.exposure.mean_tolerance)
            return fmt::format("level is {:.3g} of what the shorter exposure predicts", *ratio);
          return {};
        };
        const Shot shot = taker_.Shoot(record, doubt);
        taker_.Commit(record, shot);
        if (record.repeat + 1 == plan_.exposure.repeats && !shot.flagged) {
          shorter_exposure_s = shot.frame.settings.exposure_s;
          shorter = shot.image;
        }
      }
    }
  }

  void TakePosition(const PlannedPosition& p) {
    taker_.MoveTo(p.centre);
    for (int print = 0; print < expanded_.prints; ++print) {
      taker_.SelectPrint(print);
      for (int channel = 0; channel < expanded_.channels_in_turn; ++channel) {
        taker_.SelectChannel(channel);
        TakeBracket(p, print, channel);
      }
    }
    taker_.CompletePosition(p.i, p.j);
    finished_.insert({p.i, p.j});
    summary_.positions = static_cast<int>(finished_.size());
  }

  struct Reference {
    FrameRecord record;
    Shot shot;
    double rate = 0, ratio = 1;  // mean signal, DN per second; over that of the first reference
  };

  // One frame per channel where the stage stands.
  std::vector<Reference> ShootReference() {
    std::vector<Reference> references;
    taker_.SelectPrint(0);
    for (int channel = 0; channel < expanded_.channels_in_turn; ++channel) {
      taker_.SelectChannel(channel);
      FrameRecord record;
      record.kind = FrameKind::kReference;
      record.channel = channel;
      record.repeat = reference_number_;
      record.exposure_index = ReferenceRung(record);
      taker_.Configure(record.exposure_index);
      const Shot shot = taker_.Shoot(record);
      const double rate =
          (shot.statistics.mean_dn - rig_.camera.black_dn) / shot.frame.settings.exposure_s;
      const double first = first_reference_rate_.try_emplace(channel, rate).first->second;
      references.push_back({record, shot, rate, first > 0 ? rate / first : 1});
    }
    return references;
  }

  static const Reference& FarthestOff(const std::vector<Reference>& references) {
    return *std::max_element(references.begin(), references.end(),
                             [](const Reference& a, const Reference& b) {
                               return std::abs(a.ratio - 1) < std::abs(b.ratio - 1);
                             });
  }

  // False: outside the band, and what was taken since the last one inside it no longer counts.
  bool TakeReference() {
    taker_.PauseIfAsked(1);
    taker_.MoveTo(expanded_.reference);
    const std::vector<Reference> references = ShootReference();
    for (const Reference& r : references) {
      lamp_ratio_ = r.ratio;
      summary_.lamp_ratio_min = std::min(summary_.lamp_ratio_min, lamp_ratio_);
      summary_.lamp_ratio_max = std::max(summary_.lamp_ratio_max, lamp_ratio_);
      taker_.Commit(r.record, r.shot);
    }
    taker_.LogSupply();
    ++reference_number_;
    ++summary_.references;
    const Reference& worst = FarthestOff(references);
    if (std::abs(worst.ratio - 1) > plan_.reference.max_drift && !options_.accept_drift) {
      for (const auto& position : session_.Suspend(
               {{"reason", "drift"}, {"channel", worst.record.channel}, {"ratio", worst.ratio}}))
        finished_.erase(position);
      summary_.positions = static_cast<int>(finished_.size());
      ++summary_.suspensions;
      return false;
    }
    for (const Reference& r : references)
      session_.AcceptReference({{"number", r.record.repeat},
                                {"channel", r.record.channel},
                                {"mean_rate", r.rate},
                                {"ratio", r.ratio}});
    return true;
  }

  // Paused: the stage at rest, the lamp off, the inputs watched, until the user wants to go on.
  void WaitForUser() {
    taker_.Pause("asked to wait");
    SwitchLampOff(devices_);
    const double start = devices_.clock->MonotonicSeconds();
    while (core::PauseWanted()) taker_.Rest(1);
    session_.Append("resumed", {{"waited_s", devices_.clock->MonotonicSeconds() - start}});
    taker_.WarmUpLamp(plan_.warm_up);
    CheckDarkLevel();
  }

  // Suspended: looks at the reference, the stage at rest and the lamp on, until all its channels
  // are inside the narrower band.
  void WaitInsideBand() {
    const ReferencePolicy& policy = plan_.reference;
    const double start = devices_.clock->MonotonicSeconds();
    for (;;) {
      taker_.Rest(policy.interval_s);
      const Reference worst = FarthestOff(ShootReference());
      session_.Append("drift", {{"channel", worst.record.channel}, {"ratio", worst.ratio}});
      const double waited_s = devices_.clock->MonotonicSeconds() - start;
      if (std::abs(worst.ratio - 1) <= policy.resume_share * policy.max_drift) {
        session_.Append("resumed", {{"waited_s", waited_s}});
        return;
      }
      if (waited_s < policy.max_wait_s) continue;
      taker_.Pause("drift");
      throw DeviceError(fmt::format(
          "the lamp gives {:.4f} of its first reference after {} of waiting, the plan goes on "
          "within {}; let it settle and resume, or resume with --accept-drift",
          worst.ratio, core::FormatDuration(waited_s), policy.resume_share * policy.max_drift));
    }
  }

  const ExpandedPlan& expanded_;
  const Plan& plan_;
  hal::Devices& devices_;
  const rig::RigDescription& rig_;
  session::SessionWriter& session_;
  const CaptureOptions& options_;
  FrameTaker& taker_;
  CaptureSummary& summary_;

  std::map<int, int> reference_rung_;  // by channel
  std::map<int, double> first_reference_rate_;
  int reference_number_ = 0;
  double lamp_ratio_ = 1;
  std::set<std::pair<int, int>> finished_;  // positions, in this run
};

}  // namespace

Json ToJson(const CaptureSummary& s) {
  return {{"positions", s.positions},
          {"positions_total", s.positions_total},
          {"frames", s.frames},
          {"rejected", s.rejected},
          {"flagged", s.flagged},
          {"references", s.references},
          {"suspensions", s.suspensions},
          {"lamp_ratio_min", s.lamp_ratio_min},
          {"lamp_ratio_max", s.lamp_ratio_max},
          {"rig_s", s.rig_s}};
}

CaptureSummary RunCapture(const Plan& plan, hal::Devices& devices,
                          const std::filesystem::path& folder, const CaptureOptions& options) {
  const ExpandedPlan expanded = ExpandPlan(
      plan.exposure.measure_pwm ? WithPwmHz(plan, devices, folder, options) : plan, devices);
  const SessionToTake what{ToJson(ToPlanFile(expanded)), DryRun(expanded, devices).bytes,
                           expanded.ladder_s, plan.exposure.max_attempts,
                           static_cast<int>(expanded.positions.size())};
  return TakeSession(
      what, devices, folder, options,
      [&](session::SessionWriter& session, FrameTaker& taker, CaptureSummary& summary) {
        Run(expanded, devices, session, taker, summary, options).Capture();
      });
}

session::SessionCheck VerifySession(const std::filesystem::path& folder) {
  session::SessionCheck check = session::VerifySession(folder);
  try {
    const session::SessionReader reader(folder);
    const int missing = MissingFrames(reader);
    if (missing > 0)
      check.problems.push_back(
          fmt::format("{}: {} of the plan's positions or frames are missing; "
                      "resume the capture",
                      folder.string(), missing));
  } catch (const InputError& error) {
    if (check.problems.empty()) check.problems.push_back(error.what());
  }
  return check;
}

}  // namespace luxfield::capture
