#include "tests/hal/stage_conformance.h"

#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

namespace luxfield::hal {

using testing::HasSubstr;

namespace {

constexpr double kLong_s = 30;  // more than any operation of a bench takes
constexpr double kSlack_s = 1;  // of a call past its deadline: a busy machine's scheduling
constexpr double kRounding_m = 1e-9;

}  // namespace

Vec2 StageConformance::At(double u, double v) {
  const StageLimits limits = stage().limits();
  return {limits.min.x + u * (limits.max.x - limits.min.x),
          limits.min.y + v * (limits.max.y - limits.min.y)};
}

void StageConformance::ExpectAt(Vec2 target) {
  const StagePosition where = stage().Where();
  const double resolution = stage().limits().resolution_m + kRounding_m;
  EXPECT_EQ(where.setpoint.x, target.x);
  EXPECT_EQ(where.setpoint.y, target.y);
  EXPECT_NEAR(where.readback.x, target.x, resolution);
  EXPECT_NEAR(where.readback.y, target.y, resolution);
  EXPECT_TRUE(where.homed);
  EXPECT_EQ(where.lost, "");
  EXPECT_FALSE(where.moving);
}

std::optional<HardwareError> StageConformance::ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const HardwareError& error) {
    return error;
  }
  return {};
}

void StageConformance::ExpectUsableAgain() {
  if (!stage().Where().homed) {
    const auto error = ErrorOf([&] { stage().MoveTo(At(0.5, 0.5), In(kLong_s)); });
    ASSERT_TRUE(error) << "moved without knowing where it is";
    EXPECT_EQ(error->fault, Fault::kNotHomed) << error->what();
    stage().Home(In(kLong_s));
  }
  stage().MoveTo(At(0.45, 0.55), In(kLong_s));
  ExpectAt(At(0.45, 0.55));
}

// A thread that moves from one corner to the other; returns once the stage moves.
std::thread StageConformance::MoveAcross(std::optional<HardwareError>& error) {
  stage().MoveTo(At(0, 0), In(kLong_s));
  const auto ended = std::make_shared<std::atomic<bool>>(false);
  std::thread mover([this, ended, &error] {
    error = ErrorOf([&] { stage().MoveTo(At(1, 1), In(kLong_s)); });
    *ended = true;
  });
  while (!*ended && !bench_->InMotion()) std::this_thread::yield();
  EXPECT_FALSE(*ended) << "the move was never seen";
  return mover;
}

TEST_P(StageConformance, KnowsNothingBeforeHoming) {
  EXPECT_FALSE(stage().identity().empty());
  const StageLimits limits = stage().limits();
  EXPECT_LT(limits.min.x, limits.max.x);
  EXPECT_LT(limits.min.y, limits.max.y);
  EXPECT_GT(limits.speed_m_per_s, 0);
  EXPECT_FALSE(stage().Where().homed);
  const auto error = ErrorOf([&] { stage().MoveTo(At(0.5, 0.5), In(kLong_s)); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->fault, Fault::kNotHomed);
  EXPECT_THAT(error->what(), HasSubstr("home"));
}

TEST_P(StageConformance, HomesAndGoesWhereItIsSent) {
  stage().Home(In(kLong_s));
  EXPECT_TRUE(stage().Where().homed);
  EXPECT_FALSE(stage().Where().moving);
  for (const Vec2 target : {At(0.5, 0.5), At(0.52, 0.5), At(0.52, 0.5), At(0.5, 0.47), At(0, 1),
                            At(0, 0), At(1. / 3, 0.1)}) {
    stage().MoveTo(target, In(kLong_s));
    ExpectAt(target);
  }
}

TEST_P(StageConformance, RefusesWhatIsOutside) {
  stage().Home(In(kLong_s));
  stage().MoveTo(At(0.5, 0.5), In(kLong_s));
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const Vec2 target :
       {At(-1e-6, 0.5), At(1 + 1e-6, 0.5), At(0.5, -1e-6), At(0.5, 1 + 1e-6), At(20, -20),
        Vec2{kNan, 0}, Vec2{0, kNan}, Vec2{kInfinity, 0}, Vec2{0, -kInfinity}}) {
    const auto error = ErrorOf([&] { stage().MoveTo(target, In(kLong_s)); });
    ASSERT_TRUE(error) << target.x << ", " << target.y;
    EXPECT_EQ(error->fault, Fault::kOutOfRange) << error->what();
    EXPECT_FALSE(error->position_lost);
  }
  ExpectAt(At(0.5, 0.5));
}

