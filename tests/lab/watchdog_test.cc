// What becomes of lamp and stage when the program that drives them is killed, or stopped: over the
// real drivers, from other processes, with the fakes of a bench.
//
//   LUXFIELD_TRIALS=1000 umockdev-wrapper build/release/lab_test --gtest_filter='Watchdog.*'
//
// kills 1000 times and stops 100 times in place of 6 and 2.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <thread>

#include "luxfield/core/random.h"
#include "luxfield/hal/lab/safe_state.h"
#include "tests/e2e/program.h"
#include "tests/lab/fake_bench.h"

namespace luxfield::bench {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::string kStage = std::string(kTravel) + "settle_s = 0\n";

// The program that is killed: lights the lamp and moves the stage until the end of its days.
TEST(WatchdogVictim, DISABLED_Runs) {
  const auto clock = std::make_shared<core::SystemClock>();
  const hal::DeviceLab lab =
      hal::ReadDeviceLab(core::Config::FromFile(std::getenv("LUXFIELD_VICTIM_LAB")));
  const auto watchdog = hal::StartWatchdog(lab);
  const auto supply = hal::OpenSupply(*lab.supply, clock);
  const auto stage = hal::OpenStage(lab.stage, clock);
  const auto soon = [&] { return clock->MonotonicSeconds() + 20; };
  stage->Home(soon());
  supply->SetOutput(true, soon());
  for (double u = 0.09;; u = -u) stage->MoveTo({u, 0}, soon());
}

class Watchdog : public testing::Test {
 protected:
  void SetUp() override {
    e2e::WriteText(folder_ / "world.toml",
                   fmt::format("[lab]\ndriver = \"sim\"\n{}[lamp]\nkind = \"headlight\"\n[camera]\n"
                               "width = 8\nheight = 8\nbits = 14\nmin_exposure_s = 1e-5\n"
                               "max_exposure_s = 10\n{}[stage]\n{}",
                               kRig, kCamera, kStage));
    bench_.emplace(folder_, folder_ / "world.toml", CameraKind::kMachineVision);
    for (const bool relay : {false, true})
      e2e::WriteText(LabFile(relay),
                     fmt::format("[lab]\ndriver = \"devices\"\n{}[camera]\n{}read_noise_dn = "
                                 "1.6\n{}[stage]\n{}{}{}",
                                 kRig, bench_->CameraKeys(), kCamera, bench_->StageKeys(), kStage,
                                 bench_->OtherTables(relay)));
  }
  void TearDown() override {
    bench_.reset();
    if (!HasFailure()) fs::remove_all(folder_);
  }

  fs::path LabFile(bool relay) const { return folder_ / (relay ? "relay.toml" : "supply.toml"); }

  struct Trial {
    double dark_ms = 0, still_ms = 0;  // after the signal
    std::string said;                  // by the watchdog, and by the test program before
  };
  // Signals the victim some time after it has lit the lamp and set the stage going, and waits until
  // it and its watchdog have ended.
  Trial Strike(int signal, bool relay, double after_s) {
    std::array<int, 2> err{};
    EXPECT_EQ(pipe2(err.data(), O_CLOEXEC), 0);
    const std::string lab = LabFile(relay);
    const pid_t victim = fork();
    if (victim == 0) {
      setenv("LUXFIELD_VICTIM_LAB", lab.c_str(), 1);
      unsetenv("GTEST_OUTPUT");
      dup2(err[1], STDERR_FILENO);
      dup2(err[1], STDOUT_FILENO);  // of a victim that dies by itself, why
      // A fresh program: threads do not survive a fork.
      execl("/proc/self/exe", "bench_test", "--gtest_filter=WatchdogVictim.DISABLED_Runs",
            "--gtest_also_run_disabled_tests", static_cast<char*>(nullptr));
      _exit(127);
    }
    close(err[1]);
    const auto now = [] { return fakes::SteadySeconds(); };
    const auto nap = [](double s) {
      std::this_thread::sleep_for(std::chrono::duration<double>(s));
    };
    for (const double until = now() + 30;
         !(bench_->lamp_on() && bench_->stage_moves()) && now() < until;)
      nap(0.001);
    EXPECT_TRUE(bench_->lamp_on()) << "the victim does not get going";
    nap(after_s);
    const double struck = now();
    kill(victim, signal);
    Trial trial;
    double last_lit = struck, last_moving = struck;
    for (pollfd end{err[0], POLLIN, 0};;) {
      if (bench_->lamp_on()) last_lit = now();
      if (bench_->stage_moves()) last_moving = now();
      if (poll(&end, 1, 1) != 1) continue;
      std::array<char, 256> text;
      const ssize_t got = read(err[0], text.data(), text.size());
      if (got <= 0) break;
      trial.said.append(text.data(), static_cast<std::size_t>(got));
    }
    close(err[0]);
    waitpid(victim, nullptr, 0);
    trial.dark_ms = 1e3 * (last_lit - struck);
    trial.still_ms = 1e3 * (last_moving - struck);
    return trial;
  }

  // Strikes at random instants of a move there and back, with supply and relay in turn.
  void ExpectSafe(int signal, const char* why, int trials) {
    constexpr std::uint64_t kSeed = 1422;
    std::vector<double> dark_ms, still_ms;
    int void_trials = 0;
    for (int n = 0; n < trials; ++n) {
      core::Random random(kSeed, n);
      const double after_s = 0.5 * random.Uniform();
      Trial trial = Strike(signal, n % 2, after_s);
      // umockdev's library asserts now and then where two threads of the watchdog enter it at once:
      // the fake has ended it. Such a trial says nothing.
      for (; trial.said.find("libumockdev-preload.c") != std::string::npos; ++void_trials) {
        const auto lab = hal::ReadDeviceLab(core::Config::FromFile(LabFile(n % 2)));
        ASSERT_THAT(hal::MakeSafe(lab, 10), testing::IsEmpty());
        trial = Strike(signal, n % 2, after_s);
      }
      EXPECT_THAT(trial.said,
                  HasSubstr(fmt::format(
                      "{}; its watchdog switched the lamp off and stopped the stage", why)))
          << "seed " << kSeed << ", trial " << n;
      EXPECT_FALSE(bench_->lamp_on());
      EXPECT_FALSE(bench_->stage_moves());
      dark_ms.push_back(trial.dark_ms);
      still_ms.push_back(trial.still_ms);
    }
    EXPECT_LE(void_trials, 1 + trials / 20);
    if (void_trials > 0) fmt::print("{}: {} trials again, ended by the fake\n", why, void_trials);
    for (auto& [name, times] : {std::pair{"lamp off", &dark_ms}, {"stage at rest", &still_ms}}) {
      std::sort(times->begin(), times->end());
      fmt::print("{}: {} after a median of {:.0f} ms, worst {:.0f} ms ({} trials)\n", why, name,
                 (*times)[times->size() / 2], times->back(), trials);
    }
  }

  static int Trials(int sample, int divisor) {
    const char* asked = std::getenv("LUXFIELD_TRIALS");
    return asked ? std::max(1, std::atoi(asked) / divisor) : sample;
  }

  fs::path folder_ =
      e2e::FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
  std::optional<FakeBench> bench_;
};

TEST_F(Watchdog, DarkAndStillAfterAKill) { ExpectSafe(SIGKILL, "died", Trials(6, 1)); }

TEST_F(Watchdog, DarkAndStillAfterAHang) { ExpectSafe(SIGSTOP, "hangs", Trials(2, 10)); }

}  // namespace
}  // namespace luxfield::bench
