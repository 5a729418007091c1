#include "luxfield/planning/capture_planner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "luxfield/bench/bench_plan.h"
#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/planning/plan_for_target.h"
#include "tests/planning/lab_session.h"

namespace luxfield::planning {
namespace {

const std::filesystem::path kData = std::filesystem::path(LUXFIELD_SOURCE_DIR) / "data";

constexpr const char* kScene = R"([camera]
position = [-1.6, -0.6, 1.4]
look_at = [0, 2.6, 0.7]
vertical_fov_deg = 50
width = 64
height = 48
[[material]]
name = "grey"
albedo = [0.5, 0.5, 0.5]
[[quad]]
corner = [-2, -1, 0]
edge_u = [4, 0, 0]
edge_v = [0, 4, 0]
material = "grey"
[[quad]]
corner = [-2, 3, 0]
edge_u = [4, 0, 0]
edge_v = [0, 0, 2]
material = "grey"
[[luminaire]]
name = "lamp"
file = "none.lf.exr"
position = [0, 0, 0.7]
look_at = [0, 3, 0.6]
)";

// A dim lamp before a camera of few, noisy pixels: noise and basis both matter.
const std::string kLab = std::string(R"([lab]
driver = "sim"
name = "plan from a target"
seed = 1
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
kind = "basis"
basis = "bspline2"
spacing_m = 0.02
[lamp]
kind = "lightfield"
file = "lamp.lf.exr"
[camera]
width = 56
height = 56
pitch_m = 0.01
bits = 14
black_dn = 500
saturation_dn = 16000
gain_dn_per_e = 0.5
responsivity_e_per_s_per_w_m2 = [2000]
min_exposure_s = 1e-4
max_exposure_s = 20
exposure_step_s = 1e-5
readout_s = 0.05
[sampling]
u_per_cell = 10
[errors.photon_noise]
[errors.read_noise]
rms_dn = 20
[errors.dark_current]
e_per_s = 100
[errors.prnu]
rms = 0.005
[errors.density]
relative = 0.01
)") + kStage;

// Spots on F whose places and sizes change over I, in a basis much finer than any plan's.
lightfield::LightField SpottedLamp() {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          14, 14, 0.0085);
  constexpr int kSize = 48;
  g.lattice = {kSize, kSize, -0.24, 0.24, 0.01, 0.01};
  lightfield::LightField field(g);
  for (int m = 0; m < g.grid.count(); ++m) {
    const auto u = g.grid.centre(m % g.grid.width, m / g.grid.width);
    auto image = field.image(m, 0);
    for (std::size_t k = 0; k < image.size(); ++k) {
      const auto s = g.lattice.centre(static_cast<int>(k) / kSize, static_cast<int>(k) % kSize);
      const auto spot = [](double x, double y, double width) {
        return std::exp(-0.5 * (x * x + y * y) / (width * width));
      };
      image[k] = static_cast<float>(1e4 * spot(s.x - 0.02, s.y, 0.09) *
                                    (spot(u.x - 0.02 - 0.1 * s.x, u.y + 0.01, 0.012) +
                                     0.7 * spot(u.x + 0.025, u.y - 0.015 - 0.08 * s.y, 0.009) +
                                     0.1 * spot(u.x, u.y, 0.03)));
    }
  }
  return field;
}

class CapturePlannerTest : public testing::Test {
 protected:
  CapturePlannerTest() {
    core::WriteFileAtomically(folder_ / "scene.toml", kScene);
    core::WriteFileAtomically(folder_ / "lab.toml", kLab);
    lightfield::WriteLightField(folder_ / "lamp.lf.exr", SpottedLamp());
  }

  CapturePlannerOptions Options() const {
    CapturePlannerOptions options;
    options.lab = folder_ / "lab.toml";
    options.scene = folder_ / "scene.toml";
    options.base = capture::ReadPlan(kData / "plans" / "small.toml");
    options.texels = 64;
    options.cells = 72;
    options.receivers = 150;
    options.truth_nodes = 144;
    return options;
  }

  const ScratchFolder scratch_{"capture_planner"};
  const std::filesystem::path& folder_ = scratch_.path();
};