TEST_P(StageConformance, EndsByItsDeadline) {
  stage().Home(In(kLong_s));
  stage().MoveTo(At(0, 0), In(kLong_s));
  const StageLimits limits = stage().limits();
  const double way_s = (limits.max.x - limits.min.x) / limits.speed_m_per_s;
  const double deadline = In(0.2 * way_s);
  const auto error = ErrorOf([&] { stage().MoveTo(At(1, 1), deadline); });
  EXPECT_LE(In(0), deadline + kSlack_s);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->fault, Fault::kTimeout) << error->what();
  ExpectUsableAgain();
}

TEST_P(StageConformance, AFrozenDeviceEndsInATypedError) {
  stage().Home(In(kLong_s));
  stage().MoveTo(At(0.5, 0.5), In(kLong_s));
  if (!bench_->Freeze(true)) GTEST_SKIP() << "this bench cannot freeze";
  const double deadline = In(0.3);
  const auto error = ErrorOf([&] { stage().MoveTo(At(0.6, 0.6), deadline); });
  EXPECT_LE(In(0), deadline + kSlack_s);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->fault, Fault::kTimeout);
  EXPECT_FALSE(error->device.empty());
  EXPECT_FALSE(error->operation.empty());
  EXPECT_THAT(error->what(), testing::AllOf(HasSubstr(error->device), HasSubstr(error->operation)));
  const double home_deadline = In(0.3);
  const auto home = ErrorOf([&] { stage().Home(home_deadline); });
  EXPECT_LE(In(0), home_deadline + kSlack_s);
  ASSERT_TRUE(home);
  EXPECT_EQ(home->fault, Fault::kTimeout);
  bench_->Freeze(false);
  EXPECT_FALSE(stage().Where().homed) << "what happened meanwhile is unknown";
  ExpectUsableAgain();
}

TEST_P(StageConformance, AStopAtRestEndsTheNextMove) {
  stage().Home(In(kLong_s));
  stage().MoveTo(At(0.5, 0.5), In(kLong_s));
  stage().Stop();
  ExpectAt(At(0.5, 0.5));
  const auto error = ErrorOf([&] { stage().MoveTo(At(0.6, 0.5), In(kLong_s)); });
  ASSERT_TRUE(error) << "the stop was lost";
  EXPECT_EQ(error->fault, Fault::kStopped) << error->what();
  ExpectAt(At(0.5, 0.5));
  stage().MoveTo(At(0.55, 0.5), In(kLong_s));
  ExpectAt(At(0.55, 0.5));
  stage().Stop();
  EXPECT_TRUE(ErrorOf([&] { stage().Home(In(kLong_s)); }));
  stage().Home(In(kLong_s));
}

TEST_P(StageConformance, StopFromAnotherThreadBreaksAMoveOff) {
  if (!bench_->moves_in_real_time()) GTEST_SKIP() << "moves take no time here";
  stage().Home(In(kLong_s));
  std::optional<HardwareError> error;
  std::thread mover = MoveAcross(error);
  stage().Stop();
  mover.join();
  ASSERT_TRUE(error) << "the move went on";
  EXPECT_EQ(error->fault, Fault::kStopped) << error->what();
  const StagePosition first = stage().Where(), second = stage().Where();
  EXPECT_FALSE(second.moving);
  EXPECT_EQ(first.readback.x, second.readback.x);
  EXPECT_EQ(first.homed, !error->position_lost);
  const double way = At(1, 1).x - At(0, 0).x;
  EXPECT_GE(first.readback.x, At(0, 0).x - stage().limits().resolution_m);
  EXPECT_LT(first.readback.x, At(1, 1).x - 0.05 * way);
  ExpectUsableAgain();
}

