#include "luxfield/capture/take/capture.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/session/session_writer.h"
#include "tests/capture/capture_fixture.h"
#include "tests/capture/faulty_camera.h"

namespace luxfield::capture {
namespace {

namespace fs = std::filesystem;
using hal::Devices;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using testing::HasSubstr;

TEST_F(Capture, MakesAWholeSession) {
  const auto folder = NewFolder("whole");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  const CaptureSummary summary = RunCapture(TestPlan(), devices, folder);
  EXPECT_EQ(summary.positions, 6);
  EXPECT_EQ(summary.rejected, 0);
  EXPECT_EQ(summary.flagged, 0);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
  const session::SessionReader reader(folder);
  EXPECT_TRUE(reader.sealed());
  std::map<std::pair<int, int>, std::vector<double>> brackets;
  int references = 0;
  std::map<int, int> darks;
  for (const auto& record : reader.frames()) {
    const session::RawFrame frame = reader.ReadFrame(record);
    if (record.kind == session::FrameKind::kReference) ++references;
    if (record.kind == session::FrameKind::kDark) ++darks[record.exposure_index];
    if (record.kind != session::FrameKind::kPosition) continue;
    brackets[{record.i, record.j}].push_back(record.exposure_s);
    const auto centre = TestPlan().geometry.grid.centre(record.i, record.j);
    EXPECT_DOUBLE_EQ(record.stage_u_m, centre.x);
    EXPECT_DOUBLE_EQ(record.stage_v_m, centre.y);
    EXPECT_GT(record.meter, 0.9);
  }
  EXPECT_EQ(brackets.size(), 6u);
  EXPECT_EQ(references, 3);  // before positions 0 and 4, and at the end
  EXPECT_EQ(darks.size(), 5u);
  for (const auto& [rung, count] : darks) EXPECT_EQ(count, 2) << "at the start and at the end";
  // What the exposures are for: nothing saturated in the shortest, and every pixel above a
  // hundredth of the brightest well above noise in the longest.
  for (const auto& [place, exposures] : brackets) {
    const auto first =
        std::find_if(reader.frames().begin(), reader.frames().end(), [&](const auto& r) {
          return r.kind == session::FrameKind::kPosition && std::pair(r.i, r.j) == place;
        });
    for (const auto dn : reader.ReadFrame(*first).dn) EXPECT_LT(dn, 4000);
    for (std::size_t k = 1; k < exposures.size(); ++k)
      EXPECT_LE(exposures[k] / exposures[k - 1], 8);
  }
}

// Light data by plan key.
std::map<std::tuple<int, int, int, int>, std::vector<float>> LightOf(const fs::path& folder) {
  std::map<std::tuple<int, int, int, int>, std::vector<float>> light;
  const session::SessionReader reader(folder);
  for (const auto& record : reader.frames())
    if (record.kind == session::FrameKind::kPosition)
      light[{record.i, record.j, record.exposure_index, record.repeat}] =
          reader.ReadFrame(record).value;
  return light;
}

TEST_F(Capture, PausedAndResumedGivesTheLightOfAnUninterruptedRun) {
  const auto straight = NewFolder("straight"), paused = NewFolder("paused");
  Plan plan = TestPlan();
  plan.exposure.repeats = 2;  // so that the second interrupt falls into a bracket
  Devices devices = SimulatedLab(TestLab{}.Config()).MakeDevices();
  RunCapture(plan, devices, straight);
  for (const int interrupts : {1, 2}) {  // finish the bracket; stop at once
    fs::remove_all(paused);
    CaptureOptions options;
    options.on_frame = [&](const CaptureSummary& s) {
      if (s.positions == 2) core::SetInterruptCountForTest(interrupts);
    };
    Devices first = SimulatedLab(TestLab{}.Config()).MakeDevices();
    EXPECT_THROW(RunCapture(plan, first, paused, options), Interrupted);
    EXPECT_EQ(RecordsOf(paused, "paused").size(), 1u);
    core::SetInterruptCountForTest(0);
    options = {};
    options.resume = true;
    Devices second = SimulatedLab(TestLab{}.Config()).MakeDevices();
    const CaptureSummary rest = RunCapture(plan, second, paused, options);
    EXPECT_EQ(rest.positions, interrupts == 1 ? 3 : 4);
    EXPECT_THAT(VerifySession(paused).problems, testing::IsEmpty());
    const auto a = LightOf(straight), b = LightOf(paused);
    ASSERT_EQ(a.size(), b.size());
    for (const auto& [key, pixels] : a) {
      const auto& other = b.at(key);
      // The lab's sampling lattice starts elsewhere: equal but for rounding to float32.
      for (std::size_t k = 0; k < pixels.size(); ++k)
        ASSERT_NEAR(pixels[k], other[k], 2e-6 * pixels[k]);
    }
  }
}

TEST_F(Capture, ResumeTakesABrokenBracketWholeInANewEpoch) {
  const auto folder = NewFolder("broken");
  CaptureOptions options;
  options.on_frame = [&](const CaptureSummary& s) {
    if (s.positions == 1) core::SetInterruptCountForTest(2);
  };
  Plan plan = TestPlan();
  plan.exposure.repeats = 3;  // so that the stop falls into a bracket
  Devices first = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_THROW(RunCapture(plan, first, folder, options), Interrupted);
  core::SetInterruptCountForTest(0);
  options = {};
  options.resume = true;
  Devices second = SimulatedLab(Noisy().Config()).MakeDevices();
  RunCapture(plan, second, folder, options);
  const session::SessionReader reader(folder);
  std::map<std::pair<int, int>, std::set<int>> epochs;
  std::map<std::pair<int, int>, int> frames;
  for (const auto& record : reader.frames())
    if (record.kind == session::FrameKind::kPosition) {
      epochs[{record.i, record.j}].insert(record.epoch);
      ++frames[{record.i, record.j}];
    }
  EXPECT_EQ(epochs.size(), 6u);
  for (const auto& [place, set] : epochs) EXPECT_EQ(set.size(), 1u) << "brackets never mix epochs";
  for (const auto& [place, count] : frames) EXPECT_EQ(count % 3, 0);
  EXPECT_EQ(RecordsOf(folder, "epoch_start").size(), 2u);
}

TEST_F(Capture, ResumeNeedsTheSamePlan) {
  const auto folder = NewFolder("otherplan");
  CaptureOptions options;
  options.on_frame = [](const CaptureSummary&) { core::SetInterruptCountForTest(2); };
  Devices first = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_THROW(RunCapture(TestPlan(), first, folder, options), Interrupted);
  core::SetInterruptCountForTest(0);
  Plan other = TestPlan();
  other.exposure.repeats = 2;
  options = {};
  options.resume = true;
  Devices second = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_THROW(RunCapture(other, second, folder, options), InputError);
}

Devices WithMischief(FaultyCamera::Mischief mischief, double refuse = 0) {
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  auto camera = std::make_unique<FaultyCamera>(std::move(devices.camera), std::move(mischief));
  camera->refuse = refuse;
  devices.camera = std::move(camera);
  return devices;
}

TEST_F(Capture, StaleAndWrongFramesAreTakenAgain) {
  struct Case {
    const char* reason;
    FaultyCamera::Mischief mischief;
  };
  const std::vector<Case> cases = {
      {"frame id",
       [](int n, hal::Frame& f, const hal::Frame& old) {
         if (n % 10 == 9) f = old;
       }},
      {"packets lost",
       [](int n, hal::Frame&, const hal::Frame&) {
         if (n % 10 == 9)
           throw hal::HardwareError(hal::Fault::kIncomplete, "camera", "expose", "packets lost",
                                    "check the network");
       }},
      {"equal to the frame before",
       [](int n, hal::Frame& f, const hal::Frame& old) {
         if (n % 10 == 9) f.image = old.image;
       }},
      {"before it was asked for",
       [](int n, hal::Frame& f, const hal::Frame&) {
         if (n % 10 == 9) f.t_start_s -= 60;
       }},
      {"not at",
       [](int n, hal::Frame& f, const hal::Frame&) {
         if (n % 10 == 9) f.settings.exposure_s *= 2;
       }},
  };
  for (const Case& c : cases) {
    const auto folder = NewFolder("stale");
    Devices devices = WithMischief(c.mischief);
    const CaptureSummary summary = RunCapture(TestPlan(), devices, folder);
    EXPECT_GE(summary.rejected, 2) << c.reason;
    EXPECT_EQ(summary.flagged, 0) << c.reason;
    for (const auto& record : RecordsOf(folder, "frame_rejected"))
      EXPECT_THAT(record["reason"].get<std::string>(), HasSubstr(c.reason));
    EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
  }
}

TEST_F(Capture, ACameraThatNeverDeliversIsAnError) {
  Devices devices = WithMischief([](int n, hal::Frame& f, const hal::Frame&) {
    if (n > 8) f.frame_id = 1;
  });
  try {
    RunCapture(TestPlan(), devices, NewFolder("dead"));
    FAIL();
  } catch (const hal::HardwareError& error) {
    EXPECT_EQ(error.exit_code(), 3);
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("faulty camera"), HasSubstr("3 attempts")));
  }
  Devices refusing = WithMischief([](int, hal::Frame&, const hal::Frame&) {}, 0.5);
  EXPECT_THROW(RunCapture(TestPlan(), refusing, NewFolder("refuse")), hal::HardwareError);
}

