// With which lab a session goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>

#include "luxfield/capture/take/session_description.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/session/plan_json.h"
#include "tests/capture/capture_fixture.h"
#include "tests/capture/faulty_camera.h"
#include "tests/said.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using testing::HasSubstr;

class Resume : public Capture {
 protected:
  using Change = std::function<void(Devices&)>;

  static Devices Lab(const Change& change) {
    Devices devices = hal::sim::SimulatedLab(Noisy().Config()).MakeDevices();
    change(devices);
    return devices;
  }
  // A session broken off after two positions.
  static std::filesystem::path Begun(const std::string& name, const Change& lab) {
    const auto folder = NewFolder(name);
    CaptureOptions options;
    options.on_frame = [](const CaptureSummary& s) {
      if (s.positions == 2) core::SetInterruptCountForTest(2);
    };
    Devices devices = Lab(lab);
    EXPECT_THROW(RunCapture(TestPlan(), devices, folder, options), Interrupted);
    core::SetInterruptCountForTest(0);
    return folder;
  }
  static void GoOn(const std::filesystem::path& folder, const Change& lab) {
    CaptureOptions options;
    options.resume = true;
    Devices devices = Lab(lab);
    RunCapture(TestPlan(), devices, folder, options);
    EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
  }
};

void Settings(Devices& devices, const std::string& gain_db) {
  devices.camera_settings = {{"driver", "aravis"}, {"gain_db", gain_db}};
}

TEST_F(Resume, IsRefusedWithAnotherCameraByField) {
  const auto as_it_was = [](Devices& d) { Settings(d, "0"); };
  const auto folder = Begun("another", as_it_was);
  const std::vector<std::pair<std::string, Change>> changes = {
      {"camera.settings.gain_db = \"0\", the lab given has \"6\"",
       [](Devices& d) { Settings(d, "6"); }},
      {"camera.settings.gain_db = \"0\", the lab given has nothing",
       [](Devices& d) {
         d.camera_settings = {{"driver", "aravis"}};
       }},
      {"camera.settings.region_px = nothing, the lab given has \"1\"",
       [](Devices& d) {
         Settings(d, "0");
         d.camera_settings["region_px"] = "1";
       }},
      {"camera.settings = ", [](Devices&) {}},
      {"camera.gain_dn_per_e = ",
       [](Devices& d) {
         Settings(d, "0");
         d.rig.camera.gain_dn_per_e *= 2;
       }},
      {"camera.defects = ",
       [](Devices& d) {
         Settings(d, "0");
         d.rig.camera.defects.emplace_back(1, 2);
       }},
      {"camera.cfa = nothing, the lab given has \"RGGB\"",
       [](Devices& d) {
         Settings(d, "0");
         d.rig.camera.cfa = "RGGB";
       }},
      {"calibration.image_from_sensor = ", [](Devices& d) {
         Settings(d, "0");
         d.rig.image_from_sensor =
             rig::Homography({1, 0, 1e-3, 0, 1, 0, 0, 0, 1}) * d.rig.image_from_sensor;
       }}};
  for (const auto& [problem, change] : changes) try {
      GoOn(folder, change);
      ADD_FAILURE() << "was resumed: " << problem;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("session.json"), HasSubstr(problem)));
    }
  GoOn(folder, as_it_was);
}

void Firmware(Devices& devices, const std::string& version) {
  auto camera = std::make_unique<FaultyCamera>(std::move(devices.camera),
                                               [](int, hal::Frame&, const hal::Frame&) {});
  camera->version = version;
  devices.camera = std::move(camera);
}

TEST_F(Resume, WithAnotherFirmwareGoesOnAndTheJournalTellsWhichEpochsHaveIt) {
  const auto folder = Begun("firmware", [](Devices& d) { Firmware(d, "1.2"); });
  GoOn(folder, [](Devices& d) { Firmware(d, "1.3"); });
  EXPECT_EQ(core::ReadJson(folder / "session.json").at("devices").at("camera_firmware"), "1.2");
  const auto epochs = RecordsOf(folder, "epoch_start");
  ASSERT_EQ(epochs.size(), 2u);
  EXPECT_EQ(epochs[0].at("devices").at("camera_firmware"), "1.2");
  EXPECT_EQ(epochs[1].at("devices").at("camera_firmware"), "1.3");
}

