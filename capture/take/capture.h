// Plan and rig -> session.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/hal/devices.h"
#include "luxfield/session/session_check.h"

namespace luxfield::capture {

struct CaptureSummary {
  int positions = 0;        // finished in this run
  int positions_total = 0;  // of the plan
  int frames = 0, rejected = 0, flagged = 0;
  int references = 0;
  int suspensions = 0;                            // for drift
  double lamp_ratio_min = 1, lamp_ratio_max = 1;  // references over the session's first
  double rig_s = 0;                               // time on the rig's clock
};
nlohmann::json ToJson(const CaptureSummary& summary);

struct CaptureOptions {
  bool resume = false;  // continue the session in the folder (or begin one if it holds none yet)
  bool accept_drift = false;  // whatever the references say: never suspend
  std::function<void(const CaptureSummary&)> on_frame;  // after every frame handed to storage
};

// Captures everything the plan lacks and seals the session: warm-up, dark level, a look for
// flicker, darks at every exposure time, then the positions with drift references between, darks
// again. A frame that fails its checks is taken again at most max_attempts times, then kept and
// flagged. A reference beyond max_drift suspends the capture until one is within resume_share of
// that; a new epoch then begins with darks and a reference, and what was taken since the last good
// reference is taken again.
//
// While core::PauseWanted() the capture rests before the next position, the lamp off; it goes on
// with warm-up and a new epoch. core::InterruptCount() 1 finishes the bracket at hand, 2 stops
// after the frame at hand; both leave a session that can be resumed and throw Interrupted. On
// resume the stage is homed again and a new epoch begins with darks and a reference; finished
// brackets stay, a broken one is retaken whole.
//
// Throws InputError (plan and rig disagree, folder in use or of another plan), DeviceError (disk
// full, lamp not stable or flickering, drift for longer than reference.max_wait_s),
// hal::HardwareError.
CaptureSummary RunCapture(const Plan& plan, hal::Devices& devices,
                          const std::filesystem::path& session_folder,
                          const CaptureOptions& options = {});

// core::VerifySession, and whether every planned position, or frame of a sensor plan, is there.
session::SessionCheck VerifySession(const std::filesystem::path& session_folder);

}  // namespace luxfield::capture