TEST_F(Capture, AFrameThatStaysWrongIsKeptAndFlagged) {
  const auto folder = NewFolder("flagged");
  // From some moment on every bracket's longer exposures come out too dark, as if the shutter
  // stuck.
  Devices devices = WithMischief([](int n, hal::Frame& f, const hal::Frame&) {
    if (n > 6 && f.settings.exposure_s > 1)
      for (auto& dn : f.image.dn) dn = static_cast<std::uint16_t>(100 + (dn - 100) * 0.8);
  });
  Plan plan = TestPlan();
  plan.exposure.relevant_share = 1e-3;
  const CaptureSummary summary = RunCapture(plan, devices, folder);
  EXPECT_GT(summary.flagged, 0);
  EXPECT_EQ(summary.rejected, 2 * summary.flagged) << "three attempts each";
  int flagged = 0;
  const session::SessionReader reader(folder);
  for (const auto& record : reader.frames()) flagged += record.flagged;
  EXPECT_EQ(flagged, summary.flagged);
}

TEST_F(Capture, TheJournalHoldsTemperatureVoltageAndCurrent) {
  const auto folder = NewFolder("temperature");
  Devices devices = WithMischief([](int n, hal::Frame& f, const hal::Frame&) {
    f.temperature_c = n % 2 == 0 ? 20 + n : std::nan("");
  });
  RunCapture(TestPlan(), devices, folder);
  int told = 0, untold = 0;
  for (const auto& record : RecordsOf(folder, "frame")) {
    const auto& checks = record.at("checks");
    ++(checks.contains("temperature_c") ? told : untold);
    EXPECT_GE(checks.value("temperature_c", 20.0), 20);
  }
  EXPECT_GT(told, 5);
  EXPECT_GT(untold, 5);
  const auto supply = RecordsOf(folder, "supply");
  EXPECT_EQ(supply.size(), 1 + RecordsOf(folder, "reference").size());
  for (const auto& record : supply) {
    EXPECT_EQ(record.at("voltage_v"), 12);
    EXPECT_EQ(record.at("current_a"), 2);
  }
}

