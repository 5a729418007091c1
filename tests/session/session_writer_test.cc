#include "luxfield/session/session_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <future>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/session_check.h"
#include "tests/seed.h"
#include "tests/session/session_folders.h"

namespace luxfield::session {
namespace {

namespace fs = std::filesystem;

TEST(SessionWriter, FramesCommittedBehindTheCallerAreThoseOfTheOthers) {
  std::string journals[2];
  for (const bool behind : {false, true}) {
    const auto folder = NewFolder("behind");
    core::SimulatedClock clock;
    auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
    writer.StartEpoch({});
    for (int e = 0; e < 20; ++e) {
      clock.SleepSeconds(1);
      FrameRecord record;
      record.i = record.j = 0;
      record.exposure_index = e;
      record.exposure_s = record.requested_exposure_s = 0.1 * (e + 1);
      if (behind)
        writer.CommitFrameBehind(record, std::make_shared<RawFrame>(TestFrame(0, e)), {{"e", e}});
      else
        writer.CommitFrame(record, TestFrame(0, e), {{"e", e}});
      if (e % 5 == 4) writer.Append("probe", {{"e", e}});
    }
    writer.CompletePosition(0, 0);
    writer.Seal("done");
    EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
    journals[behind] = core::ReadFile(folder / "journal.jsonl");
  }
  EXPECT_EQ(journals[0], journals[1]);
}

TEST(SessionWriter, AFrameThatCannotBeStoredBehindTheCallerIsToldByTheNextCall) {
  const auto folder = NewFolder("behind");
  core::SimulatedClock clock;
  auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
  writer.StartEpoch({});
  core::SetStorageHookForTest([](std::string_view) { throw DeviceError("the disk is full"); });
  writer.CommitFrameBehind({}, std::make_shared<RawFrame>(TestFrame(0, 0)), {});
  EXPECT_THROW(writer.CompletePosition(0, 0), DeviceError);
  core::SetStorageHookForTest({});
  EXPECT_TRUE(writer.committed_frames().empty());
}

// The frame before is on its way to the disk when the one that fails comes: it is not lost.
TEST(SessionWriter, FramesBeforeOneThatCannotBeStoredBehindTheCallerAreCommitted) {
  for (const std::string fails : {"temporary written", "renamed"}) {
    const auto folder = NewFolder("behind");
    core::SimulatedClock clock;
    auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
    writer.StartEpoch({});
    std::promise<void> all_wait;
    bool first = true;
    int seen = 0;
    core::SetStorageHookForTest([&](std::string_view step) {
      if (std::exchange(first, false)) all_wait.get_future().wait();
      if (step == fails && ++seen == 3) throw DeviceError("the disk is full");
    });
    for (int e = 0; e < 5; ++e) {
      FrameRecord record;
      record.i = record.j = 0;
      record.exposure_index = e;
      record.exposure_s = record.requested_exposure_s = 1;
      writer.CommitFrameBehind(record, std::make_shared<RawFrame>(TestFrame(0, e)), {});
    }
    all_wait.set_value();
    EXPECT_THROW(writer.CompletePosition(0, 0), DeviceError);
    core::SetStorageHookForTest({});
    const auto& committed = writer.committed_frames();
    ASSERT_EQ(committed.size(), 2u) << fails;
    EXPECT_EQ(committed[0].exposure_index, 0);
    EXPECT_EQ(committed[1].exposure_index, 1);
    for (const auto& entry : fs::directory_iterator(folder / "frames"))
      EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
  }
}

// Another process captures and seals between the look into the folder and the lock on it.
TEST(SessionWriter, ASessionMadeSinceTheFolderWasLookedIntoIsKept) {
  const auto folder = NewFolder("race");
  bool captured = false;
  core::SetStorageHookForTest([&](std::string_view step) {
    if (step == "looked" && !std::exchange(captured, true)) Capture(folder);
  });
  core::SimulatedClock clock;
  EXPECT_THROW(SessionWriter::Create(folder, kPlan, kSession, {}, clock), InputError);
  core::SetStorageHookForTest({});
  const auto report = VerifySession(folder);
  EXPECT_THAT(report.problems, testing::IsEmpty());
  EXPECT_TRUE(report.sealed);
}

// Whoever verifies a session while it is sealed finds no damage, at any step.
TEST(SessionWriter, ASessionThatIsBeingSealedHasNoProblems) {
  const auto folder = NewFolder("sealing");
  core::SimulatedClock clock;
  auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
  writer.StartEpoch({});
  int steps = 0;
  core::SetStorageHookForTest([&](std::string_view step) {
    ++steps;
    EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty()) << step;
  });
  writer.Seal("done");
  core::SetStorageHookForTest({});
  EXPECT_GT(steps, 3);
  EXPECT_TRUE(VerifySession(folder).sealed);
}

// RLIMIT_FSIZE stands in for a full disk: the write fails half way with EFBIG.
TEST(SessionWriter, ADiskThatFillsUpIsADeviceErrorAndLosesNothing) {
  const auto folder = NewFolder("full");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    core::SimulatedClock clock;
    int result = 1;
    try {
      auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
      const rlimit limit{2000, 2000};  // the journal passes it in the middle of a line
      ::setrlimit(RLIMIT_FSIZE, &limit);
      CaptureRest(writer);
    } catch (const DeviceError&) {
      result = 0;
    } catch (...) {
      result = 2;
    }
    ::_exit(result);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  core::SimulatedClock clock;
  EXPECT_TRUE(ReadJournal(folder / "journal.jsonl").torn);
  auto writer = SessionWriter::Resume(folder, kPlan, clock);
  CaptureRest(writer);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

// Runs a capture in a child process that kills itself at the given storage step; false if it
// finished before.
bool CaptureKilledAt(const fs::path& folder, int step) {
  const pid_t child = ::fork();
  if (child == 0) {
    int count = 0;
    core::SetStorageHookForTest([&](std::string_view) {
      if (count++ == step) ::kill(::getpid(), SIGKILL);
    });
    try {
      Capture(folder);
    } catch (...) {
      ::_exit(1);
    }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0) << "step " << step;
  return WIFSIGNALED(status);
}

// LUXFIELD_KILLS=n runs n sessions instead of 20.
TEST(SessionWriter, KilledAnywhereItResumesAndVerifies) {
  const char* wanted = std::getenv("LUXFIELD_KILLS");
  const int sessions = wanted ? std::atoi(wanted) : 20;
  const std::uint64_t seed = TestSeed(20140611);
  int total_kills = 0;
  for (int n = 0; n < sessions; ++n) {
    const auto folder = NewFolder("killed");
    core::Random random(seed, n);
    int kills = 0;
    bool finished = false;
    while (kills < 6 && !finished) {
      finished = !CaptureKilledAt(folder, static_cast<int>(random.Uniform() * 70));
      if (!finished) ++kills;
    }
    if (!finished) {
      ASSERT_FALSE(CaptureKilledAt(folder, 1 << 30));
    }
    total_kills += kills;
    const SessionCheck check = VerifySession(folder);
    EXPECT_THAT(check.problems, testing::IsEmpty())
        << "session " << n << " after " << kills << " kills";
    EXPECT_EQ(check.positions, kPositions);
    const SessionReader reader(folder);
    for (const auto& record : reader.frames())
      if (record.kind == FrameKind::kPosition) {
        EXPECT_EQ(reader.ReadFrame(record).dn, TestFrame(record.i, record.exposure_index).dn);
      }
    fs::remove_all(folder);
  }
  EXPECT_GE(total_kills, sessions);
}

}  // namespace
}  // namespace luxfield::session
