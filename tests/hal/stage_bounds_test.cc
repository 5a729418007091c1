#include "luxfield/hal/safety/stage_bounds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "luxfield/core/clock.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/options/stage_options.h"
#include "tests/fakes/grbl_machine.h"
#include "tests/fakes/pty_host.h"
#include "tests/fakes/zaber_chain.h"
#include "tests/hal/error_of.h"
#include "tests/hal/test_lab.h"

namespace luxfield::hal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const StageLimits kLab{{-0.1, -0.2}, {0.1, 0.2}, 0.02, 0.5, 1e-6, 0};

core::Config StageOf(const std::string& keys) {
  return core::Config::FromString("[stage]\n" + keys, "plan.toml").Table("stage");
}
StageBounds Bounds(const std::string& keys) { return ReadStageBounds(StageOf(keys)); }

template <typename Action>
std::string Refusal(Action action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was refused";
}

TEST(StageBounds, TheTighterOfTwoHoldsAxisByAxis) {
  const StageLimits limits =
      Tightened(kLab, Bounds("min_m = [-0.05, -0.9]\nmax_m = [0.5, 0.03]\nspeed_m_per_s = 0.01"));
  EXPECT_NEAR(limits.min.x, -0.05, 1.1e-9);
  EXPECT_EQ(limits.min.y, -0.2);
  EXPECT_EQ(limits.max.x, 0.1);
  EXPECT_NEAR(limits.max.y, 0.03, 1.1e-9);
  EXPECT_TRUE(limits.Contain({-0.05 - 1e-12, 0.03 + 1e-12})) << "rounded sums";
  EXPECT_FALSE(limits.Contain({-0.05 - 2e-9, 0}));
  EXPECT_EQ(limits.speed_m_per_s, 0.01);
  EXPECT_EQ(limits.settle_s, kLab.settle_s);
  EXPECT_EQ(limits.repeatability_m, kLab.repeatability_m);
  EXPECT_EQ(Tightened(kLab, Bounds("speed_m_per_s = 1")).speed_m_per_s, 0.02);
  EXPECT_EQ(Tightened(kLab, Bounds("")).max.y, kLab.max.y);
}

TEST(StageBounds, WhatWouldWidenTheLabsIsSaid) {
  EXPECT_THAT(Overruled(kLab, Bounds("min_m = [-0.05, -0.9]\nmax_m = [0.05, 0.03]\n"
                                     "speed_m_per_s = 0.5")),
              ElementsAre("plan.toml: stage.min_m = [-0.05, -0.9] allows more than the lab's "
                          "[-0.1, -0.2]: [-0.05, -0.2] holds",
                          "plan.toml: stage.speed_m_per_s = 0.5 allows more than the lab's 0.02: "
                          "0.02 holds"));
  EXPECT_THAT(Overruled(kLab, Bounds("min_m = [-0.1, -0.2]\nspeed_m_per_s = 0.02")), IsEmpty());
}

TEST(StageBounds, MistakesNameTheField) {
  EXPECT_THAT(Refusal([] { Bounds("min_m = [0, 0]\nmax_m = [0.1, 0]"); }),
              HasSubstr("plan.toml: stage.max_m"));
  EXPECT_THAT(Refusal([] { Bounds("speed_m_per_s = 0"); }), HasSubstr("stage.speed_m_per_s"));
  EXPECT_THAT(Refusal([] { Bounds("min_m = 0.1"); }), HasSubstr("stage.min_m"));
  EXPECT_THAT(
      Refusal([] { Tightened(kLab, Bounds("min_m = [0, 0.3]")); }),
      HasSubstr("plan.toml: stage.min_m = [0, 0.3] leaves nothing of the lab's [-0.1, -0.2] "
                "to [0.1, 0.2] m"));
  EXPECT_THAT(Refusal([] { Tightened(kLab, Bounds("min_m = [-1, -1]\nmax_m = [0, -0.21]")); }),
              HasSubstr("stage.max_m = [0, -0.21] leaves nothing"));
}

TEST(StageBounds, LimitsAreNamedThatAPlaceLiesBeyond) {
  const StageBounds bounds = Bounds("min_m = [-0.05, -0.05]\nmax_m = [0.05, 0.05]");
  EXPECT_EQ(LimitBefore(bounds, {0.05, -0.05}), "");
  EXPECT_EQ(LimitBefore(bounds, {0.05 + 1e-12, 0}), "");
  EXPECT_EQ(LimitBefore(bounds, {0, -0.051}), "stage.min_m = [-0.05, -0.05]");
  EXPECT_EQ(LimitBefore(bounds, {0.06, 0}), "stage.max_m = [0.05, 0.05]");
  EXPECT_EQ(LimitBefore(Bounds(""), {7, 7}), "");
}

TEST(StageBounds, BindTheDriversOfRealStages) {
  const std::string lab = "min_m = [-0.08, -0.06]\nmax_m = [0.08, 0.06]\nspeed_m_per_s = 0.1\n";
  const StageBounds bounds = Bounds("max_m = [0.04, 0.5]\nspeed_m_per_s = 0.005");
  fakes::PtyHost grbl(std::make_unique<fakes::GrblMachine>()),
      zaber(std::make_unique<fakes::ZaberChain>(true));
  for (const std::string& driver :
       {"driver = \"grbl\"\nv_axis = \"-y\"\norigin_m = [-0.1, -0.1]\nport = \"" + grbl.port(),
        "driver = \"zaber\"\nmicrostep_m = [5e-8, 5e-8]\nv_axis = \"-2.1\"\norigin_m = [0.1, "
        "0.1]\nport = \"" +
            zaber.port()}) {
    StageOptions options = ReadStage(StageOf(lab + driver + "\""));
    Tighten(options, bounds);
    const auto stage = OpenStage(options, std::make_shared<core::SystemClock>());
    for (const StageLimits& limits : {options.limits, stage->limits()}) {
      EXPECT_NEAR(limits.max.x, 0.04, 1.1e-9) << driver;
      EXPECT_EQ(limits.max.y, 0.06) << driver;
      EXPECT_EQ(limits.speed_m_per_s, 0.005) << driver;
    }
  }
}

TEST(StageBounds, BindTheSimulatedStage) {
  const auto lab = [](const StageBounds& bounds) {
    return sim::SimulatedLab(sim::TestLab{}.Config(), {}, bounds).MakeDevices();
  };
  const auto seconds = [](Devices& devices) {
    devices.stage->Home(100);
    const double start = devices.clock->MonotonicSeconds();
    devices.stage->MoveTo({0.02, 0}, start + 100);
    return devices.clock->MonotonicSeconds() - start;
  };
  Devices wide = lab({}), narrow = lab(Bounds("max_m = [0.03, 0.5]\nspeed_m_per_s = 0.001"));
  EXPECT_NEAR(seconds(wide), 0.02 / 0.05 + 0.5, 1e-9);
  EXPECT_NEAR(seconds(narrow), 0.02 / 0.001 + 0.5, 1e-9);
  EXPECT_NO_THROW(wide.stage->MoveTo({0.04, 0}, 1e9));
  EXPECT_EQ(ErrorOf([&] { narrow.stage->MoveTo({0.04, 0}, 1e9); }).fault, Fault::kOutOfRange);
}

}  // namespace
}  // namespace luxfield::hal
