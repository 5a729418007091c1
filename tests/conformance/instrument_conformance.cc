#include <atomic>
#include <cmath>
#include <set>
#include <thread>

#include "tests/conformance/device_bench.h"

namespace luxfield::hal {
namespace {

constexpr double kLong_s = 30;  // more than any operation of a bench takes
constexpr double kShort_s = 0.05;

}  // namespace

TEST_P(SelectorConformance, GoesToEachOfItsPositions) {
  EXPECT_FALSE(device().identity().empty());
  const auto positions = device().positions();
  EXPECT_EQ(std::set<std::string>(positions.begin(), positions.end()).size(), positions.size());
  ASSERT_GE(positions.size(), 2u);
  for (int round = 0; round < 2; ++round)
    for (const std::string& position : positions) {
      device().Select(position, In(kLong_s));
      EXPECT_EQ(device().Current(), position);
      device().Select(position, In(kLong_s));  // stays
      EXPECT_EQ(device().Current(), position);
    }
}

TEST_P(SelectorConformance, APositionItDoesNotHaveChangesNothing) {
  const std::string position = device().positions().back();
  device().Select(position, In(kLong_s));
  EXPECT_EQ(FaultOf([&] { device().Select("nowhere", In(kLong_s)); }), Fault::kOutOfRange);
  EXPECT_EQ(device().Current(), position);
}

TEST_P(SelectorConformance, ADeadlineThatIsOverIsATimeoutAndNotTheEnd) {
  const auto positions = device().positions();
  device().Select(positions[0], In(kLong_s));
  EXPECT_EQ(FaultOf([&] { device().Select(positions[1], In(-1)); }), Fault::kTimeout);
  device().Select(positions[1], In(kLong_s));
  EXPECT_EQ(device().Current(), positions[1]);
}

TEST_P(SelectorConformance, OneThatSticksIsTold) {
  const auto positions = device().positions();
  device().Select(positions[0], In(kLong_s));
  if (!bench_->Stick()) GTEST_SKIP() << "cannot stick";
  const auto fault = FaultOf([&] { device().Select(positions[1], In(kShort_s)); });
  EXPECT_TRUE(fault == Fault::kTimeout || fault == Fault::kRefused);
}

TEST_P(SupplyConformance, SwitchesAndReadsBack) {
  EXPECT_FALSE(device().identity().empty());
  for (const bool on : {false, true, true, false}) {
    EXPECT_EQ(device().SetOutput(on, In(kLong_s)).output, on);
    EXPECT_EQ(device().State().output, on);
    if (const auto lit = bench_->Lit()) {
      EXPECT_EQ(*lit, on);
    }
  }
}

TEST_P(SupplyConformance, WhatItSwitchedOnGoesOffWithIt) {
  device().SetOutput(true, In(kLong_s));
  if (!bench_->Close()) GTEST_SKIP() << "cannot be closed";
  EXPECT_EQ(bench_->Lit(), false);
}

TEST_P(SupplyConformance, OneThatSticksIsTold) {
  device().SetOutput(false, In(kLong_s));
  if (!bench_->Stick()) GTEST_SKIP() << "cannot stick";
  EXPECT_EQ(FaultOf([&] { device().SetOutput(true, In(kLong_s)); }), Fault::kRefused);
}

// A trip switches the lamp off while the capture may be asking for its state, and goes first.
TEST_P(SupplyConformance, GoesOffFromAnotherThread) {
  if (!bench_->in_real_time()) GTEST_SKIP() << "simulated time knows one thread";
  device().SetOutput(true, In(kLong_s));
  std::thread other([&] { device().SetOutput(false, In(kLong_s)); });
  for (int k = 0; k < 20; ++k)
    EXPECT_EQ(FaultOf([&] { device().State(); }).value_or(Fault::kStopped), Fault::kStopped);
  other.join();
  EXPECT_FALSE(device().State().output);
}

TEST_P(MeterConformance, ReadsNumbersWithUnitAndTime) {
  EXPECT_FALSE(device().identity().empty());
  std::string unit;
  for (int k = 0; k < 3; ++k) {
    const double before_s = In(0);
    const Reading reading = device().Read(In(kLong_s));
    EXPECT_TRUE(reading.over_range || std::isfinite(reading.value));
    EXPECT_FALSE(reading.unit.empty());
    EXPECT_TRUE(k == 0 || reading.unit == unit);
    EXPECT_GE(reading.t_s, before_s);
    EXPECT_LE(reading.t_s, In(0));
    unit = reading.unit;
  }
}

TEST_P(MeterConformance, OneThatDoesNotAnswerIsATimeoutAndNotTheEnd) {
  if (!bench_->Mute(true)) GTEST_SKIP() << "cannot be mute";
  EXPECT_EQ(FaultOf([&] { device().Read(In(kShort_s)); }), Fault::kTimeout);
  bench_->Mute(false);
  EXPECT_TRUE(std::isfinite(device().Read(In(kLong_s)).value));
}

TEST_P(InputsConformance, AreSafeAndSilentWhileNothingHappens) {
  EXPECT_FALSE(device().identity().empty());
  EXPECT_TRUE(device().State().safe()) << Describe(device().State());
  std::atomic<int> calls = 0;
  device().OnTrip([&](const InputState&) { ++calls; });
  device().OnTrip({});
  EXPECT_EQ(calls, 0);
}

TEST_P(InputsConformance, ATripIsToldOnceAndToWhoComesLater) {
  std::atomic<int> calls = 0;
  device().OnTrip([&](const InputState& state) {
    EXPECT_FALSE(state.safe());
    ++calls;
  });
  if (!bench_->Trip(true)) GTEST_SKIP() << "never trip";
  const double give_up_s = In(kLong_s);
  while (calls == 0 && In(0) < give_up_s) std::this_thread::yield();
  EXPECT_EQ(calls, 1);
  EXPECT_FALSE(device().State().safe());
  int late_calls = 0;
  device().OnTrip([&](const InputState&) { ++late_calls; });
  EXPECT_EQ(late_calls, 1) << "at once";
  bench_->Trip(false);
  while (!device().State().safe() && In(0) < give_up_s) std::this_thread::yield();
  EXPECT_TRUE(device().State().safe());
  device().OnTrip({});
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(late_calls, 1);
}

}  // namespace luxfield::hal
