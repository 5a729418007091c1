// Signals of a process that luxfield::core handles them for: each test is one of its own.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>

#include "luxfield/core/progress.h"

namespace luxfield::core {
namespace {

using testing::ExitedWithCode;
using testing::KilledBySignal;

// Until it has been heard as a press of its own, or ends the process; never where neither comes.
void Press(int signal, int count) {
  while (InterruptCount() < count) ::raise(signal);
}

TEST(Interrupts, TheSecondEndsTheProcessByItself) {
  for (const auto& [first, second] :
       {std::pair{SIGINT, SIGINT}, {SIGINT, SIGTERM}, {SIGTERM, SIGTERM}, {SIGHUP, SIGINT}})
    EXPECT_EXIT(
        {
          InstallInterruptHandler();
          ::raise(first);
          if (InterruptCount() != 1) ::_exit(1);
          Press(second, 2);
          ::_exit(2);
        },
        KilledBySignal(second), "")
        << first << ' ' << second;
}

// `timeout` sends one to the program and one to its group, a moment later.
TEST(Interrupts, TwoAtOnceAreOne) {
  EXPECT_EXIT(
      {
        InstallInterruptHandler();
        EndInOrderAtTheSecondInterrupt();  // the second is counted and can be told
        for (;;) {
          SetInterruptCountForTest(0);
          Press(SIGTERM, 1);
          const auto begin = std::chrono::steady_clock::now();
          ::raise(SIGTERM);
          ::raise(SIGINT);
          // Where the machine stood still they were none at once.
          if (std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(50))
            ::_exit(InterruptCount() == 1 ? 0 : 1);
        }
      },
      ExitedWithCode(0), "");
}

TEST(Interrupts, InOrderTheThirdEndsTheProcessOrAnAlarm) {
  EXPECT_EXIT(
      {
        InstallInterruptHandler();
        EndInOrderAtTheSecondInterrupt();
        Press(SIGINT, 2);
        Press(SIGINT, 3);
        ::_exit(2);
      },
      KilledBySignal(SIGINT), "");
  EXPECT_EXIT(
      {
        InstallInterruptHandler();
        EndInOrderAtTheSecondInterrupt();
        Press(SIGTERM, 1);
        if (::alarm(0) != 0) ::_exit(1);
        Press(SIGTERM, 2);
        ::_exit(::alarm(0) > 0 ? 0 : 2);
      },
      ExitedWithCode(0), "");
}

// A terminal that closes sends several, from the kernel and from the shell.
TEST(Interrupts, AHangupIsTheFirstAndNoOther) {
  EXPECT_EXIT(
      {
        InstallInterruptHandler();
        const auto begin = std::chrono::steady_clock::now();
        while (std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(300))
          ::raise(SIGHUP);
        ::_exit(InterruptCount() == 1 ? 0 : 1);
      },
      ExitedWithCode(0), "");
}

TEST(Interrupts, AHangupThatIsIgnoredStaysSo) {
  EXPECT_EXIT(
      {
        ::signal(SIGHUP, SIG_IGN);
        InstallInterruptHandler();
        ::raise(SIGHUP);
        ::_exit(InterruptCount() == 0 ? 0 : 1);
      },
      ExitedWithCode(0), "");
}

}  // namespace
}  // namespace luxfield::core
