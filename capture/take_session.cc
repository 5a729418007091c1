#include "capture/take_session.h"

#include "capture/preflight.h"
#include "capture/session_description.h"

namespace luxfield::capture {

CaptureSummary TakeSession(
    const SessionToTake& what, hal::Devices& devices, const std::filesystem::path& folder,
    const CaptureOptions& options,
    const std::function<void(core::SessionWriter&, FrameTaker&, CaptureSummary&)>& take) {
  CheckDiskAndSafety(what.bytes, devices, folder);
  core::SessionWriter session = OpenSession(folder, what.plan, devices, options.resume);
  CaptureSummary summary;
  summary.positions_total = what.positions_total;
  if (session.journal_says_sealed()) {
    session.Seal("complete");
    return summary;
  }
  const double start = devices.clock->MonotonicSeconds();
  FrameTaker taker(devices, &session, what.ladder_s, what.max_attempts, options, summary);
  session.StartEpoch(DescribeDevices(devices));
  taker.Home();
  take(session, taker, summary);
  SwitchLampOff(devices);  // before every file is read again
  session.Seal("complete");
  summary.rig_s = devices.clock->MonotonicSeconds() - start;
  return summary;
}

}  // namespace luxfield::capture
