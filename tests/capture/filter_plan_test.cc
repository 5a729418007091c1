#include "luxfield/capture/plan/filter_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "luxfield/capture/take/capture_filter.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/hal/test_lab.h"

namespace luxfield::capture {
namespace {

namespace fs = std::filesystem;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using session::FrameKind;
using testing::HasSubstr;

FilterPlan MakePlan(double max_s, int exposures = 2) {
  return ReadFilterPlan(core::Config::FromString(
      fmt::format("[plan]\nkind = \"filter\"\n[exposure]\nmin_s = 0.01\nmax_s = {}\n"
                  "exposures = {}\nrepeats = 2\n",
                  max_s, exposures),
      "plan.toml"));
}

// The light fills three quarters of a pixel in 0.1 s.
TestLab Bench(const std::string& filter = "spacing_m = 0.02") {
  TestLab lab;
  lab.lab = "seed = 3";
  lab.filter = filter + "\n[filter.bench]\nirradiance = 58";
  lab.errors = "[errors.read_noise]\nrms_dn = 2\n[errors.photon_noise]\n";
  return lab;
}

std::string Refusal(const FilterPlan& plan, const TestLab& lab, const fs::path& folder) {
  try {
    hal::Devices devices = SimulatedLab(lab.Config()).MakeDevices();
    RunFilterCapture(plan, devices, folder);
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was refused";
}

class FilterPlanTest : public testing::Test {
 protected:
  void SetUp() override {
    core::SetInterruptCountForTest(0);
    fs::remove_all(folder_);
  }
  void TearDown() override {
    core::SetInterruptCountForTest(0);
    fs::remove_all(folder_);
  }
  const fs::path folder_ = fs::path(testing::TempDir()) / "luxfield_filter_plan";
};

TEST_F(FilterPlanTest, RefusesWhatTheLabCannotDo) {
  TestLab bare = Bench();
  bare.filter = "spacing_m = 0.02";
  EXPECT_THAT(Refusal(MakePlan(1.28), bare, folder_), HasSubstr("\"filter holder\""));
  EXPECT_THAT(Refusal(MakePlan(0.32), Bench(), folder_), HasSubstr("above exposure.max_s"));
  EXPECT_EQ(ReadPlanKind(core::Config::FromString("[plan]\nkind = \"filter\"\n", "plan.toml")),
            PlanKind::kFilter);
  std::string mosaic = Bench().Toml();
  mosaic.replace(mosaic.find("[1000]"), 6, "[1000, 1000, 1000]\ncfa = \"RGGB\"");
  mosaic.replace(mosaic.find("seed = 3"), 8, "seed = 3\nchannels = 3");
  const SimulatedLab lab(core::Config::FromString(mosaic, "lab.toml"));
  EXPECT_THROW(ExpandPlan(MakePlan(1.28), lab.MakeDevices()), InputError);
}

TEST_F(FilterPlanTest, TakesHolderPrintsAndDarksAndResumesBetweenFrames) {
  const TestLab dual = Bench("kind = \"dual\"\nbasis = \"quadratic\"\nspacing_m = 0.02");
  hal::Devices devices = SimulatedLab(dual.Config()).MakeDevices();
  // Paused after the holder's first frame and within a print: nothing is taken twice.
  CaptureOptions options;
  options.on_frame = [](const CaptureSummary& s) {
    if (s.frames == 1) core::SetInterruptCountForTest(1);
  };
  EXPECT_THROW(RunFilterCapture(MakePlan(1.28), devices, folder_, options), Interrupted);
  EXPECT_EQ(MissingFilterFrames(session::SessionReader(folder_)), 13);
  core::SetInterruptCountForTest(0);
  options.resume = true;
  options.on_frame = [](const CaptureSummary& s) {
    if (s.frames == 4) core::SetInterruptCountForTest(1);
  };
  EXPECT_THROW(RunFilterCapture(MakePlan(1.28), devices, folder_, options), Interrupted);
  core::SetInterruptCountForTest(0);
  options.on_frame = {};
  EXPECT_EQ(RunFilterCapture(MakePlan(1.28), devices, folder_, options).frames, 14 - 5);
  const session::SessionReader session(folder_);
  EXPECT_TRUE(session.sealed());
  EXPECT_EQ(MissingFilterFrames(session), 0);
  EXPECT_TRUE(VerifySession(folder_).problems.empty());
  std::map<int, std::map<double, int>> frames;  // by view (-1: dark) and exposure
  for (const session::FrameRecord& record : session.frames())
    ++frames[record.kind == FrameKind::kDark ? -1 : record.i][record.exposure_s];
  ASSERT_EQ(frames.size(), 4u);
  const double shortest = frames.at(0).begin()->first;
  EXPECT_EQ(frames.at(0), (std::map<double, int>{{shortest, 2}}));
  for (const int view : {1, 2, -1}) {
    ASSERT_EQ(frames.at(view).size(), 2u);
    EXPECT_EQ(frames.at(view).begin()->first, shortest);
    EXPECT_NEAR(frames.at(view).rbegin()->first, 8 * shortest, 1e-9);
    for (const auto& [exposure_s, count] : frames.at(view)) EXPECT_EQ(count, 2);
  }
}

}  // namespace
}  // namespace luxfield::capture