TEST_F(Resume, SaysOnceThatTheFirmwareIsAnother) {
  const auto said = [](const std::string& first, const std::string& then) {
    const auto folder = NewFolder("firmwares");
    Devices before = Lab([&](Devices& d) { Firmware(d, first); });
    Devices after = Lab([&](Devices& d) { Firmware(d, then); });
    const auto plan = ToJson(ToPlanFile(ExpandPlan(TestPlan(), before)));
    OpenSession(folder, plan, before, false);
    EXPECT_EQ(core::ReadJson(folder / "session.json").at("devices").contains("camera_firmware"),
              !first.empty());
    return Said([&] { OpenSession(folder, plan, after, true); });
  };
  const std::string other = said("1.2", "1.3");
  EXPECT_THAT(other, HasSubstr("firmware is \"1.3\", the session began with \"1.2\""));
  EXPECT_EQ(std::count(other.begin(), other.end(), '\n'), 1);
  EXPECT_EQ(said("1.2", "1.2"), "");
  EXPECT_EQ(said("", "1.3"), "");
  EXPECT_EQ(said("1.2", ""), "");
}

TEST_F(Resume, TakesAnySettingsWhereTheSessionStatesNone) {
  GoOn(Begun("older", [](Devices&) {}), [](Devices& d) { Settings(d, "6"); });
}

// What is killed leaves nothing there: nothing is written but in the session.
TEST_F(Resume, TheVignettingNeedsNoTemporaryFolder) {
  const auto folder = NewFolder("elsewhere");
  const char* before = std::getenv("TMPDIR");
  const std::string old = before ? before : "";
  ::setenv("TMPDIR", "/nonexistent", 1);
  Devices devices = Lab([](Devices& d) { d.rig.camera.vignetting.assign(32 * 24, 0.9f); });
  const auto plan = ToJson(ToPlanFile(ExpandPlan(TestPlan(), devices)));
  EXPECT_NO_THROW(OpenSession(folder, plan, devices, false));
  if (before)
    ::setenv("TMPDIR", old.c_str(), 1);
  else
    ::unsetenv("TMPDIR");
  EXPECT_EQ(core::ReadExrImage(folder / "vignetting.exr").data, devices.rig.camera.vignetting);
}

TEST_F(Resume, IsRefusedWhereTheVignettingIsAnother) {
  const auto with = [](float corner) {
    return [corner](Devices& d) {
      d.rig.camera.vignetting.assign(32 * 24, 1.0f);
      d.rig.camera.vignetting.back() = corner;
    };
  };
  const auto folder = Begun("vignetting", with(0.9f));
  try {
    GoOn(folder, with(0.91f));
    ADD_FAILURE() << "was resumed";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("vignetting.exr: is another vignetting"));
  }
  GoOn(folder, with(0.9f));
}

TEST_F(Resume, IsRefusedWhereAFileOfTheLabIsAnother) {
  const auto with = [](const std::map<std::string, std::string>& files) {
    return [files](Devices& d) { d.lab_files = files; };
  };
  const auto as_it_was = with({{"lamp.file", "aa"}});
  const auto folder = Begun("files", as_it_was);
  for (const auto& [files, found] :
       {std::pair{std::map<std::string, std::string>{{"lamp.file", "bb"}}, "\"bb\""},
        std::pair{std::map<std::string, std::string>{}, "nothing"}})
    try {
      GoOn(folder, with(files));
      ADD_FAILURE() << "was resumed";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("session.json: lab_files.lamp.file = \"aa\", the lab "
                                          "given has " +
                                          std::string(found)));
    }
  GoOn(folder, as_it_was);
  GoOn(Begun("states none", [](Devices&) {}), as_it_was);
}

}  // namespace
}  // namespace luxfield::capture
