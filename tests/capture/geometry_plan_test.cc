#include "luxfield/capture/plan/geometry_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/capture/take/capture_geometry.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/session/plan_json.h"
#include "tests/hal/test_lab.h"

namespace luxfield::capture {
namespace {

namespace fs = std::filesystem;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using testing::HasSubstr;

GeometryPlan MakePlan(double step_m = 0.02, double max_s = 1, const std::string& stage = "") {
  return ReadGeometryPlan(core::Config::FromString(
      fmt::format("[plan]\nkind = \"geometry\"\nposes = 2\n[stage]\nstep_m = {}\n{}\n"
                  "[exposure]\nmin_s = 0.01\nmax_s = {}\n",
                  step_m, stage, max_s),
      "plan.toml"));
}

TestLab Bench(double intensity = 20) {
  TestLab lab;
  lab.lab = "seed = 3";
  lab.camera = "pitch_m = 0.003\nwidth = 80\nheight = 64";
  lab.errors = fmt::format(
      "[targets]\nspacer_m = 0.05\nsource_m = [0, 0, -0.3]\nsource_intensity = {}\n"
      "[targets.mask]\ncolumns = 4\nrows = 3\npitch_m = 0.01\n"
      "[errors.read_noise]\nrms_dn = 2\n[errors.stage]\nrepeatability_m = 1e-5\n",
      intensity);
  return lab;
}

template <typename Action>
std::string Refusal(Action action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was refused";
}

TEST(GeometryPlan, AsksForTheMaskOnAndOffItsSpacer) {
  const SimulatedLab lab(Bench().Config());
  const auto expanded = ExpandPlan(MakePlan(), lab.MakeDevices());
  ASSERT_EQ(expanded.views.size(), 10u);  // no board without a lens
  EXPECT_EQ(expanded.views[4].target, "mask");
  EXPECT_EQ(expanded.views[4].setpoint->y, -0.02);
  EXPECT_EQ(expanded.views[5].target, "mask on spacer");
  EXPECT_EQ(expanded.stage_repeatability_m, 1e-5);
  EXPECT_EQ(DryRun(expanded, lab.MakeDevices()).masks, 10);
}

TEST(GeometryPlan, RefusesWhatTheLabCannotDo) {
  TestLab bare = Bench();
  bare.errors = "";
  const SimulatedLab without(bare.Config()), lab(Bench().Config());
  EXPECT_THAT(Refusal([&] { ExpandPlan(MakePlan(), without.MakeDevices()); }),
              HasSubstr("has no targets"));
  EXPECT_THAT(Refusal([&] { ExpandPlan(MakePlan(0.2), lab.MakeDevices()); }),
              HasSubstr("stage.step_m = 0.2: (0.2, 0) m is outside the stage's"));
  EXPECT_THAT(Refusal([&] { ExpandPlan(MakePlan(0.02, 100), lab.MakeDevices()); }),
              HasSubstr("max_s"));
  TestLab even = Bench();
  even.errors.replace(even.errors.find("rows = 3"), 8, "rows = 4");
  EXPECT_THAT(Refusal([&] { SimulatedLab twisted(even.Config()); }),
              HasSubstr("odd and an even number"));
}

TEST(GeometryPlan, KeepsWithinItsOwnLimits) {
  const auto expand = [](const char* stage) {
    const GeometryPlan plan = MakePlan(0.02, 1, stage);
    return ToJson(
        ToPlanFile(ExpandPlan(plan, SimulatedLab(Bench().Config(), {}, plan.stage).MakeDevices())));
  };
  EXPECT_THAT(Refusal([&] { expand("max_m = [0.05, 0.01]"); }),
              HasSubstr("stage.step_m = 0.02: (0, 0.02) m lies beyond stage.max_m = [0.05, 0.01]"));
  EXPECT_EQ(expand("speed_m_per_s = 0.001").at("stage"),
            (core::Json{{"repeatability_m", 1e-5}, {"speed_m_per_s", 0.001}}));
}

TEST(GeometryPlan, CapturesEveryViewOnceBelowSaturation) {
  core::SetInterruptCountForTest(0);
  const fs::path folder = fs::path(testing::TempDir()) / "luxfield_geometry_plan";
  fs::remove_all(folder);
  const SimulatedLab lab(Bench().Config());
  hal::Devices devices = lab.MakeDevices();
  // Asked to pause after three frames, then resumed.
  CaptureOptions options;
  options.on_frame = [](const CaptureSummary& summary) {
    if (summary.frames == 3) core::SetInterruptCountForTest(1);
  };
  EXPECT_THROW(RunGeometryCapture(MakePlan(), devices, folder, options), Interrupted);
  core::SetInterruptCountForTest(0);
  EXPECT_FALSE(VerifySession(folder).problems.empty());
  EXPECT_EQ(MissingGeometryFrames(session::SessionReader(folder)), 7);
  options.on_frame = {};
  options.resume = true;
  RunGeometryCapture(MakePlan(), devices, folder, options);
  EXPECT_TRUE(VerifySession(folder).problems.empty());
  const session::SessionReader session(folder);
  ASSERT_EQ(session.frames().size(), 10u);
  for (const auto& record : session.frames()) {
    EXPECT_EQ(record.kind, session::FrameKind::kTarget);
    const session::RawFrame frame = session.ReadFrame(record);
    float brightest = 0;
    for (std::size_t k = 0; k < frame.size(); ++k) brightest = std::max(brightest, frame.at(k));
    EXPECT_LE(brightest, 100 + 0.8 * 3900);
    EXPECT_GE(brightest, 100 + 0.1 * 3900);
  }
  fs::remove_all(folder);
}

TEST(GeometryPlan, SaysWhichLightIsMissing) {
  const fs::path folder = fs::path(testing::TempDir()) / "luxfield_geometry_plan";
  for (const auto& [intensity, what] :
       {std::pair{1e-4, "shows"}, std::pair{1e6, "too bright even at 0.01 s"}}) {
    fs::remove_all(folder);
    const SimulatedLab lab(Bench(intensity).Config());
    hal::Devices devices = lab.MakeDevices();
    EXPECT_THAT(Refusal([&] { RunGeometryCapture(MakePlan(), devices, folder); }), HasSubstr(what));
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::capture
