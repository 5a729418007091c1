// What plan, capture and merge each say of light on the outer filters: the same.
#include "luxfield/planning/planned_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "luxfield/capture/review/session_review.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "tests/planning/lab_session.h"

namespace luxfield::planning {
namespace {

std::string Lab(double side_m) {
  return fmt::format(R"([lab]
driver = "sim"
seed = 5
[rig]
kind = "lensless"
delta_m = 0.25
[filter]
spacing_m = 0.02
[lamp]
kind = "square"
side_m = {}
radiance = 1000
[camera]
pitch_m = 0.01
width = 32
height = 24
responsivity_e_per_s_per_w_m2 = [5000]
{}{}{})",
                     side_m, kCameraCodes, kStage, kCameraNoise);
}

// 5 x 4 filters: 3 x 2 interior cells of 20 mm.
constexpr const char* kPlan = R"([plan]
dark_repeats = 1
[rig]
kind = "lensless"
delta_m = 0.25
[filter]
spacing_m = 0.02
[grid]
width = 5
height = 4
[lattice]
width = 8
height = 8
ds_m = 0.02
[exposure]
min_s = 0.01
max_s = 3
ratio = 4
relevant_share = 0.01
[reference]
every = 40
max_drift = 0.05
[warm_up]
window_s = 10
interval_s = 1
)";

TEST(EdgeLightOfSessions, IsWhatPlanCaptureAndMergeSay) {
  const auto plan = capture::ReadPlan(core::Config::FromString(kPlan, "plan.toml"));
  // Within the interior; and 60 mm: half a cell beyond it along v.
  for (const double side_m : {0.036, 0.06}) {
    const bool reaches = side_m > 0.04;
    ScratchFolder folder("edges_lab");
    std::ofstream(folder.path() / "lab.toml") << Lab(side_m);
    const LabSession session("edges", Lab(side_m), kPlan);
    const auto planned = PlannedEdgeLight(folder.path() / "lab.toml", plan.geometry, false);
    const auto captured = capture::FindSessionEdges(session.Read());
    const auto merged = reconstruct::MergeSession(session.Read(), {});
    const auto measured = lightfield::FindEdgeLight(std::span(&merged, 1));
    ASSERT_TRUE(planned && captured);
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& side = measured.sides[k];
      EXPECT_EQ(side.reached, reaches && k >= 2) << side.name << " " << side.ratio;
      EXPECT_EQ(planned->sides[k].reached, side.reached) << side.name;
      EXPECT_EQ(captured->light.sides[k].reached, side.reached) << side.name;
      // The sensor moves along with the filter, so that a session sees some of the outer filters'
      // images only in part; a plan samples the lamp itself, in cells: within a fifth.
      EXPECT_NEAR(planned->sides[k].ratio, side.ratio, 0.2) << side.name;
      EXPECT_NEAR(captured->light.sides[k].ratio, side.ratio, 0.05) << side.name;
    }
    const auto verdict = Judge(capture::ReviewSession(session.Read().folder()));
    const auto warned = std::count_if(verdict.begin(), verdict.end(), [](const auto& judgement) {
      return judgement.text.find("outer filters") != std::string::npos;
    });
    EXPECT_EQ(warned, reaches ? 2 : 0);
  }
}

TEST(EdgeLightOfSessions, IsNotForetoldOfDualFilters) {
  ScratchFolder folder("edges_dual");
  std::ofstream(folder.path() / "lab.toml") << Lab(0.06);
  const auto plan = capture::ReadPlan(core::Config::FromString(kPlan, "plan.toml"));
  EXPECT_FALSE(PlannedEdgeLight(folder.path() / "lab.toml", plan.geometry, true));
}

}  // namespace
}  // namespace luxfield::planning
