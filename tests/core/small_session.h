// A session of three positions and two exposures, for tests of how sessions are stored.
#pragma once

#include <functional>
#include <string>

#include "core/json.h"
#include "core/session_writer.h"

namespace luxfield::core {

inline RawFrame TestFrame(int position, int exposure) {
  RawFrame frame;
  frame.width = 5;
  frame.height = 3;
  for (int pixel = 0; pixel < 15; ++pixel)
    frame.dn.push_back(static_cast<std::uint16_t>(1000 * position + 100 * exposure + pixel));
  return frame;
}

// Of a position, or of the dark.
inline RawFrame ExpectedFrame(const FrameRecord& record) {
  return record.kind == FrameKind::kDark ? TestFrame(9, 0)
                                         : TestFrame(record.i, record.exposure_index);
}

const Json kPlan = {{"positions", 3}};
const Json kSession = {{"camera", {{"bits", 12}}}};
constexpr int kPositions = 3, kExposures = 2;

// Captures what is not there yet and seals. `done` hears of every frame when it is committed, and
// of "sealed".
inline void CaptureRest(
    SessionWriter& writer,
    const std::function<void(const std::string& what)>& done = [](auto&) {}) {
  if (!writer.journal_says_sealed()) {
    writer.StartEpoch({{"camera", "test"}});
    FrameRecord dark;
    dark.kind = FrameKind::kDark;
    dark.exposure_s = dark.requested_exposure_s = 0.1;
    done(writer.CommitFrame(dark, TestFrame(9, 0), {}).file);
    for (int i = 0; i < kPositions; ++i) {
      if (writer.PositionComplete(i, 0)) continue;
      for (int e = 0; e < kExposures; ++e) {
        FrameRecord record;
        record.i = i;
        record.j = 0;
        record.exposure_index = e;
        record.exposure_s = record.requested_exposure_s = 0.1 * (1 << e);
        done(writer.CommitFrame(record, TestFrame(i, e), {{"mean_dn", 1.5}}).file);
      }
      writer.CompletePosition(i, 0);
    }
  }
  writer.Seal("done");
  done("sealed");
}

// Begins, or goes on with, the session of a folder, and ends it.
inline void Capture(
    const std::filesystem::path& folder,
    const std::function<void(const std::string& what)>& done = [](auto&) {}) {
  SimulatedClock clock;
  if (std::filesystem::exists(folder / "manifest.json")) return;
  auto writer = SessionWriter::HasSession(folder)
                    ? SessionWriter::Resume(folder, kPlan, clock)
                    : SessionWriter::Create(folder, kPlan, kSession, {}, clock);
  CaptureRest(writer, done);
}

}  // namespace luxfield::core
