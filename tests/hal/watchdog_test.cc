// The watchdog as a process: tests/lab/watchdog_test.cc has it with devices.
#include "luxfield/hal/safety/watchdog.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "luxfield/hal/safety/safety_guard.h"
#include "tests/hal/fewer_rights.h"

namespace luxfield::hal {
namespace {

constexpr WatchdogTimes kFast{0.02, 0.5, 0.1};

// A process with a watchdog, which says in one line that it runs and then does its work. What it
// and its watchdog say after that is read to its end: until both have ended.
class Program {
 public:
  using Work = std::function<void(Watchdog&, int out)>;

  explicit Program(const Work& work) {
    std::array<int, 2> out{};
    EXPECT_EQ(pipe2(out.data(), O_CLOEXEC), 0);
    process_ = fork();
    if (process_ == 0) {
      {
        Watchdog watchdog([&](const char* why) { Say(out[1], why); }, kFast);
        Say(out[1], std::to_string(watchdog.process()) + "\n");
        work(watchdog, out[1]);
      }
      _exit(0);
    }
    close(out[1]);
    out_ = out[0];
    std::string number;
    for (char c = 0; read(out_, &c, 1) == 1 && c != '\n';) number += c;
    watchdog_ = std::stoi(number);
  }
  ~Program() {
    close(out_);
    waitpid(process_, nullptr, 0);
  }

  static void Say(int out, const std::string& text) {
    if (write(out, text.data(), text.size()) < 0) std::perror("say");
  }

  pid_t process() const { return process_; }
  pid_t watchdog() const { return watchdog_; }
  std::string Rest() const {
    std::string text;
    for (char c = 0; read(out_, &c, 1) == 1;) text += c;
    return text;
  }

 private:
  pid_t process_ = -1, watchdog_ = -1;
  int out_ = -1;
};

[[noreturn]] void Forever() {
  for (;;) pause();
}

TEST(Watchdog, KnowsWhetherTheSystemRefusesRealTimePriority) {
  const auto real_time = [] { return Watchdog([](const char*) {}, kFast).real_time(); };
  EXPECT_EQ(real_time(), GrantsRealTime());
  const NoRealTime refused;
  EXPECT_FALSE(real_time());
}

TEST(Watchdog, ActsWhenItsProgramIsKilled) {
  const Program program([](Watchdog&, int) { Forever(); });
  kill(program.process(), SIGKILL);
  EXPECT_EQ(program.Rest(), "died");
}

TEST(Watchdog, ActsWhenItsProgramCrashes) {
  const Program program([](Watchdog&, int) {
    signal(SIGSEGV, SIG_DFL);  // a sanitizer's handler would print
    kill(getpid(), SIGSEGV);
    Forever();
  });
  EXPECT_EQ(program.Rest(), "died");
}

TEST(Watchdog, KillsAProgramThatIsStopped) {
  const Program program([](Watchdog&, int) { Forever(); });
  kill(program.process(), SIGSTOP);
  EXPECT_EQ(program.Rest(), "hangs");
  int status = 0;
  ASSERT_EQ(waitpid(program.process(), &status, 0), program.process());
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
}

// The bound that docs/safety.md states. A busy machine may delay a watchdog, but not every one of
// ten.
TEST(Watchdog, ActsWithinTheSilenceThatItIsTold) {
  using Clock = std::chrono::steady_clock;
  Clock::duration least = Clock::duration::max();
  const auto bound = std::chrono::duration<double>(1.5 * kFast.silence_s);
  for (int n = 0; n < 10 && least > bound; ++n) {
    const Program program([](Watchdog&, int) { Forever(); });
    const auto stopped = Clock::now();
    kill(program.process(), SIGSTOP);
    EXPECT_EQ(program.Rest(), "hangs");
    least = std::min(least, Clock::now() - stopped);
  }
  EXPECT_LE(least, bound);
}

// Its other threads go on; the one that drives the devices does not come back.
TEST(Watchdog, KillsAProgramThatIsNotHeardOfInTime) {
  const Program program([](Watchdog& watchdog, int) {
    watchdog.Expect(0.1);
    Forever();
  });
  EXPECT_EQ(program.Rest(), "hangs");
}

TEST(Watchdog, LeavesAProgramAloneThatKeepsItsWord) {
  const Program program([](Watchdog& watchdog, int out) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(1.5);
    while (std::chrono::steady_clock::now() < end) {
      watchdog.Expect(1);
      std::this_thread::yield();
    }
    watchdog.Expect(Watchdog::kUnbounded_s);
    Program::Say(out, "done");
  });
  EXPECT_EQ(program.Rest(), "done");
}

TEST(Watchdog, OutlivesTheSignalsOfATerminal) {
  const Program program([](Watchdog&, int) { Forever(); });
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP})
    kill(program.watchdog(), signal);
  kill(program.process(), SIGKILL);
  EXPECT_EQ(program.Rest(), "died");
}

TEST(Watchdog, WithoutItNothingIsSafe) {
  const Program program([](Watchdog& watchdog, int out) {
    Devices devices;
    devices.watchdog = std::shared_ptr<Watchdog>(&watchdog, [](Watchdog*) {});
    SafetyGuard guard(devices);
    guard.ThrowIfUnsafe();
    kill(watchdog.process(), SIGKILL);
    while (watchdog.alive()) std::this_thread::yield();
    try {
      guard.ThrowIfUnsafe();
    } catch (const HardwareError& error) {
      Program::Say(out, error.what());
    }
  });
  EXPECT_THAT(program.Rest(), testing::HasSubstr("its process has ended"));
}

}  // namespace
}  // namespace luxfield::hal
