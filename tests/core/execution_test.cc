#include "luxfield/core/execution.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>

#include "luxfield/core/console.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/warning.h"

namespace luxfield::core {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::string Printed(const std::function<void()>& work) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  work();
  return testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr();
}

void Work() {
  Warn("the lamp is warm");
  Say(Severity::kNote, "the lamp is lit");
  Progress progress("work", 10);
  for (int k = 0; k < 10; ++k) progress.Advance();
}

TEST(Execution, OutsideOfAnyNothingIsPrinted) { EXPECT_EQ(Printed(Work), ""); }

TEST(Execution, HearsEachMessageOnce) {
  std::vector<std::string> notes, warnings;
  const Execution heard{.message = [&](Severity severity, const std::string& message) {
    (severity == Severity::kNote ? notes : warnings).push_back(message);
  }};
  EXPECT_EQ(Printed([&] {
              RunWith(heard, [] {
                Work();
                Work();
                Warn("the lamp is cold");
              });
            }),
            "");
  EXPECT_THAT(notes, ElementsAre("the lamp is lit"));
  EXPECT_THAT(warnings, ElementsAre("the lamp is warm", "the lamp is cold"));
  RunWith(heard, Work);  // another execution, which has not heard it yet
  EXPECT_EQ(notes.size(), 2);
}

TEST(Execution, HearsOfTheOutermostJob) {
  std::vector<std::string> reports;
  const Execution heard{.progress = [&](const ProgressReport& report) {
    reports.push_back(report.label + " " + std::to_string(report.done) + "/" +
                      std::to_string(report.total) + report.note + (report.ended ? " ended" : ""));
    EXPECT_GE(report.elapsed_s, 0);
  }};
  RunWith(heard, [] {
    {
      Progress outer("outer", 2);
      {
        Progress inner("inner", 1);
        inner.Advance();
      }
      outer.Advance(1, ", one");
    }
    Progress next("next", 1);
    next.Advance();
  });
  EXPECT_THAT(reports,
              ElementsAre("outer 1/2, one", "outer 1/2 ended", "next 1/1", "next 1/1 ended"));
}

TEST(Execution, IsThatOfLoopsAndThreadsThatACallStarts) {
  std::atomic<int> heard = 0;
  std::vector<std::string> said;
  const Execution execution{.message = [&](Severity, const std::string& m) { said.push_back(m); },
                            .threads = 2};
  RunWith(execution, [&] {
    ParallelFor(64, 1, [&](std::size_t begin, std::size_t) { Warn(std::to_string(begin % 4)); });
    std::thread(InThisExecution([&] {
      Warn("from a thread");
      heard = Threads();
    })).join();
    std::thread([] { Warn("from a stranger's thread"); }).join();
  });
  EXPECT_THAT(said, testing::UnorderedElementsAre("0", "1", "2", "3", "from a thread"));
  EXPECT_EQ(heard, std::min<int>(2, Threads()));
  Warn("afterwards");
  EXPECT_EQ(said.size(), 5);
}

TEST(Execution, AThreadThatOutlivesItIsHeardByNobody) {
  std::vector<std::string> said;
  std::promise<void> returned;
  std::thread late;
  RunWith({.message = [&](Severity, const std::string& m) { said.push_back(m); },
           .progress = [&](const ProgressReport& report) { said.push_back(report.label); },
           .interrupts = [] { return 2; }},
          [&] {
            late = std::thread(InThisExecution([&] {
              Progress progress("late work", 1);
              returned.get_future().wait();
              Warn("late");
              progress.Advance();
              EXPECT_EQ(InterruptCount(), 0);
            }));
          });
  returned.set_value();
  late.join();
  EXPECT_THAT(said, IsEmpty());
}

TEST(Execution, LimitsThreads) {
  int within = 0;
  std::atomic<int> at_once = 0, most = 0;
  RunWith({.threads = 1}, [&] {
    within = Threads();
    ParallelFor(200, 1, [&](std::size_t, std::size_t) {
      int seen = ++at_once, before = most;
      while (before < seen && !most.compare_exchange_weak(before, seen)) continue;
      std::this_thread::yield();
      --at_once;
    });
  });
  EXPECT_EQ(within, 1);
  EXPECT_EQ(most, 1);
}

TEST(Execution, IsLeftWhenWorkThrows) {
  std::vector<std::string> said;
  EXPECT_THROW(
      RunWith({.message = [&](Severity, const std::string& m) { said.push_back(m); }, .threads = 1},
              [] { throw std::runtime_error("no"); }),
      std::runtime_error);
  Warn("afterwards");
  EXPECT_THAT(said, IsEmpty());
}

TEST(Execution, StopsItsOwnCallsOnly) {
  int asked = 0;
  RunWith({.interrupts = [&] { return asked; }}, [&] {
    EXPECT_NO_THROW(ThrowIfInterrupted());
    asked = 2;
    EXPECT_EQ(InterruptCount(), 2);
    EXPECT_THROW(ThrowIfInterrupted(), Interrupted);
    std::thread([] { EXPECT_EQ(InterruptCount(), 0); }).join();
  });
  EXPECT_NO_THROW(ThrowIfInterrupted());
}

// Stderr of a test is no terminal: jobs of more than a second say each tenth, shorter ones the end.
TEST(Console, PrintsMessagesAndTheEndOfAJob) {
  const std::string printed = Printed([] { RunWith(OnConsole(false, 0), Work); });
  EXPECT_THAT(printed, testing::MatchesRegex("luxfield: warning: the lamp is warm\n"
                                             "luxfield: the lamp is lit\n"
                                             "work 100 %  in [0-9.]+ s\n"));
}

TEST(Console, PrintsTenthsOfALongJob) {
  const Execution console = OnConsole(false, 0);
  const auto report = [&](std::uint64_t done, double elapsed_s, bool ended = false) {
    console.progress({"merge", "", done, 40, elapsed_s, ended});
  };
  EXPECT_EQ(Printed([&] {
              report(3, 0.5);  // too early
              report(4, 2);    // the first tenth
              report(5, 2.5);  // the same one
              report(20, 10);  // half
              report(40, 20);  // all
              report(40, 20, true);
              report(10, 5);  // of the next job
            }),
            "merge  10 %  ETA 18 s\nmerge  50 %  ETA 10 s\nmerge 100 %  in 20 s\n"
            "merge  25 %  ETA 15 s\n");
}

// On a terminal one line is drawn again and again, and ends when the job does.
TEST(Console, RedrawsOneLineOnATerminal) {
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  ASSERT_GE(child, 0);
  if (child == 0) {
    const Execution console = OnConsole(false, 0);
    console.progress({"merge", "", 1, 4, 2.0, false});
    console.progress({"merge", "", 2, 4, 2.05, false});  // too soon to be drawn
    console.progress({"merge", "", 3, 4, 3.0, false});
    console.progress({"merge", "", 3, 4, 3.0, true});
    ::_exit(0);
  }
  std::string drawn;
  char piece[256];
  for (ssize_t got; (got = ::read(terminal, piece, sizeof piece)) > 0;)
    drawn.append(piece, static_cast<std::size_t>(got));
  ::close(terminal);
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  EXPECT_EQ(drawn, "\r\033[Kmerge  25 %  ETA 6.0 s\r\033[Kmerge  75 %  ETA 1.0 s\r\n");
}

TEST(Console, QuietShowsMessagesOnly) {
  EXPECT_EQ(Printed([] { RunWith(OnConsole(true, 0), Work); }),
            "luxfield: warning: the lamp is warm\nluxfield: the lamp is lit\n");
}

}  // namespace
}  // namespace luxfield::core
