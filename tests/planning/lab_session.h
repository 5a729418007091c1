// Sessions of small simulated labs that a test writes down as text.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "luxfield/capture/take/capture.h"
#include "luxfield/core/config.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/session/session_store.h"
#include "tests/core/memory_folder.h"

namespace luxfield::planning {

// A folder of this test alone, gone with it.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& name)
      : path_(MemoryFolder() / fmt::format("luxfield_{}_{}", name, ::getpid())) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Parts of a lab.toml that these tests have in common: of [camera], and whole tables.
inline constexpr const char* kCameraCodes =
    "bits = 14\nblack_dn = 400\nsaturation_dn = 16000\ngain_dn_per_e = 0.16\n"
    "min_exposure_s = 1e-4\nmax_exposure_s = 100\n";
inline constexpr const char* kStage =
    "[stage]\nmin_m = [-0.1, -0.1]\nmax_m = [0.1, 0.1]\nspeed_m_per_s = 0.05\nsettle_s = 0.5\n";
inline constexpr const char* kCameraNoise =
    "[errors.photon_noise]\n[errors.read_noise]\nrms_dn = 1.6\n";

inline hal::Devices DevicesOf(const std::string& lab) {
  core::SetInterruptCountForTest(0);
  return hal::sim::SimulatedLab(core::Config::FromString(lab, "lab.toml")).MakeDevices();
}

// The session that capturing a plan.toml in a lab.toml gives.
class LabSession {
 public:
  LabSession(const std::string& name, const std::string& lab, const std::string& plan)
      : folder_(name) {
    hal::Devices devices = DevicesOf(lab);
    capture::RunCapture(capture::ReadPlan(core::Config::FromString(plan, "plan.toml")), devices,
                        folder_.path());
    EXPECT_TRUE(capture::VerifySession(folder_.path()).problems.empty());
  }

  session::SessionReader Read() const { return session::SessionReader(folder_.path()); }

 private:
  ScratchFolder folder_;
};

}  // namespace luxfield::planning