TEST_F(CapturePlannerTest, EveryFamilyTradesTimeForAccuracy) {
  const CapturePlanner planner(Options());
  EXPECT_LT(planner.truth_error(), 0.01);
  const auto plans = planner.Plans();
  std::size_t families = 0;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    const bool first = k == 0 || plans[k].family != plans[k - 1].family;
    families += first;
    if (first) continue;
    EXPECT_GT(plans[k].capture_s, plans[k - 1].capture_s);
    EXPECT_LT(plans[k].error(), plans[k - 1].error());
  }
  EXPECT_EQ(families, 6u);
  const PlannedCapture* loose = Fastest(plans, 0.3);
  const PlannedCapture* tight = Fastest(plans, 0.06);
  ASSERT_TRUE(loose && tight);
  EXPECT_LT(loose->capture_s, tight->capture_s);
  EXPECT_LE(tight->error(), 0.06);
  EXPECT_EQ(Fastest(plans, 1e-9), nullptr);
  EXPECT_LE(MostAccurate(plans).error(), tight->error());
}

// A sample of what `luxfield bench plan` runs: errors and times of captures against predictions.
TEST_F(CapturePlannerTest, CapturesAreAsAccurateAndAsLongAsPredicted) {
  bench::BenchPlanOptions options;
  options.lab = Options().lab;
  options.scene = Options().scene;
  options.plan = kData / "plans" / "small.toml";
  options.folder = folder_ / "bench";
  options.targets = {0.2, 0.06};
  options.runs = 4;
  options.texels = 64;
  options.receivers = 200;
  options.seed = 20261122;
  const nlohmann::json rows = bench::BenchPlan(options);
  std::vector<double> observed;
  for (const auto& row : rows) {
    std::printf("%s\n", row.dump().c_str());
    if (row["sources"] != "noise") continue;
    // Four runs tell their scatter to a third; the sampled lamp, and pixels between which the
    // filters stop, are good to some per cent of the error.
    EXPECT_NEAR(row["ratio"].get<double>(), 1, 0.1 + 6 * row["ratio_se"].get<double>());
    // The shutter closes and opens twice, 0.2 s each.
    EXPECT_NEAR(row["rig_s"].get<double>(), row["capture_s"].get<double>(),
                0.8 + 0.01 * row["capture_s"].get<double>());
    EXPECT_LE(row["predicted"].get<double>(), row["target"].get<double>());
    observed.push_back(row["observed"].get<double>());
  }
  ASSERT_EQ(observed.size(), 2u);
  EXPECT_LT(observed[1], observed[0]);
}

TEST_F(CapturePlannerTest, ThePlanFoundIsOneThatCaptureTakes) {
  const CapturePlanner planner(Options());
  PlanForTargetOptions target;
  target.max_rel_error = 0.15;
  target.folder = folder_ / "capture";
  const PlanForTarget answer = FindPlan(planner, target);
  ASSERT_TRUE(answer.recommended && answer.capture);
  EXPECT_LE(answer.capture->error.value, 0.15);
  EXPECT_EQ(answer.capture->flagged, 0);
  planner.WritePlanAndLab(*answer.recommended, folder_ / "found.toml", folder_ / "found.lab.toml");
  const hal::Devices devices = hal::MakeDevices(folder_ / "found.lab.toml");
  const auto expanded = capture::ExpandPlan(capture::ReadPlan(folder_ / "found.toml"), devices);
  EXPECT_EQ(static_cast<int>(expanded.positions.size()), answer.recommended->positions());
  EXPECT_EQ(capture::DryRun(expanded, devices).off_sensor_share, 0);
}

// A plan that the search would take for its own error and that misses it on other receivers, with
// the target half way between: chosen in the first round, it has to give way to one that keeps it.
struct LuckyPlan {
  PlannedCapture predicted, confirmed;
  double target() const { return 0.5 * (predicted.error() + confirmed.error()); }
};

std::optional<LuckyPlan> FindLuckyPlan(const CapturePlanner& planner,
                                       const std::vector<PlannedCapture>& plans) {
  for (const PlannedCapture& plan : plans) {
    if (Fastest(plans, plan.error()) != &plan) continue;
    const LuckyPlan lucky{plan, planner.Confirmed(plan)};
    if (!(lucky.confirmed.error() > plan.error() && Fastest(plans, lucky.target()) == &plan))
      continue;
    auto rest = plans;
    if (FastestConfirmed(planner, lucky.target(), &rest)) return lucky;
  }
  return {};
}