// Whatever the instant of a stop, the call it meets ends, and the stage can be used afterwards.
TEST_P(StageConformance, StopsAtAnyInstant) {
  if (!bench_->moves_in_real_time()) GTEST_SKIP() << "moves take no time here";
  stage().Home(In(kLong_s));
  std::atomic<bool> done = false;
  std::atomic<int> rounds = 0;
  std::thread stopper([&] {
    for (int seen = 0; !done;) {
      const int now = rounds;
      if (now == seen) {
        std::this_thread::yield();
        continue;
      }
      seen = now;
      // Anywhere between before the move and after its end.
      bench_->clock().SleepSeconds(0.03 * seen);
      stage().Stop();
    }
  });
  for (int round = 1; round <= 8; ++round) {
    // A late stop may meet the homing.
    while (!stage().Where().homed) ErrorOf([&] { stage().Home(In(kLong_s)); });
    rounds = round;
    const double deadline = In(kLong_s);
    const auto error = ErrorOf([&] { stage().MoveTo(At(0.4 + 0.02 * round, 0.5), deadline); });
    if (error) {
      EXPECT_EQ(error->fault, Fault::kStopped) << error->what();
    }
  }
  done = true;
  stopper.join();
  stage().Stop();  // the last one may, or may not, be waiting for its move
  EXPECT_TRUE(ErrorOf([&] { stage().Home(In(kLong_s)); }));
  ExpectUsableAgain();
}

TEST_P(StageConformance, ARestartLosesThePosition) {
  stage().Home(In(kLong_s));
  stage().MoveTo(At(0.5, 0.5), In(kLong_s));
  if (!bench_->Restart()) GTEST_SKIP() << "this bench cannot restart";
  EXPECT_FALSE(stage().Where().homed);
  EXPECT_NE(stage().Where().lost, "");
  ExpectUsableAgain();
}

TEST_P(StageConformance, ARestartInAMoveEndsIt) {
  if (!bench_->moves_in_real_time()) GTEST_SKIP() << "moves take no time here";
  stage().Home(In(kLong_s));
  std::optional<HardwareError> error;
  std::thread mover = MoveAcross(error);
  const bool restarted = bench_->Restart();
  if (!restarted) stage().Stop();
  mover.join();
  if (!restarted) GTEST_SKIP() << "this bench cannot restart";
  ASSERT_TRUE(error);
  EXPECT_TRUE(error->position_lost) << error->what();
  EXPECT_FALSE(stage().Where().homed);
  EXPECT_NE(stage().Where().lost, "");
  ExpectUsableAgain();
}

TEST_P(StageConformance, ALimitSwitchLosesThePosition) {
  if (!bench_->moves_in_real_time()) GTEST_SKIP() << "moves take no time here";
  stage().Home(In(kLong_s));
  std::optional<HardwareError> error;
  std::thread mover = MoveAcross(error);
  const bool hit = bench_->HitLimitSwitch();
  if (!hit) stage().Stop();
  mover.join();
  if (!hit) GTEST_SKIP() << "this bench has no limit switch";
  ASSERT_TRUE(error);
  EXPECT_EQ(error->fault, Fault::kStopped) << error->what();
  EXPECT_TRUE(error->position_lost);
  EXPECT_FALSE(stage().Where().homed);
  EXPECT_NE(stage().Where().lost, "");
  ExpectUsableAgain();
}

}  // namespace luxfield::hal
