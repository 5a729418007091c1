#include "luxfield/capture/plan/glare_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  core::Progress::SetQuiet(true);
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
  for (const session::FrameRecord& record : session.frames()) {
    traps += record.kind == session::FrameKind::kTarget;
    darks += record.kind == session::FrameKind::kDark;
  }
  EXPECT_EQ(traps, 6);
  EXPECT_EQ(darks, 3);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::capture
