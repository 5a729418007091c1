// The program killed in the middle of captures, and resumed.
//
//   LUXFIELD_KILLS=1000 build/release/e2e_test --gtest_filter='KilledCapture.*'
//
// kills at 1000 random instants, and at every call that changes the disk (there are fewer), in
// place of 50 each.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <map>
#include <thread>

#include "field_agreement.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "luxfield/reconstruct/solve/reconstruct.h"
#include "luxfield/session/journal.h"
#include "program.h"
#include "tests/core/memory_folder.h"
#include "tests/seed.h"
#include "tiny_session.h"

namespace luxfield::e2e {
namespace {

namespace fs = std::filesystem;

class KilledCapture : public testing::Test {
 protected:
  void SetUp() override {
    WriteText(folder_ / "lab.toml", TinyLab(0.05, 0.5));
    WriteText(folder_ / "plan.toml", TinyPlan(3, 3));
    ASSERT_EQ(Wait(Start("undisturbed", {})), 0);
    undisturbed_ = FieldOf("undisturbed");
    whole_journal_ = fs::file_size(folder_ / "undisturbed" / "journal.jsonl");
  }
  void TearDown() override {
    if (!HasFailure()) fs::remove_all(folder_);
  }

  static int KillsWanted() {
    const char* wanted = std::getenv("LUXFIELD_KILLS");
    return wanted ? std::atoi(wanted) : 50;
  }

