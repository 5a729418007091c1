#include "luxfield/capture/take/take_session.h"

#include <algorithm>
#include <exception>
#include <system_error>

#include "luxfield/capture/take/preflight.h"
#include "luxfield/capture/take/session_description.h"
#include "luxfield/core/json.h"
#include "luxfield/hal/error.h"
#include "luxfield/session/session_store.h"

namespace luxfield::capture {

std::uint64_t BytesToCome(std::uint64_t planned, const std::filesystem::path& folder) {
  const session::SessionReader session(folder);
  std::uint64_t kept = 0;
  for (const session::FrameRecord& frame : session.frames()) {
    if (frame.kind == session::FrameKind::kDark || frame.kind == session::FrameKind::kReference)
      continue;
    std::error_code missing;  // verify tells
    const std::uintmax_t bytes = std::filesystem::file_size(folder / frame.file, missing);
    if (!missing) kept += bytes;
  }
  return planned - std::min(planned, kept);
}

namespace {

// What ended the run, for whoever reads the session later. A trip of the inputs the taker has
// noted; a stage that was stopped without one was stopped at the machine.
void NoteFailure(session::SessionWriter& session, const hal::HardwareError& error,
                 const hal::Stage& stage) {
  if (error.fault == hal::Fault::kStopped && error.device != stage.identity()) return;
  try {
    session.Append("paused", {{"reason", error.what()}});
  } catch (const std::exception&) {  // the device's error is the one to tell
  }
}

}  // namespace

CaptureSummary TakeSession(
    const SessionToTake& what, hal::Devices& devices, const std::filesystem::path& folder,
    const CaptureOptions& options,
    const std::function<void(session::SessionWriter&, FrameTaker&, CaptureSummary&)>& take) {
  const bool resumed = options.resume && session::SessionWriter::HasSession(folder);
  if (!resumed) CheckDiskAndSafety(what.bytes, devices, folder);  // before a folder is made
  session::SessionWriter session = OpenSession(folder, what.plan, devices, options.resume);
  CaptureSummary summary;
  summary.positions_total = what.positions_total;
  if (session.journal_says_sealed()) {
    session.Seal("complete");
    return summary;
  }
  if (resumed) CheckDiskAndSafety(BytesToCome(what.bytes, folder), devices, folder);
  const double start = devices.clock->MonotonicSeconds();
  FrameTaker taker(devices, &session, what.ladder_s, what.max_attempts, options, summary);
  session.StartEpoch(DescribeDevices(devices));
  try {
    taker.Home();
    take(session, taker, summary);
  } catch (const hal::HardwareError& error) {
    NoteFailure(session, error, *devices.stage);
    throw;
  }
  SwitchLampOff(devices);  // before every file is read again
  session.Seal("complete");
  summary.rig_s = devices.clock->MonotonicSeconds() - start;
  return summary;
}

}  // namespace luxfield::capture
