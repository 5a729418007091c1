// A session of three positions and two exposures, for tests of how sessions are stored.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/session/session_writer.h"

namespace luxfield::session {

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

const core::Json kPlan = {{"positions", 3}};
const core::Json kSession = {{"camera", {{"bits", 12}}}};
constexpr int kPositions = 3, kExposures = 2;

// How a capture hands frames to its session. Captures proper do it behind.
enum class Commits { kAtOnce, kBehind };

// Keeps storage waiting until a bracket's frames are all handed over: the calls to the disk then
// come in the same order every time, the next frame's before the last one's is in place.
class StorageGate {
 public:
  static StorageGate& Instance() {
    static StorageGate gate;
    return gate;
  }
  // From now on storage passes the gate. For a time in which nothing is stored.
  void Install() {
    core::SetStorageHookForTest([this](std::string_view) {
      std::unique_lock lock(mutex_);
      opened_.wait(lock, [this] { return open_; });
    });
  }

  class Closed {
   public:
    Closed() { Instance().Set(false); }
    ~Closed() { Instance().Set(true); }
    Closed(const Closed&) = delete;
    Closed& operator=(const Closed&) = delete;
  };

 private:
  void Set(bool open) {
    const std::lock_guard lock(mutex_);
    open_ = open;
    opened_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable opened_;
  bool open_ = true;
};

using Done = std::function<void(const std::string& what)>;

// Captures what is not there yet and seals. `done` hears of every frame when it is committed, for
// certain, and of "sealed".
inline void CaptureRest(
    SessionWriter& writer, const Done& done = [](auto&) {}, Commits commits = Commits::kAtOnce) {
  if (!writer.journal_says_sealed()) {
    const bool behind = commits == Commits::kBehind;
    std::vector<int> missing;
    for (int i = 0; i < kPositions; ++i)
      if (!writer.PositionComplete(i, 0)) missing.push_back(i);
    std::size_t told = writer.committed_frames().size();
    const auto tell = [&] {
      for (; told < writer.committed_frames().size(); ++told)
        done(writer.committed_frames()[told].file);
    };
    const auto commit = [&](const FrameRecord& record, const RawFrame& frame,
                            const core::Json& checks) {
      if (behind)
        return writer.CommitFrameBehind(record, std::make_shared<RawFrame>(frame), checks);
      writer.CommitFrame(record, frame, checks);
      tell();
    };
    writer.StartEpoch({{"camera", "test"}});
    if (behind) StorageGate::Instance().Install();
    std::optional<StorageGate::Closed> gate;
    if (behind) gate.emplace();
    FrameRecord dark;
    dark.kind = FrameKind::kDark;
    dark.exposure_s = dark.requested_exposure_s = 0.1;
    commit(dark, TestFrame(9, 0), {});
    for (const int i : missing) {
      if (behind && !gate) gate.emplace();
      for (int e = 0; e < kExposures; ++e) {
        FrameRecord record;
        record.i = i;
        record.j = 0;
        record.exposure_index = e;
        record.exposure_s = record.requested_exposure_s = 0.1 * (1 << e);
        commit(record, TestFrame(i, e), {{"mean_dn", 1.5}});
      }
      gate.reset();
      writer.CompletePosition(i, 0);
      tell();
    }
    gate.reset();
    tell();
  }
  writer.Seal("done");
  done("sealed");
}

// Begins, or goes on with, the session of a folder, and ends it.
inline void Capture(
    const std::filesystem::path& folder, const Done& done = [](auto&) {},
    Commits commits = Commits::kAtOnce) {
  core::SimulatedClock clock;
  if (std::filesystem::exists(folder / "manifest.json")) return;
  auto writer = SessionWriter::HasSession(folder)
                    ? SessionWriter::Resume(folder, kPlan, clock)
                    : SessionWriter::Create(folder, kPlan, kSession, {}, clock);
  CaptureRest(writer, done, commits);
}

}  // namespace luxfield::session