TEST_F(Capture, WaitsUntilTheLampIsWarm) {
  const auto folder = NewFolder("warm");
  TestLab lab = Noisy();
  lab.errors += "[errors.warm_up]\nexcess = 0.5\ntau_s = 200\n";
  Plan plan = TestPlan();
  plan.warm_up.window_s = 30;
  plan.warm_up.variation = 0.001;
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  RunCapture(plan, devices, folder);
  // 0.5 exp(-t/200) (exp(30/200) - 1) <= 0.001 from t = 200 ln(81) on, measured within an interval
  // of about a second.
  const auto warm_up = RecordsOf(folder, "warm_up").at(0);
  const double waited = warm_up["waited_s"].get<double>();
  EXPECT_NEAR(waited, 200 * std::log(0.5 * std::expm1(0.15) / 0.001), 5);
  EXPECT_NEAR(warm_up["meter"].get<double>(), 1 + 0.5 * std::exp(-waited / 200), 0.01);
  plan.warm_up.max_wait_s = 100;
  Devices cold = SimulatedLab(lab.Config()).MakeDevices();
  EXPECT_THROW(RunCapture(plan, cold, NewFolder("cold")), DeviceError);
}

TEST_F(Capture, DualPrintsAndColoursAreAllTaken) {
  TestLab lab;
  lab.lab = "ideal = true\nchannels = 3";
  lab.filter = "kind = \"dual\"\nbasis = \"quadratic\"\nspacing_m = 0.02";
  std::string toml = lab.Toml();
  const std::string one = "responsivity_e_per_s_per_w_m2 = [1000]";
  toml.replace(toml.find(one), one.size(), "responsivity_e_per_s_per_w_m2 = [1000, 900, 800]");
  std::string plan = kPlan;
  plan.replace(plan.find("dark_repeats"), 0, "channels = 3\n");
  plan.replace(plan.find("spacing_m"), 0, "kind = \"dual\"\nbasis = \"quadratic\"\n");
  const auto folder = NewFolder("dual");
  Devices devices = SimulatedLab(core::Config::FromString(toml, "lab.toml")).MakeDevices();
  RunCapture(ReadPlan(core::Config::FromString(plan, "plan.toml")), devices, folder);
  std::set<std::tuple<int, int, int, int>> taken;
  const session::SessionReader reader(folder);
  for (const auto& r : reader.frames())
    if (r.kind == session::FrameKind::kPosition) taken.insert({r.i, r.j, r.print, r.channel});
  EXPECT_EQ(taken.size(), 6u * 2 * 3);
}

