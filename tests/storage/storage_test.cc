// Sessions on a disk that fails: every call of the commit path refused in turn, the power cut after
// every call. Killing the process (tests/core, tests/capture) cannot show a missing fsync, as
// the system still writes what a killed process had written.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "luxfield/core/error.h"
#include "luxfield/session/session_check.h"
#include "luxfield/session/session_replay.h"
#include "tests/core/memory_folder.h"
#include "tests/seed.h"
#include "tests/session/small_session.h"
#include "tests/storage/disk_calls.h"
#include "tests/storage/power_failure.h"

namespace luxfield::disk {
namespace {

namespace fs = std::filesystem;
using session::Capture;
using session::Commits;

fs::path NewFolder() {
  static int counter = 0;
  const auto path = MemoryFolder() / fmt::format("luxfield_storage_{}_{}", ::getpid(), counter++);
  fs::remove_all(path);
  fs::create_directories(path);
  return path;
}

// What the program was told is done is there, and right.
void ExpectKept(const fs::path& session, const std::set<std::string>& done) {
  if (done.empty()) return;
  ASSERT_TRUE(session::SessionWriter::HasSession(session));
  const session::SessionReader reader(session);
  EXPECT_TRUE(reader.sealed() || !done.contains("sealed"));
  std::set<std::string> there = {"sealed"};
  for (std::size_t n = 0; n < reader.journal().size(); ++n) {
    if (reader.journal()[n]["type"] != "frame") continue;
    const auto record = session::FrameFromJson(reader.journal()[n], "journal");
    EXPECT_EQ(reader.ReadFrame(record).dn, session::ExpectedFrame(record).dn) << record.file;
    there.insert(record.file);
  }
  EXPECT_TRUE(std::includes(there.begin(), there.end(), done.begin(), done.end()))
      << "lost of: " << testing::PrintToString(done);
}

// The session can be gone on with, and is whole then.
void ExpectResumes(const fs::path& session, const std::set<std::string>& done,
                   session::Commits commits) {
  ExpectKept(session, done);
  ASSERT_NO_THROW(Capture(
      session, [](auto&) {}, commits));
  ExpectKept(session, done);
  const session::SessionCheck check = session::VerifySession(session);
  EXPECT_THAT(check.problems, testing::IsEmpty());
  EXPECT_TRUE(check.sealed);
  EXPECT_EQ(check.positions, session::kPositions);
}

std::string NameOf(session::Commits commits) {
  return commits == session::Commits::kBehind ? "behind" : "at_once";
}

// How many of the disk calls of a capture the suite tries; LUXFIELD_FAULTS=n tries n, or all there
// are.
constexpr std::size_t kSampledCalls = 30;
constexpr std::uint64_t kSeed = 20261122;

// Of 0 ... count - 1, ascending.
std::vector<int> SampledCalls(int count) {
  const char* wanted = std::getenv("LUXFIELD_FAULTS");
  const std::size_t most = wanted ? std::strtoul(wanted, nullptr, 10) : kSampledCalls;
  std::vector<int> calls(static_cast<std::size_t>(count));
  std::iota(calls.begin(), calls.end(), 0);
  core::Random random(kSeed, 0);
  for (std::size_t n = calls.size(); n > most; --n)
    calls.erase(calls.begin() + static_cast<std::ptrdiff_t>(random() % n));
  return calls;
}

int CallsOfACapture(session::Commits commits) {
  const auto folder = NewFolder();
  FailCall(-1, {});
  Capture(
      folder / "session", [](auto&) {}, commits);
  fs::remove_all(folder);
  return ClearFault().calls;
}

struct FaultCase {
  const char* name;
  Fault fault;
};

class AFailingDisk : public testing::TestWithParam<std::tuple<FaultCase, session::Commits>> {};

TEST_P(AFailingDisk, LosesNothingAndTheSessionResumes) {
  SCOPED_TRACE(fmt::format("seed {}", kSeed));
  const auto& [fault, commits] = GetParam();
  std::map<std::string, int> failed;
  int ended = 0, calls = 0;
  for (const int n : SampledCalls(CallsOfACapture(commits))) {
    const auto folder = NewFolder();
    std::set<std::string> done;
    FailCall(n, fault.fault);
    try {
      Capture(
          folder / "session", [&](const std::string& what) { done.insert(what); }, commits);
    } catch (const Error& error) {  // typed, and tells what to do
      EXPECT_THAT(error.what(), testing::HasSubstr(";"));
      ++ended;
    }
    const Reached reached = ClearFault();
    SCOPED_TRACE(fmt::format("call {}, {}", n, reached.failed));
    EXPECT_NE(reached.failed, "");
    ExpectResumes(folder / "session", done, commits);
    fs::remove_all(folder);
    if (HasFailure()) return;
    ++failed[reached.failed];
    ++calls;
  }
  for (const auto& [name, count] : failed) fmt::print("{} {}, ", count, name);
  fmt::print("{}, {}: {} of {} ended the capture, all resumed\n", fault.name, NameOf(commits),
             ended, calls);
  for (const char* name : {"write", "fsync", "fdatasync"}) EXPECT_GT(failed[name], 0) << name;
}

INSTANTIATE_TEST_SUITE_P(
    Storage, AFailingDisk,
    testing::Combine(testing::Values(FaultCase{"EIO", {EIO}}, FaultCase{"ENOSPC", {ENOSPC}},
                                     FaultCase{"EINTR", {EINTR}}, FaultCase{"EROFS", {EROFS}},
                                     FaultCase{"EROFS_from_then_on", {EROFS, true}},
                                     FaultCase{"ENOSPC_from_then_on", {ENOSPC, true}}),
                     testing::Values(session::Commits::kAtOnce, session::Commits::kBehind)),
    [](const auto& made) {
      return fmt::format("{}_{}", std::get<0>(made.param).name, NameOf(std::get<1>(made.param)));
    });

class AStoringDisk : public testing::TestWithParam<session::Commits> {};

INSTANTIATE_TEST_SUITE_P(Storage, AStoringDisk,
                         testing::Values(session::Commits::kAtOnce, session::Commits::kBehind),
                         [](const auto& made) { return NameOf(made.param); });

// Every write comes back short, or interrupted: no reason to end.
TEST_P(AStoringDisk, ShortAndInterruptedWritesAreFinished) {
  for (const int error : {0, EINTR})
    for (int n = 0;; ++n) {
      const auto folder = NewFolder();
      FailCall(n, {error});
      Reached reached;
      std::string ended;
      try {
        Capture(
            folder / "session", [](auto&) {}, GetParam());
        reached = ClearFault();
      } catch (const Error& failure) {
        reached = ClearFault();
        ended = failure.what();
      }
      if (reached.failed == "write" || reached.failed.empty()) {
        EXPECT_EQ(ended, "");
        EXPECT_THAT(session::VerifySession(folder / "session").problems, testing::IsEmpty());
        ExpectKept(folder / "session", {"sealed"});
      }
      fs::remove_all(folder);
      if (reached.failed.empty()) break;
    }
}

// Every instant with one outcome, as the seed has it; LUXFIELD_CRASHES=n tries n random outcomes of
// every instant beside the four of one kind.
TEST_P(AStoringDisk, SurvivesPowerFailuresAnywhere) {
  const char* wanted = std::getenv("LUXFIELD_CRASHES");
  const auto root = NewFolder();
  const auto calls = Record(root, [&] { Capture(root / "lamp/session", Mark, GetParam()); });
  fs::remove_all(root);
  core::Random random(TestSeed(kSeed), 0);
  int crashes = 0;
  std::set<std::string> done;
  for (std::size_t count = 0; count <= calls.size(); ++count) {
    if (count > 0 && calls[count - 1].kind == Call::Kind::kMark)
      done.insert(calls[count - 1].bytes);
    std::vector<Unsynced> cases = {Unsynced::kLost, Unsynced::kKept, Unsynced::kOnlyNamesKept,
                                   Unsynced::kOnlyBytesKept, Unsynced::kRandom};
    if (wanted)
      cases.insert(cases.end(), std::strtoul(wanted, nullptr, 10) - 1, Unsynced::kRandom);
    else
      cases = {cases[random() % cases.size()]};
    for (const Unsynced unsynced : cases) {
      SCOPED_TRACE(fmt::format("after call {} of {}, case {}", count, calls.size(), int(unsynced)));
      const auto folder = NewFolder();
      FailPower(calls, count, unsynced, random, folder);
      ExpectResumes(folder / "lamp/session", done, GetParam());
      fs::remove_all(folder);
      ++crashes;
      if (HasFailure()) return;
    }
  }
  fmt::print("{}: {} disk calls, {} power failures survived\n", NameOf(GetParam()), calls.size(),
             crashes);
  EXPECT_EQ(done.size(), 1u + session::kPositions * session::kExposures + 1);
}

// Behind the caller the next frame is written before the last one is in place.
TEST(Storage, FramesThatWaitAreWrittenBeforeTheLastIsInPlace) {
  const auto root = NewFolder();
  const auto calls = Record(root, [&] {
    Capture(
        root / "session", [](auto&) {}, session::Commits::kBehind);
  });
  fs::remove_all(root);
  int unnamed = 0, most = 0;
  for (const Call& call : calls) {
    if (!call.path.starts_with("session/frames/.")) continue;
    unnamed += call.kind == Call::Kind::kCreate;
    unnamed -= call.kind == Call::Kind::kRename;
    most = std::max(most, unnamed);
  }
  EXPECT_EQ(most, 2);
}

// The proof can fail: a commit whose folder is never synced loses the frame it said was done.
TEST_P(AStoringDisk, ThatIsNotSyncedIsFound) {
  const auto root = NewFolder();
  auto calls = Record(root, [&] { Capture(root / "lamp/session", Mark, GetParam()); });
  fs::remove_all(root);
  std::erase_if(calls, [](const Call& call) {
    return call.kind == Call::Kind::kSync && call.path.ends_with("frames");
  });
  core::Random random(1, 0);
  const auto folder = NewFolder();
  FailPower(calls, calls.size(), Unsynced::kLost, random, folder);
  EXPECT_THAT(session::VerifySession(folder / "lamp/session").problems,
              testing::Contains(testing::HasSubstr("is missing")));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::disk