TEST_F(CapturePlannerTest, AnotherPlanIsFoundWhereTheFirstMissesOnOtherReceivers) {
  CapturePlannerOptions how = Options();
  how.seed = 4;  // whose other places of the picture are harder on the fast plans
  const CapturePlanner planner(how);
  const auto plans = planner.Plans();
  const auto lucky = FindLuckyPlan(planner, plans);
  ASSERT_TRUE(lucky.has_value());
  PlanForTargetOptions options;
  options.max_rel_error = lucky->target();
  options.capture = false;
  const PlanForTarget answer = FindPlan(planner, options);
  ASSERT_TRUE(answer.recommended.has_value());
  const PlannedCapture& found = *answer.recommended;
  std::printf("target %.4f: %s in %.1f s, %.4f foretold, %.4f on others; then %s in %.1f s, %.4f\n",
              options.max_rel_error, lucky->predicted.family.c_str(), lucky->predicted.capture_s,
              lucky->predicted.error(), lucky->confirmed.error(), found.family.c_str(),
              found.capture_s, found.error());
  EXPECT_TRUE(found.confirmed);
  EXPECT_LE(found.error(), options.max_rel_error);
  EXPECT_GE(found.capture_s, lucky->predicted.capture_s);
  EXPECT_EQ(planner.Confirmed(found).error(), found.error());
  // The first one stays in the list with what the others said, and whatever is faster than the
  // answer misses the target, as far as anybody looked.
  const auto is_lucky = [&](const PlannedCapture& p) {
    return p.confirmed && p.error() == lucky->confirmed.error();
  };
  EXPECT_EQ(std::count_if(answer.plans.begin(), answer.plans.end(), is_lucky), 1);
  for (const PlannedCapture& plan : answer.plans)
    if (plan.capture_s < found.capture_s) {
      EXPECT_GT(plan.error(), options.max_rel_error);
    }
  // Without the other receivers the first one would have been the answer.
  EXPECT_EQ(Fastest(plans, options.max_rel_error)->capture_s, lucky->predicted.capture_s);
}

// Prints that are 6 % too dense are in no prediction: the first capture shows them, and the next
// plan leaves them room.
TEST_F(CapturePlannerTest, TheNextPlanLeavesRoomForWhatACaptureShowed) {
  std::string lab = kLab;
  const std::string density = "relative = 0.01";
  lab.replace(lab.find(density), density.size(), "relative = 0.06");
  core::WriteFileAtomically(folder_ / "lab.toml", lab);
  const CapturePlanner planner(Options());
  PlanForTargetOptions options;
  options.max_rel_error = 0.085;
  options.folder = folder_ / "capture";
  auto plans = planner.Plans();
  const PlannedCapture* first = FastestConfirmed(planner, options.max_rel_error, &plans);
  ASSERT_TRUE(first);
  const SimulatedCapture capture = planner.Simulate(*first, options.folder, options.seed);
  ASSERT_GT(capture.error.value, options.max_rel_error);
  const PlanForTarget answer = FindPlan(planner, options);
  ASSERT_TRUE(answer.recommended && answer.capture) << answer.limit;
  std::printf(
      "first %.4f foretold, %.4f captured; after %d captures %.4f foretold, %.4f captured\n",
      first->error(), capture.error.value, answer.captures, answer.recommended->error(),
      answer.capture->error.value);
  EXPECT_GE(answer.captures, 2);
  EXPECT_LE(answer.capture->error.value, options.max_rel_error);
  EXPECT_GT(answer.recommended->capture_s, first->capture_s);
  const double shown = std::sqrt(std::pow(capture.error.value, 2) - std::pow(first->error(), 2));
  EXPECT_LE(std::hypot(answer.recommended->error(), shown), options.max_rel_error * (1 + 1e-9));
}

TEST_F(CapturePlannerTest, WhatIsOutOfReachIsSaidWithItsLimit) {
  const CapturePlanner planner(Options());
  PlanForTargetOptions target;
  target.max_rel_error = 1e-6;
  target.folder = folder_ / "capture";
  const PlanForTarget answer = FindPlan(planner, target);
  EXPECT_FALSE(answer.recommended);
  EXPECT_THAT(answer.limit, testing::HasSubstr("the least error within reach is"));
  EXPECT_THAT(answer.limit, testing::HasSubstr("limited by"));
}

TEST_F(CapturePlannerTest, ScenesThatSeeNothingAreRefused) {
  std::string text = kScene;
  text.replace(text.find("look_at = [0, 3, 0.6]"), 21, "look_at = [0, -9, 9.0]");
  core::WriteFileAtomically(folder_ / "scene.toml", text);
  EXPECT_THROW(CapturePlanner{Options()}, InputError);
  text = text.substr(0, text.find("[[luminaire]]"));
  core::WriteFileAtomically(folder_ / "scene.toml", text);
  EXPECT_THROW(CapturePlanner{Options()}, InputError);
}

}  // namespace
}  // namespace luxfield::planning
