#include "luxfield/capture/take/capture_sensor.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <map>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/session/session_store.h"
#include "tests/hal/test_lab.h"

namespace luxfield::capture {
namespace {

namespace fs = std::filesystem;
using hal::Devices;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using testing::HasSubstr;

// An even source that fills the sensor (7800 electrons) in a second.
TestLab Bench() {
  TestLab lab;
  lab.lab = "seed = 7";
  lab.lamp = "kind = \"square\"\nside_m = 2\nradiance = 1220";
  lab.camera = "pitch_m = 0.001\nwidth = 32\nheight = 24";
  lab.errors = "[errors.photon_noise]\n[errors.read_noise]\nrms_dn = 2\n";
  return lab;
}

std::string PlanText(double min_s, double max_s, int levels = 12) {
  return fmt::format(
      "[plan]\nkind = \"sensor\"\n[exposure]\nmin_s = {}\nmax_s = {}\nlevels = {}\n[warm_up]\n"
      "window_s = 10\ninterval_s = 1\n",
      min_s, max_s, levels);
}

SensorPlan MakePlan(double min_s, double max_s, int levels = 12) {
  return ReadSensorPlan(core::Config::FromString(PlanText(min_s, max_s, levels), "plan.toml"));
}

class CaptureSensor : public testing::Test {
 protected:
  void SetUp() override { core::SetInterruptCountForTest(0); }
  void TearDown() override { core::SetInterruptCountForTest(0); }
  static fs::path NewFolder() {
    static int counter = 0;
    const auto path =
        fs::path(testing::TempDir()) / fmt::format("sensor_{}_{}", ::getpid(), counter++);
    fs::remove_all(path);
    return path;
  }
};

TEST_F(CaptureSensor, TakesPairsOfEveryLevelUpAndDown) {
  const auto folder = NewFolder();
  Devices devices = SimulatedLab(Bench().Config()).MakeDevices();
  const CaptureSummary summary = RunSensorCapture(MakePlan(0.01, 1.5), devices, folder);
  EXPECT_EQ(summary.frames, 48);
  EXPECT_EQ(summary.rejected, 0);
  EXPECT_EQ(summary.flagged, 0);
  const session::SessionReader session(folder);
  EXPECT_TRUE(session.sealed());
  EXPECT_TRUE(VerifySession(folder).problems.empty());
  std::map<std::pair<bool, int>, std::vector<double>> times;  // flat, repeat -> in order
  for (const auto& frame : session.frames())
    times[{frame.kind == session::FrameKind::kFlat, frame.repeat}].push_back(frame.exposure_s);
  ASSERT_EQ(times.size(), 4u);
  const auto& up = times[{true, 0}];
  ASSERT_EQ(up.size(), 12u);
  EXPECT_NEAR(up.front(), 0.01, 1e-12);
  EXPECT_NEAR(up.back(), 1.5, 1e-9);
  EXPECT_TRUE(std::is_sorted(up.begin(), up.end()));
  EXPECT_EQ(std::vector<double>(up.rbegin(), up.rend()), (times[{true, 1}]));
  EXPECT_EQ((times[{false, 0}]), up);
}

TEST_F(CaptureSensor, ResumesWhereItWasInterrupted) {
  const auto folder = NewFolder();
  CaptureOptions options;
  options.resume = true;
  options.on_frame = [](const CaptureSummary& s) {
    if (s.frames == 17) core::SetInterruptCountForTest(1);
  };
  Devices devices = SimulatedLab(Bench().Config()).MakeDevices();
  EXPECT_THROW(RunSensorCapture(MakePlan(0.01, 1.5), devices, folder, options), Interrupted);
  core::SetInterruptCountForTest(0);
  EXPECT_EQ(MissingSensorFrames(session::SessionReader(folder)), 48 - 17);
  EXPECT_THAT(VerifySession(folder).problems, testing::Contains(HasSubstr("31 of the plan's")));
  options.on_frame = {};
  Devices again = SimulatedLab(Bench().Config()).MakeDevices();
  EXPECT_EQ(RunSensorCapture(MakePlan(0.01, 1.5), again, folder, options).frames, 48 - 17);
  EXPECT_EQ(session::SessionReader(folder).frames().size(), 48u);
  EXPECT_TRUE(VerifySession(folder).problems.empty());
}

TEST_F(CaptureSensor, NamesTheExposuresThatALadderShouldHave) {
  const auto refusal = [&](const SensorPlan& plan, const TestLab& lab) -> std::string {
    Devices devices = SimulatedLab(lab.Config()).MakeDevices();
    try {
      RunSensorCapture(plan, devices, NewFolder());
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal(MakePlan(0.001, 0.1), Bench()), HasSubstr("does not saturate"));
  EXPECT_THAT(refusal(MakePlan(0.5, 5), Bench()), HasSubstr("set exposure.min_s = 0.01"));
  EXPECT_THAT(refusal(MakePlan(2, 9), Bench()), HasSubstr("even at exposure.min_s"));
  TestLab dark = Bench();
  dark.lamp = "kind = \"square\"\nside_m = 2\nradiance = 1e-3";
  EXPECT_THAT(refusal(MakePlan(0.01, 1.5), dark), HasSubstr("shows no light"));
  EXPECT_THAT(refusal(MakePlan(0.01, 20), Bench()), HasSubstr("the camera ends at"));
}

TEST_F(CaptureSensor, OneFlatShowsAllColoursOfAMosaic) {
  TestLab bench = Bench();
  bench.lab += "\nchannels = 3";
  bench.camera += "\ncfa = \"RGGB\"";
  std::string lab = bench.Toml();
  lab.replace(lab.find("[1000]"), 6, "[500, 1000, 800]");
  const SimulatedLab mosaic(core::Config::FromString(lab, "lab.toml"));
  const auto plan = [](double max_s, int levels) {
    std::string text = PlanText(0.01, max_s, levels);
    text.insert(text.find("[exposure]"), "channels = 3\n");
    return ReadSensorPlan(core::Config::FromString(text, "plan.toml"));
  };
  const auto folder = NewFolder();
  Devices devices = mosaic.MakeDevices();
  EXPECT_EQ(RunSensorCapture(plan(1.5, 16), devices, folder).frames, 64);
  EXPECT_TRUE(VerifySession(folder).problems.empty());
  const session::SessionReader session(folder);
  for (const auto& frame : session.frames()) EXPECT_EQ(frame.channel, 0);
  // Red fills in twice the time: only levels up to green's saturation count.
  try {
    RunSensorCapture(plan(3, 10), devices, NewFolder());
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("channel 0 fills the sensor in 2"));
    EXPECT_THAT(error.what(), HasSubstr("that fill its brightest colour"));
  }
}

TEST_F(CaptureSensor, PlansSayWhatTheyAre) {
  const auto config = [](const std::string& text) {
    return core::Config::FromString(text, "plan.toml");
  };
  EXPECT_EQ(ReadPlanKind(config(PlanText(0.01, 1))), PlanKind::kSensor);
  EXPECT_EQ(ReadPlanKind(config("[plan]\n")), PlanKind::kLightField);
  EXPECT_THROW(ReadPlan(config(PlanText(0.01, 1))), InputError);
  EXPECT_THROW(ReadSensorPlan(config("[plan]\nname = \"x\"\n")), InputError);
  EXPECT_THROW(MakePlan(1, 1.1, 12), InputError);
  EXPECT_THROW(ReadSensorPlan(config(PlanText(0.01, 1) + "[grid]\nwidth = 3\n")), InputError);
}

}  // namespace
}  // namespace luxfield::capture
