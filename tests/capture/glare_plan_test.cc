#include "luxfield/capture/plan/glare_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "luxfield/capture/take/capture_glare.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/hal/test_lab.h"

namespace luxfield::capture {
namespace {

namespace fs = std::filesystem;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using testing::HasSubstr;

GlarePlan MakePlan(int places = 2) {
  return ReadGlarePlan(core::Config::FromString(
      fmt::format("[plan]\nkind = \"glare\"\nplaces = {}\n[exposure]\nmin_s = 0.001\nmax_s = 1\n"
                  "repeats = 3\n",
                  places),
      "plan.toml"));
}

TestLab Bench() {
  TestLab lab;
  lab.lab = "seed = 3";
  lab.rig = "kind = \"reflector\"\nalbedo = 0.9";
  lab.camera = "width = 80\nheight = 60";
  lab.errors =
      "[camera.lens]\nfocal_px = [95, 95]\nposition_m = [0.2, 0.1, -0.75]\n"
      "[targets]\nspacer_m = 0.05\nsource_m = [0, 0, -0.3]\nsource_intensity = 20\n"
      "room_irradiance = 20\n"
      "[targets.mask]\ncolumns = 4\nrows = 3\npitch_m = 0.01\n"
      "[targets.board]\ncolumns = 4\nrows = 3\npitch_m = 0.01\n"
      "[targets.trap]\nradius_m = 0.04\nplaces = 2\n"
      "[errors.read_noise]\nrms_dn = 2\n[errors.photon_noise]\n";
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

TEST(GlarePlan, WhatItStatesIsReadAndKept) {
  const auto read = [](const std::string& share) {
    return ReadGlarePlan(core::Config::FromString(
        "[plan]\nkind = \"glare\"\nname = \"black velvet\"\n[exposure]\nmin_s = 0.001\nmax_s = 1\n"
        "max_attempts = 7\nsaturation_share = " +
            share + "\n",
        "plan.toml"));
  };
  const GlarePlan plan = read("0.1");
  EXPECT_EQ(plan.name, "black velvet");
  EXPECT_EQ(plan.saturation_share, 0.1);
  EXPECT_THAT(Refusal([&] { read("0.099"); }), HasSubstr("saturation_share"));
  EXPECT_THAT(Refusal([&] { read("0.951"); }), HasSubstr("saturation_share"));
  const session::PlanFile file = TargetPlanFile(PlanKind::kGlare, plan, {0.5, 1});
  EXPECT_EQ(file.name, "black velvet");
  ASSERT_TRUE(file.exposure);
  EXPECT_EQ(file.exposure->ladder_s, std::vector({0.5, 1.0}));
  EXPECT_EQ(file.exposure->saturation_share, 0.1);
  EXPECT_EQ(file.exposure->max_attempts, 7);
}

TEST(GlarePlan, RefusesWhatTheLabCannotDo) {
  TestLab bare = Bench();
  bare.errors.resize(bare.errors.find("[targets]"));
  EXPECT_THAT(Refusal([&] { ExpandPlan(MakePlan(), SimulatedLab(bare.Config()).MakeDevices()); }),
              HasSubstr("puts a light trap in 2 places, the lab has 0"));
  EXPECT_THAT(
      Refusal([&] { ExpandPlan(MakePlan(3), SimulatedLab(Bench().Config()).MakeDevices()); }),
      HasSubstr("the lab has 2"));
}

TEST(GlarePlan, CapturesEveryPlaceAndItsDarks) {
  core::SetInterruptCountForTest(0);
  const fs::path folder = fs::path(testing::TempDir()) / "luxfield_glare_plan";
  fs::remove_all(folder);
  hal::Devices devices = SimulatedLab(Bench().Config()).MakeDevices();
  // Paused within the first place: it is taken as a whole, the rest on resume.
  CaptureOptions interrupted;
  interrupted.on_frame = [](const CaptureSummary&) { core::SetInterruptCountForTest(1); };
  EXPECT_THROW(RunGlareCapture(MakePlan(), devices, folder, interrupted), Interrupted);
  EXPECT_EQ(MissingGlareFrames(session::SessionReader(folder)), 3 + 3);
  core::SetInterruptCountForTest(0);
  CaptureOptions resumed;
  resumed.resume = true;
  EXPECT_EQ(RunGlareCapture(MakePlan(), devices, folder, resumed).frames, 6);
  const session::SessionReader session(folder);
  EXPECT_TRUE(session.sealed());
  EXPECT_EQ(MissingGlareFrames(session), 0);
  EXPECT_TRUE(VerifySession(folder).problems.empty());
  int traps = 0, darks = 0;
  std::set<std::string> different;
  for (const session::FrameRecord& record : session.frames()) {
    different.insert(record.sha256);  // every repeat is a frame of its own
    traps += record.kind == session::FrameKind::kTarget;
    darks += record.kind == session::FrameKind::kDark;
  }
  EXPECT_EQ(traps, 6);
  EXPECT_EQ(darks, 3);
  EXPECT_EQ(different.size(), 9u);
  fs::remove_all(folder);
}

// The longest exposure whose brightest pixel keeps to its share of the range between black level and
// saturation, here over a black level that is a quarter of it.
TEST(GlarePlan, ExposuresFillTheRangeAboveTheBlackLevel) {
  const fs::path folder = fs::path(testing::TempDir()) / "luxfield_glare_range";
  fs::remove_all(folder);
  std::string toml = Bench().Toml();
  const std::string black = "black_dn = 100\n";
  toml.replace(toml.find(black), black.size(), "black_dn = 1000\n");
  hal::Devices devices = SimulatedLab(core::Config::FromString(toml, "lab.toml")).MakeDevices();
  GlarePlan plan = MakePlan();
  plan.repeats = 1;
  // Which of the doubled exposures is taken depends on where the share lies between two of them.
  for (const double share : {0.3, 0.35, 0.4, 0.45, 0.5, 0.55}) {
    plan.saturation_share = share;
    fs::remove_all(folder);
    RunGlareCapture(plan, devices, folder, {});
    const session::SessionReader session(folder);
    for (const session::FrameRecord& record : session.frames()) {
      if (record.kind != session::FrameKind::kTarget) continue;
      const session::RawFrame frame = session.ReadFrame(record);
      const double filled =
          (*std::max_element(frame.dn.begin(), frame.dn.end()) - 1000) / (4000.0 - 1000);
      EXPECT_LE(filled, share);
      EXPECT_GT(filled, 0.5 * share * 0.97) << "the next longer one fits too";
    }
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::capture
