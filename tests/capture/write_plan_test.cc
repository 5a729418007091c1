#include "luxfield/capture/plan/write_plan.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "luxfield/capture/plan/capture_time.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/capture/take/frame_check.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/session/session_store.h"

namespace luxfield::capture {
namespace {

const std::filesystem::path kData = std::filesystem::path(LUXFIELD_SOURCE_DIR) / "data";

class WritePlanTest : public testing::TestWithParam<const char*> {};

TEST_P(WritePlanTest, ReadPlanGivesThePlanBack) {
  Plan plan = ReadPlan(kData / "plans" / GetParam());
  plan.name = "with \"quotes\" and a \\";
  plan.geometry.grid.u0_m += 0.0123;
  plan.exposure.repeats = 3;
  plan.exposure.measure_pwm = plan.dual;
  plan.exposure.flicker = 0.005;
  plan.order = Order::kRandom;
  plan.order_seed = 5;
  plan.stage = {"", {}, hal::Vec2{0.0123, 0.1}, 0.003};
  const auto file = std::filesystem::path(testing::TempDir()) /
                    (std::string("luxfield_write_plan_") + GetParam());
  WritePlan(file, plan);
  const Plan back = ReadPlan(file);
  EXPECT_EQ(back.name, plan.name);
  EXPECT_EQ(back.rig, plan.rig);
  EXPECT_EQ(back.albedo, plan.albedo);
  EXPECT_EQ(back.dual, plan.dual);
  EXPECT_EQ(back.filter_scale, plan.filter_scale);
  EXPECT_EQ(back.order, plan.order);
  EXPECT_EQ(back.order_seed, plan.order_seed);
  EXPECT_EQ(back.dark_repeats, plan.dark_repeats);
  EXPECT_EQ(back.exposure.min_s, plan.exposure.min_s);
  EXPECT_EQ(back.exposure.max_s, plan.exposure.max_s);
  EXPECT_EQ(back.exposure.relevant_share, plan.exposure.relevant_share);
  EXPECT_EQ(back.exposure.repeats, plan.exposure.repeats);
  EXPECT_EQ(back.exposure.measure_pwm, plan.exposure.measure_pwm);
  EXPECT_EQ(back.reference.every, plan.reference.every);
  EXPECT_EQ(back.reference.max_drift, plan.reference.max_drift);
  EXPECT_EQ(back.reference.resume_share, plan.reference.resume_share);
  EXPECT_EQ(back.reference.interval_s, plan.reference.interval_s);
  EXPECT_EQ(back.reference.max_wait_s, plan.reference.max_wait_s);
  EXPECT_EQ(back.warm_up.variation, plan.warm_up.variation);
  EXPECT_FALSE(back.stage.min);
  ASSERT_TRUE(back.stage.max && back.stage.speed_m_per_s);
  EXPECT_EQ(back.stage.max->x, 0.0123);
  EXPECT_EQ(*back.stage.speed_m_per_s, 0.003);
  const auto &g = back.geometry, &o = plan.geometry;
  EXPECT_EQ(g.delta_m, o.delta_m);
  EXPECT_EQ(g.grid.basis, o.grid.basis);
  EXPECT_EQ(g.grid.spacing_m, o.grid.spacing_m);
  EXPECT_EQ(g.grid.count(), o.grid.count());
  EXPECT_NEAR(g.grid.u0_m, o.grid.u0_m, 1e-15);
  EXPECT_NEAR(g.grid.v0_m, o.grid.v0_m, 1e-15);
  EXPECT_EQ(g.lattice.width, o.lattice.width);
  EXPECT_EQ(g.lattice.ds_m, o.lattice.ds_m);
  EXPECT_NEAR(g.lattice.s0_m, o.lattice.s0_m, 1e-14);
  EXPECT_NEAR(g.lattice.t1_m, o.lattice.t1_m, 1e-14);
  std::filesystem::remove(file);
}

INSTANTIATE_TEST_SUITE_P(Plans, WritePlanTest,
                         testing::Values("bike.toml", "small-dual.toml", "small-reflector.toml"),
                         [](const auto& test) { return "Plan" + std::to_string(test.index); });

// With the brightest pixels that the probes found, the prediction is the capture's own time.
TEST(CaptureTime, IsTheRigsClock) {
  for (const char* name : {"small", "small-dual"}) {
    SCOPED_TRACE(name);
    const auto lab = kData / "labs" / (std::string(name) + ".toml");
    Plan plan = ReadPlan(kData / "plans" / (std::string(name) + ".toml"));
    plan.warm_up.window_s = plan.warm_up.interval_s = 1;
    plan.warm_up.variation = 1;
    const auto folder = std::filesystem::path(testing::TempDir()) / "luxfield_capture_time";
    std::filesystem::remove_all(folder);
    hal::Devices devices = hal::MakeDevices(lab);
    RunCapture(plan, devices, folder);
    const session::SessionReader session(folder);

    // The shortest exposure of a bracket is below saturation: its frames tell the rates.
    const ExpandedPlan expanded = ExpandPlan(plan, devices);
    const auto usable = UsablePixels(devices.camera->capabilities(), devices.rig.camera);
    const auto rate = [&](const session::FrameRecord& record) {
      const auto shown = Measure(session.ReadFrame(record), usable, devices.rig.camera);
      return (shown.brightest_dn - devices.rig.camera.black_dn) / record.exposure_s;
    };
    std::vector<double> rates;
    double reference = 0, begin = 0, end = 0;
    int kept = 0, last_print = -1, last_i = -1, last_j = -1;
    for (const session::FrameRecord& record : session.frames()) {
      if (kept++ == 0) begin = record.t_start_s;
      end = record.t_start_s + record.exposure_s;
      if (record.kind == session::FrameKind::kReference && reference == 0) reference = rate(record);
      if (record.kind != session::FrameKind::kPosition) continue;
      if (record.i != last_i || record.j != last_j || record.print != last_print)
        rates.push_back(rate(record));
      last_i = record.i, last_j = record.j, last_print = record.print;
    }
    hal::Devices fresh = hal::MakeDevices(lab);
    const auto time =
        PredictCapture(expanded, rates, reference, fresh.rig.camera, MeasureFrameTimes(fresh),
                       TravelOf(expanded, fresh.stage->limits(), {0, 0}));
    EXPECT_EQ(time.frames, kept);
    // Not in it: shutter and print changes of 0.2 s, and the first frame's monitor reading.
    const double changes = 0.2 * (plan.dual ? 2 * plan.geometry.grid.count() + 6 : 4);
    EXPECT_NEAR(time.duration_s, end - begin, changes);
    EXPECT_LT(time.duration_s, DryRun(expanded, fresh).duration_s);
    std::filesystem::remove_all(folder);
  }
}

}  // namespace
}  // namespace luxfield::capture