  using Settings = std::map<std::string, std::string>;  // of the environment
  // Begins the capture of a session, or goes on with it.
  pid_t Start(const std::string& session, const Settings& settings) const {
    const std::string program = BuiltProgram("luxfield"), folder = folder_;
    const bool begun = fs::exists(folder_ / session);  // what is not there cannot be resumed
    const pid_t child = fork();
    if (child != 0) return child;
    for (const auto& [name, value] : settings) setenv(name.c_str(), value.c_str(), 1);
    const int null = open("/dev/null", O_WRONLY);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    if (chdir(folder.c_str()) == 0)
      execl(program.c_str(), program.c_str(), "capture", "plan.toml", session.c_str(), "--lab",
            "lab.toml", "--quiet", begun ? "--resume" : nullptr, static_cast<char*>(nullptr));
    _exit(127);
  }
  // As a shell has it: 128 and the signal for a process that was killed.
  static int Wait(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  // Nothing is left to resume where the kill came after the last step.
  bool IsSealed(const std::string& session) const {
    return fs::exists(folder_ / session / "manifest.json");
  }

  // Notes the frames that the journal of a killed capture says are there.
  void NoteCommitted(const std::string& session, Settings& committed) const {
    const fs::path journal = folder_ / session / "journal.jsonl";
    if (!fs::exists(journal)) return;
    for (const core::Json& record : session::ReadJournal(journal).records)
      if (record.at("type") == "frame") committed[record.at("file")] = record.at("sha256");
  }

  // The session is whole, holds all that was committed, and is the light field of the undisturbed
  // one.
  void ExpectWhole(const std::string& session, const Settings& committed) const {
    const auto check = capture::VerifySession(folder_ / session);
    EXPECT_THAT(check.problems, testing::IsEmpty());
    EXPECT_EQ(check.positions, 9);
    Settings now;
    NoteCommitted(session, now);
    for (const auto& [file, sha256] : committed) {
      EXPECT_EQ(now[file], sha256) << file;
      EXPECT_EQ(core::Sha256OfFile(folder_ / session / file), sha256) << file;
    }
    const Agreement agreement = Compare(FieldOf(session), undisturbed_);
    EXPECT_GT(agreement.degrees, 500);
    EXPECT_LT(agreement.chi_squared, 1 + 5 * agreement.scatter());
  }

  Field FieldOf(const std::string& session) const {
    auto solved = reconstruct::Reconstruct(
        reconstruct::MergeSession(session::SessionReader(folder_ / session)));
    return {std::move(solved.coefficients), std::move(solved.sigma)};
  }

  const fs::path folder_ = [] {
    const char* name = testing::UnitTest::GetInstance()->current_test_info()->name();
    const fs::path folder = MemoryFolder() / fmt::format("luxfield_{}_{}", name, getpid());
    fs::create_directories(folder);
    return folder;
  }();
  Field undisturbed_;
  std::uintmax_t whole_journal_ = 0;
};

// Within five milliseconds after the journal has reached some length, all lengths alike: whatever
// the machine's load, the kills spread over the capture and not over the program's start.
TEST_F(KilledCapture, AtAnyInstantItResumesToTheSameLightField) {
  const std::uint64_t seed = TestSeed(20261122);
  int kills = 0, sessions = 0;
  for (; kills < KillsWanted(); ++sessions) {
    const std::string session = fmt::format("session{}", sessions);
    const fs::path journal = folder_ / session / "journal.jsonl";
    core::Random random(seed, sessions);
    Settings committed;
    for (int n = 0; n < 5; ++n) {
      const auto length = static_cast<std::uintmax_t>(random.Uniform() * double(whole_journal_));
      const double delay_s = 0.005 * random.Uniform();
      const pid_t child = Start(session, {});
      std::error_code absent;
      while (fs::exists(fmt::format("/proc/{}/exe", child), absent) &&
             (!fs::exists(journal, absent) || fs::file_size(journal, absent) < length))
        std::this_thread::sleep_for(std::chrono::microseconds(200));
      std::this_thread::sleep_for(std::chrono::duration<double>(delay_s));
      kill(child, SIGKILL);
      const int exit_code = Wait(child);
      if (exit_code == 0) break;
      ASSERT_EQ(exit_code, 128 + SIGKILL);
      ++kills;
      NoteCommitted(session, committed);
      if (IsSealed(session)) break;
    }
    if (!IsSealed(session)) {
      ASSERT_EQ(Wait(Start(session, {})), 0) << session;
    }
    ExpectWhole(session, committed);
    if (HasFailure()) FAIL() << folder_ / session;
    fs::remove_all(folder_ / session);
  }
  fmt::print("{} kills in {} sessions\n", kills, sessions);
}

TEST_F(KilledCapture, AtEveryCallThatChangesTheDiskItResumesToTheSameLightField) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a list of preloaded libraries and a sanitizer's runtime exclude each other";
#endif
  constexpr std::uint64_t kSeed = 1148;
  const fs::path folder = folder_ / "session";
  // The capture is the same every time, up to its time stamps: so are its calls.
  const auto killed = [&](int call) {
    fs::remove_all(folder);
    const int exit_code =
        Wait(Start("session", {{"LD_PRELOAD", BuiltProgram("die_at_disk_call.so")},
                               {"LUXFIELD_DIE_BELOW", folder},
                               {"LUXFIELD_DIE_AT", std::to_string(call)}}));
    EXPECT_TRUE(exit_code == 0 || exit_code == 128 + SIGKILL) << exit_code;
    return exit_code != 0;
  };
  int calls = 0;
  for (int most = 4096; calls < most;) {
    const int middle = (calls + most) / 2;
    if (killed(middle))
      calls = middle + 1;
    else
      most = middle;
  }
  core::Random random(kSeed, 0);
  int tried = 0;
  for (int call = 0; call < calls; ++call) {
    if (random.Uniform() * calls >= KillsWanted()) continue;
    ASSERT_TRUE(killed(call));
    Settings committed;
    NoteCommitted("session", committed);
    if (!IsSealed("session")) {
      ASSERT_EQ(Wait(Start("session", {})), 0) << "killed at call " << call;
    }
    ExpectWhole("session", committed);
    if (HasFailure()) FAIL() << "killed at call " << call << ", seed " << kSeed;
    ++tried;
  }
  fmt::print("killed at {} of {} calls\n", tried, calls);
  EXPECT_GT(tried, 0);
}

}  // namespace
}  // namespace luxfield::e2e
