// The devices of a rig and the session they fill, for every kind of capture: settings that are read
// back, frames that are checked and taken again, stops between them. While a taker lives, a trip of
// the safety inputs stops the stage and switches the lamp off (hal/safety/safety_guard.h); what the
// taker was to do then pauses the session and throws HardwareError(kStopped). It can be resumed.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/capture/take/capture.h"
#include "luxfield/capture/take/frame_check.h"
#include "luxfield/hal/safety/safety_guard.h"
#include "luxfield/session/session_writer.h"

namespace luxfield::capture {

struct Shot {
  hal::Frame frame;  // but its pixels:
  std::shared_ptr<const session::RawFrame> image;
  FrameStatistics statistics;
  double meter = 0;
  bool flagged = false;
  std::string reason;  // of the flag
  int attempt = 0;
};

class FrameTaker {
 public:
  // `summary` counts frames, rejected and flagged ones; `ladder_s` are the exposures that rungs
  // name. All must outlive the taker. Without a session nothing is journalled or committed.
  FrameTaker(hal::Devices& devices, session::SessionWriter* session,
             const std::vector<double>& ladder_s, int max_attempts, const CaptureOptions& options,
             CaptureSummary& summary);

  // Selectors that a rig lacks are passed over.
  void SelectShutter(const std::string& position);
  void SelectChannel(int channel);
  void SelectPrint(int print);
  void SelectTarget(const std::string& target);
  // Lamp on and stable (WaitForLamp); the journal's `warm_up` and `supply`.
  void WarmUpLamp(const WarmUpPolicy& policy);
  // What the lamp's supply measures, where it does; the journal's `supply`.
  void LogSupply();
  // Home and stand still; the journal's `home`.
  void Home();
  void MoveTo(hal::Vec2 centre);
  // Exposure time of a rung; HardwareError if the camera reads back another.
  void Configure(int rung) { ConfigureExposure(ladder_s_[rung]); }
  void ConfigureExposure(double exposure_s);
  double exposure_s() const { return applied_.exposure_s; }
  hal::Frame Expose();
  FrameStatistics Statistics(const session::RawFrame& frame) const;
  const std::vector<PixelRun>& usable() const { return usable_; }

  // Exposes with the present settings until a frame passes, at most max_attempts times; a frame
  // that is not fresh after them is a HardwareError; one that `doubt` objects to (its sentence, or
  // empty), or whose monitor was over range, below 0 or gave no number, or read values before and
  // after it that are further apart than the lamp may vary in its warm-up, is flagged, without a
  // monitor's reading in the latter cases. `place` names the frame in the journal, and of darks the
  // monitor does not matter.
  using Doubt = std::function<std::string(const Shot&)>;
  Shot Shoot(const session::FrameRecord& place, const Doubt& doubt = {});
  // One more frame of the session, stored while the next one is taken; the record's exposure_index
  // is the rung. Throws HardwareError with position_lost, and keeps nothing, where the stage no
  // longer knows where it is, or does not stand where it stood for the frames before; of a position
  // it is asked for the first frame and by CompletePosition, before which none of them counts.
  void Commit(session::FrameRecord record, const Shot& shot);
  void CompletePosition(int i, int j);

  // A line of the session's journal.
  void Note(const std::string& type, const nlohmann::json& fields);

  // Stands still for so long; ends, as everything else, with a trip of the inputs and with Ctrl-C.
  void Rest(double duration_s);

  void Pause(const std::string& reason);
  // Interrupted once core::InterruptCount() has reached `count`; the session can be resumed.
  void PauseIfAsked(int count);

 private:
  template <typename Action>
  void PauseWhereStopped(Action&& action);
  template <typename Action>
  void Drive(Action&& action);
  void RequireSafe();
  hal::HardwareError Lost(hal::Fault fault, const std::string& problem) const;
  hal::StagePosition AskStage();
  hal::Vec2 WhereItStands();
  double ReadMonitor();
  std::string JudgeMonitor(const session::FrameRecord& place, double before, double after,
                           Shot& shot) const;
  std::string Distrust(const Shot& shot, double asked_at_s) const;
  void StopIfAsked();
  void WatchClock();

  hal::Devices& devices_;
  session::SessionWriter* session_;
  const std::vector<double>& ladder_s_;
  const int max_attempts_;
  const CaptureOptions& options_;
  CaptureSummary& summary_;
  std::vector<PixelRun> usable_;
  hal::SafetyGuard guard_;
  hal::AppliedSettings applied_;
  double lamp_variation_ =
      std::numeric_limits<double>::infinity();  // relative; none before warm-up
  double clock_offset_s_;
  std::optional<hal::Vec2> stands_at_;  // of the first frame since the last move
  std::uint64_t last_id_ = 0;
  std::shared_ptr<const session::RawFrame> last_image_ = std::make_shared<session::RawFrame>();
};

}  // namespace luxfield::capture
