// `luxfield plan --max-error`: what it writes is what `plan` and `capture` take; what is out of
// reach exits 2 with its limit.
#include <gtest/gtest.h>

#include "program.h"

namespace luxfield::e2e {
namespace {

std::vector<std::string> PlanFor(const std::string& error) {
  return {"plan",         SourceFile("data/plans/small.toml").string(),
          "--lab",        SourceFile("data/labs/small.toml").string(),
          "--scene",      SourceFile("data/scenes/demo.toml").string(),
          "--texels",     "24",
          "--receivers",  "40",
          "--max-error",  error,
          "--no-capture", "--quiet",
          "-o",           "found.toml",
          "--report",     "found.html"};
}

TEST(PlanTarget, WritesAPlanALabAndTheCurve) {
  const auto folder = FreshFolder("plan_target");
  const Outcome found = RunLuxfield(PlanFor("60%"), folder);
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_NE(found.out.find("recommended"), std::string::npos) << found.out;
  const std::string page = ReadText(folder / "found.html"), curve = ReadText(folder / "found.svg");
  EXPECT_NE(page.find("bspline2"), std::string::npos);
  EXPECT_NE(page.find(curve), std::string::npos);
  EXPECT_NE(curve.find("<svg"), std::string::npos);
  const Outcome dry = RunLuxfield({"plan", "found.toml", "--lab", "found.lab.toml"}, folder);
  EXPECT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_NE(dry.out.find("positions"), std::string::npos) << dry.out;
}

// Its session goes with the scratch folder that it is in.
TEST(PlanTarget, TheSimulatedCaptureLeavesNothingBehind) {
  const auto folder = FreshFolder("plan_and_capture");
  auto words = PlanFor("60%");
  std::erase(words, "--no-capture");
  const Outcome found = RunLuxfield(words, folder);
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_NE(found.out.find("simulated capture"), std::string::npos) << found.out;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    EXPECT_TRUE(entry.is_regular_file() && entry.path().extension() != ".exr") << entry.path();
}

TEST(PlanTarget, OutOfReachExitsTwoWithTheLimitAndTheCurve) {
  const auto folder = FreshFolder("plan_out_of_reach");
  const Outcome outcome = RunLuxfield(PlanFor("0.0001%"), folder);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("the least error within reach is"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("limited by"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "found.toml"));
  EXPECT_TRUE(std::filesystem::exists(folder / "found.html"));
}

TEST(PlanTarget, WrongArgumentsAreRefusedByName) {
  const auto folder = FreshFolder("plan_arguments");
  const std::string lab = SourceFile("data/labs/small.toml").string();
  const Outcome nothing = RunLuxfield({"plan", "--lab", lab}, folder);
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_NE(nothing.err.find("PLAN"), std::string::npos) << nothing.err;
  const Outcome scene = RunLuxfield({"plan", "--lab", lab, "--max-error", "1%"}, folder);
  EXPECT_EQ(scene.exit_code, 2);
  EXPECT_NE(scene.err.find("--scene"), std::string::npos) << scene.err;
}

}  // namespace
}  // namespace luxfield::e2e
