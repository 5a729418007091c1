#include "luxfield/capture/plan/plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "luxfield/capture/plan/bracket_rungs.h"
#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/capture/take/frame_check.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/session/plan_json.h"
#include "tests/fuzz/plan_file.h"
#include "tests/fuzz/seeded.h"
#include "tests/hal/test_lab.h"

namespace luxfield::capture {
namespace {

using testing::HasSubstr;

struct PlanText {
  std::string plan = "unit = \"lm\"";
  std::string rig = "kind = \"lensless\"\ndelta_m = 0.25";
  std::string filter = "spacing_m = 0.02";
  std::string grid = "width = 3\nheight = 2";
  std::string lattice = "width = 8\nheight = 8\nds_m = 0.02";
  std::string exposure = "min_s = 0.001\nmax_s = 1\nratio = 4";
  std::string more;

  Plan Read() const {
    return ReadPlan(core::Config::FromString(
        fmt::format(
            "[plan]\n{}\n[rig]\n{}\n[filter]\n{}\n[grid]\n{}\n[lattice]\n{}\n[exposure]\n{}\n{}\n",
            plan, rig, filter, grid, lattice, exposure, more),
        "plan.toml"));
  }
};

std::string MessageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no InputError";
}

std::string ErrorOf(const PlanText& text) {
  return MessageOf([&] { text.Read(); });
}

TEST(Plan, EveryMistakeNamesFileAndField) {
  PlanText text;
  EXPECT_EQ(ErrorOf(text), "no InputError");
  const auto expect = [](PlanText bad, const char* field) {
    EXPECT_THAT(ErrorOf(bad), testing::AllOf(HasSubstr("plan.toml"), HasSubstr(field)));
  };
  const auto with = [&](std::string PlanText::*part, const char* value) {
    PlanText bad;
    bad.*part = value;
    return bad;
  };
  expect(with(&PlanText::plan, "unit = \"candela\""), "plan.unit");
  expect(with(&PlanText::plan, "channels = 2"), "plan.channels");
  expect(with(&PlanText::rig, "kind = \"lensless\""), "rig.delta_m");
  expect(with(&PlanText::rig, "kind = \"lensless\"\ndelta_m = \"far\""), "rig.delta_m");
  expect(with(&PlanText::filter, "spacing_m = 0"), "filter.spacing_m");
  expect(with(&PlanText::grid, "width = 0\nheight = 2"), "grid.width");
  expect(with(&PlanText::lattice, "width = 8\nheight = 8\nds_m = -1"), "lattice.ds_m");
  expect(with(&PlanText::exposure, "min_s = 1\nmax_s = 0.1"), "exposure.max_s");
  expect(with(&PlanText::exposure, "min_s = 0.1\nmax_s = 1\nratio = 16"), "exposure.ratio");
  expect(with(&PlanText::exposure, "min_s = 0.1\nmax_s = 1\nrepeat = 2"), "exposure.repeat");
  expect(with(&PlanText::more, "[stage]\nmin_m = [0, 0]\nmax_m = [0, 1]"), "stage.max_m");
  expect(with(&PlanText::more, "[stage]\nspeed_m_per_s = -1"), "stage.speed_m_per_s");
  expect(with(&PlanText::more, "[stage]\nsettle_s = 1"), "stage.settle_s");
  expect(with(&PlanText::more, "[warm_up]\nwindow_s = 100\nmax_wait_s = 10"), "warm_up.max_wait_s");
}

TEST(Plan, FilesSurviveASampleOfFuzzing) {
  std::vector<std::string> files;
  for (const char* name : {"bike", "sensor", "geometry"})
    files.push_back(core::ReadFile(fmt::format(LUXFIELD_SOURCE_DIR "/data/plans/{}.toml", name)));
  fuzz::Seeded(fuzz::PlanFile, files, 4000);
}

TEST(Plan, MustFitTheLab) {
  const hal::Devices devices = hal::sim::SimulatedLab(hal::sim::TestLab{}.Config()).MakeDevices();
  EXPECT_EQ(MessageOf([&] { ExpandPlan(PlanText{}.Read(), devices); }), "no InputError");
  const auto expect = [&](std::string PlanText::*part, const char* value, const char* field) {
    PlanText text;
    text.*part = value;
    EXPECT_THAT(MessageOf([&] { ExpandPlan(text.Read(), devices); }), HasSubstr(field));
  };
  expect(&PlanText::rig, "kind = \"lensless\"\ndelta_m = 0.3", "rig.delta_m = 0.3");
  expect(&PlanText::rig, "kind = \"reflector\"\nalbedo = 0.9\ndelta_m = 0.25",
         "rig.kind = reflector");
  expect(&PlanText::filter, "spacing_m = 0.021", "filter.spacing_m");
  expect(&PlanText::filter, "spacing_m = 0.02\nbasis = \"bilinear\"", "filter.basis");
  expect(&PlanText::filter, "spacing_m = 0.02\nscale = 1.5", "filter.scale");
  expect(&PlanText::plan, "channels = 3", "plan.channels");
  expect(&PlanText::grid, "width = 12\nheight = 2", "grid position (0, 0) at (-0.11, -0.01)");
  expect(&PlanText::exposure, "min_s = 1e-5\nmax_s = 1", "exposure.min_s");
  expect(&PlanText::exposure, "min_s = 0.001\nmax_s = 100", "exposure.max_s");
}

// The grid is 3 x 2 places 0.02 m apart about the axis.
TEST(Plan, KeepsWithinItsOwnLimitsAndTheLabs) {
  const hal::sim::TestLab lab;
  const auto expand = [&](const std::string& stage) {
    PlanText text;
    text.more = "[stage]\n" + stage;
    const Plan plan = text.Read();
    return ToJson(ToPlanFile(
        ExpandPlan(plan, hal::sim::SimulatedLab(lab.Config(), {}, plan.stage).MakeDevices())));
  };
  const auto refusal = [&](const std::string& stage) { return MessageOf([&] { expand(stage); }); };
  EXPECT_THAT(refusal("max_m = [0.019, 0.05]"),
              HasSubstr("grid position (2, 0) at (0.02, -0.01) m lies beyond stage.max_m = "
                        "[0.019, 0.05]"));
  EXPECT_THAT(refusal("min_m = [-0.05, -0.005]"),
              HasSubstr("grid position (0, 0) at (-0.02, -0.01) m lies beyond stage.min_m"));
  EXPECT_THAT(refusal("min_m = [0.2, 0.2]"), HasSubstr("leaves nothing of the lab's"));
  const core::Json json = expand("min_m = [-0.02, -0.01]\nmax_m = [0.02, 5]\nspeed_m_per_s = 0.01");
  EXPECT_EQ(
      json.at("stage"),
      (core::Json{{"min_m", {-0.02, -0.01}}, {"max_m", {0.02, 5.0}}, {"speed_m_per_s", 0.01}}));
  EXPECT_FALSE(expand("").contains("stage"));
}

TEST(Plan, NeedsALabThatWasOpenedWithItsLimits) {
  const hal::Devices devices = hal::sim::SimulatedLab(hal::sim::TestLab{}.Config()).MakeDevices();
  for (const char* stage : {"max_m = [0.05, 0.05]", "speed_m_per_s = 0.01"}) {
    PlanText text;
    text.more = std::string("[stage]\n") + stage;
    EXPECT_THROW(ExpandPlan(text.Read(), devices), std::logic_error) << stage;
  }
}

TEST(Plan, LadderIsWholePwmPeriods) {
  PlanText text;
  text.exposure = "min_s = 0.0007\nmax_s = 1\nratio = 3\npwm_hz = 120";
  const hal::Devices devices = hal::sim::SimulatedLab(hal::sim::TestLab{}.Config()).MakeDevices();
  const auto ladder = ExpandPlan(text.Read(), devices).ladder_s;
  ASSERT_GE(ladder.size(), 4u);
  for (std::size_t k = 0; k < ladder.size(); ++k) {
    EXPECT_NEAR(ladder[k] * 120, std::round(ladder[k] * 120), 1e-9);
    EXPECT_GE(ladder[k] * 120, 1 - 1e-9);
    if (k > 0) {
      EXPECT_GT(ladder[k], ladder[k - 1]);
      EXPECT_LE(ladder[k], 8 * ladder[k - 1]);
    }
  }
}

TEST(Plan, AFrequencyMayBeLeftToMeasuring) {
  PlanText text;
  text.exposure = "min_s = 0.0007\nmax_s = 1\npwm_hz = \"measure\"\nflicker = 0.005";
  const Plan plan = text.Read();
  EXPECT_TRUE(plan.exposure.measure_pwm);
  hal::Devices devices = hal::sim::SimulatedLab(hal::sim::TestLab{}.Config()).MakeDevices();
  devices.rig.pwm_hz = 120;
  EXPECT_EQ(ExpandPlan(plan, devices).ladder_s.front(), 0.0007) << "not yet measured";
  text.exposure = "min_s = 0.0007\nmax_s = 1\npwm_hz = \"measure\"";
  EXPECT_THROW(text.Read(), InputError) << "without flicker nothing says what is too much";
  text.exposure = "min_s = 0.0007\nmax_s = 1\npwm_hz = \"guess\"\nflicker = 0.005";
  EXPECT_THROW(text.Read(), InputError);
}

TEST(Plan, ExpandsToEveryPositionOnceWithoutLongWays) {
  const hal::Devices devices = hal::sim::SimulatedLab(hal::sim::TestLab{}.Config()).MakeDevices();
  const ExpandedPlan expanded = ExpandPlan(PlanText{}.Read(), devices);
  std::vector<std::pair<int, int>> order;
  for (const auto& p : expanded.positions) order.emplace_back(p.i, p.j);
  EXPECT_THAT(order, testing::ElementsAre(std::pair(0, 0), std::pair(1, 0), std::pair(2, 0),
                                          std::pair(2, 1), std::pair(1, 1), std::pair(0, 1)));
  PlanText random;
  random.plan = "order = \"random\"\norder_seed = 3";
  auto shuffled = ExpandPlan(random.Read(), devices).positions;
  const auto planned = [&] { return ToJson(ToPlanFile(ExpandPlan(random.Read(), devices))); };
  EXPECT_EQ(planned(), planned());
  std::sort(shuffled.begin(), shuffled.end(),
            [](const auto& a, const auto& b) { return std::pair(a.j, a.i) < std::pair(b.j, b.i); });
  for (int n = 0; n < 6; ++n) EXPECT_EQ(shuffled[n].j * 3 + shuffled[n].i, n);
}

TEST(Plan, DryRunSaysWhatIsOffTheSensor) {
  hal::sim::TestLab lab;
  lab.camera = "pitch_m = 0.01\nwidth = 16\nheight = 16";  // as large as the lattice: only the
                                                           // shifts fall off
  const hal::Devices devices = hal::sim::SimulatedLab(lab.Config()).MakeDevices();
  PlanText text;
  text.grid = "width = 2\nheight = 1";
  const CaptureEstimate estimate = DryRun(ExpandPlan(text.Read(), devices), devices);
  // Each of the two positions is 0.01 m off the axis: half a column of 8 is lost, its centres lie
  // on the edge or outside.
  EXPECT_NEAR(estimate.off_sensor_share, 1.0 / 16, 1.0 / 16 + 1e-12);
  EXPECT_EQ(estimate.positions, 2);
  // 5 rungs: 2 brackets, 2 x 4 darks each, a reference before and after.
  EXPECT_EQ(estimate.frames, 2 * 5 + 8 * 5 + 2);
  EXPECT_GT(estimate.duration_s, 8 * 0.341);
}

TEST(Plan, ExampleFilesFitEachOther) {
  const auto data = std::filesystem::path(LUXFIELD_SOURCE_DIR) / "data";
  for (const auto& [lab, plan] : {std::pair{"ideal", "demo"},
                                  {"headlight", "demo"},
                                  {"small", "small"},
                                  {"reflector", "small-reflector"}}) {
    const hal::Devices devices = hal::MakeDevices(data / "labs" / (std::string(lab) + ".toml"));
    const ExpandedPlan expanded =
        ExpandPlan(ReadPlan(data / "plans" / (std::string(plan) + ".toml")), devices);
    EXPECT_EQ(DryRun(expanded, devices).off_sensor_share, 0) << lab;
  }
}

rig::SensorModel Calibration() {
  rig::SensorModel c;
  c.black_dn = 100;
  c.saturation_dn = 4100;
  c.gain_dn_per_e = 0.5;
  c.read_noise_dn = 2;
  return c;
}

TEST(Exposures, CoverFromBelowSaturationToAboveNoise) {
  const std::vector<double> ladder = {0.001, 0.004, 0.016, 0.064, 0.256, 1.024};
  ExposurePolicy policy;
  policy.saturation_share = 0.9;  // 3590 DN above black
  policy.relevant_share = 1e-2;
  policy.floor_sigmas = 5;  // 10 DN
  const auto choose = [&](double rate) {
    const Rungs r = ChooseRungs(rate, ladder, policy, Calibration());
    return std::pair(r.first, r.last);
  };
  EXPECT_EQ(choose(1e5), std::pair(2, 2));  // 1600 at 16 ms; a hundredth is 16 DN
  EXPECT_EQ(choose(3e4), std::pair(3, 3));
  EXPECT_EQ(choose(5e4), std::pair(3, 3));  // 3200
  EXPECT_EQ(choose(6e4),
            std::pair(2, 3));  // 3840 is too much at 64 ms, at 16 ms a hundredth is 9.6
  EXPECT_EQ(choose(1e8), std::pair(0, 0));  // too bright for the ladder
  EXPECT_EQ(choose(0), std::pair(5, 5));    // dark everywhere: the longest
  policy.relevant_share = 1e-4;
  EXPECT_EQ(choose(1e5), std::pair(2, 5));
}

TEST(Exposures, LevelRatioSeesAWrongExposure) {
  const auto frame = [](double exposure) {
    session::RawFrame f;
    f.width = f.height = 30;
    for (int k = 0; k < 900; ++k)
      f.dn.push_back(
          static_cast<std::uint16_t>(std::min(4100.0, std::round(100 + 5.0 * k * exposure))));
    return f;
  };
  const std::vector<PixelRun> usable = {{0, 900}};
  const auto right = LevelRatio(frame(0.8), 0.8, frame(0.4), 0.4, usable, Calibration(), 0.1);
  ASSERT_TRUE(right);
  EXPECT_NEAR(*right, 1, 1e-3);
  const auto wrong = LevelRatio(frame(0.7), 0.8, frame(0.4), 0.4, usable, Calibration(), 0.1);
  ASSERT_TRUE(wrong);
  EXPECT_NEAR(*wrong, 7.0 / 8, 2e-3);
  EXPECT_FALSE(LevelRatio(frame(1e-6), 2e-6, frame(1e-6), 1e-6, usable, Calibration(), 0.1))
      << "nothing to see";
}

}  // namespace
}  // namespace luxfield::capture
