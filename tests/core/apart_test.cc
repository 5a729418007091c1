#include "luxfield/core/apart.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <memory>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"

namespace luxfield::core {
namespace {

using testing::HasSubstr;
using Why = ApartError::Why;

struct Failure {
  Why why;
  std::string problem;
};

// How a child that does this fails.
Failure FailureOf(const std::function<void(ApartWriter&)>& work, const ApartLimits& limits = {}) {
  try {
    Apart(limits, work, [](ApartReader& reader) { reader.Value<int>(); });
  } catch (const ApartError& error) {
    return {error.why, error.what()};
  }
  ADD_FAILURE() << "answered";
  return {};
}

TEST(Apart, ValuesComeInTheOrderInWhichTheyAreWritten) {
  const std::string text("\0 and \xff", 7);
  const std::vector<double> many(300000, 0.1);  // more than a pipe holds
  int number = 0;
  std::string text_got;
  std::vector<double> many_got, none_got{1};
  Apart(
      {}, [&](ApartWriter& writer) { writer(7, text, many, std::vector<double>()); },
      [&](ApartReader& reader) { reader(number, text_got, many_got, none_got); });
  EXPECT_EQ(number, 7);
  EXPECT_EQ(text_got, text);
  EXPECT_EQ(many_got, many);
  EXPECT_TRUE(none_got.empty());
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
}

TEST(Apart, WhatTheChildThrowsBeforeItAnswersIsThrownHere) {
  const auto none = [](ApartReader&) { FAIL(); };
  EXPECT_THAT(
      [&] {
        Apart(
            {}, [](ApartWriter&) { throw InputError("f: is bad"); }, none);
      },
      testing::ThrowsMessage<InputError>("f: is bad"));
  EXPECT_THAT(
      [&] {
        Apart(
            {}, [](ApartWriter&) { throw DeviceError("full"); }, none);
      },
      testing::ThrowsMessage<DeviceError>("full"));
  const Failure other = FailureOf([](ApartWriter&) { throw std::runtime_error("not ours"); });
  EXPECT_EQ(other.why, Why::kNoAnswer);
}

TEST(Apart, AChildThatDiesTakesNothingWithIt) {
  const Failure aborted = FailureOf([](ApartWriter&) { std::abort(); });
  EXPECT_EQ(aborted.why, Why::kDied);
  EXPECT_THAT(aborted.problem, HasSubstr("brought its reader down (signal 6"));
  EXPECT_EQ(FailureOf([](ApartWriter&) { std::raise(SIGSEGV); }).why, Why::kDied);
  EXPECT_EQ(FailureOf([](ApartWriter&) { std::_Exit(0); }).why, Why::kNoAnswer);
}

// Half an answer, one that goes on, and one of more than the child may have.
TEST(Apart, AnAnswerIsWhole) {
  EXPECT_EQ(FailureOf([](ApartWriter& writer) { writer('x'); }).why, Why::kNoAnswer);
  EXPECT_EQ(FailureOf([](ApartWriter& writer) { writer(1, 'x'); }).why, Why::kNoAnswer);
  const auto died = FailureOf([](ApartWriter& writer) {
    writer(1);
    std::abort();
  });
  EXPECT_EQ(died.why, Why::kDied);
  std::vector<double> values;
  EXPECT_THROW(Apart(
                   {}, [](ApartWriter& writer) { writer(~std::uint64_t{0} / 8); },
                   [&](ApartReader& reader) { reader(values); }),
               ApartError);
}

TEST(Apart, TimeIsBounded) {
  ApartLimits limits;
  limits.processor_s = 1;
  const Failure busy = FailureOf(
      [](ApartWriter&) {
        for (volatile unsigned n = 0;;) n = n + 1;
      },
      limits);
  EXPECT_EQ(busy.why, Why::kTooLong);
  EXPECT_THAT(busy.problem, HasSubstr("1 s of processor time"));
  limits.wall_s = 0.05;
  const auto sleep = [](ApartWriter&) {
    for (;;) ::pause();
  };
  EXPECT_EQ(FailureOf(sleep, limits).why, Why::kTooLong);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
}

TEST(Apart, MemoryIsBounded) {
  ApartLimits limits;
  limits.memory_bytes = std::size_t{64} << 20;
  const auto take = [](std::size_t bytes) {
    return [bytes](ApartWriter& writer) {
      const auto memory = std::make_unique<char[]>(bytes);
      writer(int{memory[bytes / 2]});
    };
  };
  EXPECT_NO_THROW(Apart(limits, take(std::size_t{32} << 20),
                        [](ApartReader& reader) { EXPECT_EQ(reader.Value<int>(), 0); }));
  // Libraries that catch bad_alloc do not hide it.
  const Failure failure = FailureOf(
      [&](ApartWriter& writer) {
        try {
          take(std::size_t{1} << 40)(writer);
        } catch (const std::bad_alloc&) {
        }
      },
      limits);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  // Where memory is refused the sanitizer ends the child by itself.
  EXPECT_NE(failure.why, Why::kTooLong);
#else
  EXPECT_EQ(failure.why, Why::kTooMuchMemory);
  EXPECT_THAT(failure.problem, HasSubstr("more than 64 MiB"));
#endif
}

TEST(Apart, AnInterruptEndsTheChildUnlessItIsToBeFinished) {
  SetInterruptCountForTest(1);
  const auto sleep = [](ApartWriter&) {
    for (;;) ::pause();
  };
  EXPECT_THROW(FailureOf(sleep), Interrupted);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
  ApartLimits limits;
  limits.interruptible = false;
  EXPECT_NO_THROW(Apart(
      limits, [](ApartWriter& writer) { writer(1); },
      [](ApartReader& reader) { reader.Value<int>(); }));
  SetInterruptCountForTest(0);
}

TEST(Apart, HoldsNothingThatTheProgramHasOpen) {
  const int first = ::open("/dev/null", O_RDONLY);
  const int held = ::fcntl(first, F_DUPFD, 10);
  bool closed = false;
  Apart(
      {}, [&](ApartWriter& writer) { writer(::fcntl(held, F_GETFD) == -1); },
      [&](ApartReader& reader) { reader(closed); });
  EXPECT_TRUE(closed);
  ::close(held);
  ::close(first);
}

TEST(ReadApart, NamesTheFileAndWhatToDo) {
  EXPECT_THAT(
      [] {
        ReadApart(
            "m.obj", "export it again", {}, [](ApartWriter&) { std::abort(); },
            [](ApartReader& reader) { reader.Value<int>(); });
      },
      testing::ThrowsMessage<InputError>(
          testing::AllOf(testing::StartsWith("m.obj: brought its reader down (signal 6, "),
                         testing::EndsWith("; export it again"))));
}

}  // namespace
}  // namespace luxfield::core