// A stage one of whose answers is not what it said.
class MisheardStage : public hal::Stage {
 public:
  using Mishear = std::function<hal::Vec2(int answer, hal::Vec2 place)>;
  MisheardStage(std::unique_ptr<hal::Stage> stage, Mishear mishear)
      : stage_(std::move(stage)), mishear_(std::move(mishear)) {}
  std::string identity() const override { return stage_->identity(); }
  hal::StageLimits limits() const override { return stage_->limits(); }
  void Home(double deadline_s) override { stage_->Home(deadline_s); }
  void MoveTo(hal::Vec2 centre, double deadline_s) override { stage_->MoveTo(centre, deadline_s); }
  hal::StagePosition Where() override {
    hal::StagePosition where = stage_->Where();
    where.readback = mishear_(++answers_, where.readback);
    return where;
  }
  void Stop() override { stage_->Stop(); }

 private:
  std::unique_ptr<hal::Stage> stage_;
  Mishear mishear_;
  int answers_ = 0;
};

TEST_F(Capture, AGarbledReadBackIsAskedForAgain) {
  const auto folder = NewFolder("garbled");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  devices.stage =
      std::make_unique<MisheardStage>(std::move(devices.stage), [](int answer, hal::Vec2 place) {
        return answer % 7 == 3 ? place + hal::Vec2{0, -0.2} : place;
      });
  RunCapture(TestPlan(), devices, folder);
  const Plan plan = TestPlan();
  const session::SessionReader reader(folder);
  for (const auto& r : reader.frames()) {
    if (r.kind != session::FrameKind::kPosition) continue;
    const hal::Vec2 planned = plan.geometry.grid.centre(r.i, r.j);
    EXPECT_NEAR(r.stage_u_m, planned.x, 1e-12);
    EXPECT_NEAR(r.stage_v_m, planned.y, 1e-12);
  }
}

// The stage really is somewhere else: two answers agree.
TEST_F(Capture, AReadBackBesideTheTargetIsBelievedWhenItIsRepeated) {
  const auto folder = NewFolder("beside");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  devices.stage =
      std::make_unique<MisheardStage>(std::move(devices.stage), [](int, hal::Vec2 place) {
        return place + hal::Vec2{1e-4, 0};
      });
  RunCapture(TestPlan(), devices, folder);
  const Plan plan = TestPlan();
  const session::SessionReader reader(folder);
  for (const auto& r : reader.frames())
    if (r.kind == session::FrameKind::kPosition) {
      EXPECT_NEAR(r.stage_u_m, plan.geometry.grid.centre(r.i, r.j).x + 1e-4, 1e-12);
    }
}

TEST_F(Capture, AReadBackThatNeverAgreesEndsTheCapture) {
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  devices.stage =
      std::make_unique<MisheardStage>(std::move(devices.stage), [](int answer, hal::Vec2 place) {
        return place + hal::Vec2{1e-3 * answer, 0};
      });
  try {
    RunCapture(TestPlan(), devices, NewFolder("never"));
    FAIL();
  } catch (const hal::HardwareError& error) {
    EXPECT_EQ(error.fault, hal::Fault::kProtocol);
    EXPECT_THAT(error.what(), HasSubstr("5 answers in a row do not name one place"));
  }
}

}  // namespace
}  // namespace luxfield::capture
