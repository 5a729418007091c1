// A small capture on a simulated lab, for tests.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/capture/take/capture.h"
#include "luxfield/core/config.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/session/session_store.h"
#include "tests/hal/test_lab.h"

namespace luxfield::capture {

inline constexpr const char* kPlan =
    "[plan]\ndark_repeats = 1\n[rig]\nkind = \"lensless\"\ndelta_m = 0.25\n[filter]\nspacing_m = "
    "0.02\n[grid]\nwidth = 3\n"
    "height = 2\n[lattice]\nwidth = 8\nheight = 8\nds_m = 0.02\n[exposure]\nmin_s = 0.01\nmax_s = "
    "3\nratio = 4\n"
    "relevant_share = 0.01\n[reference]\nevery = 4\nmax_drift = 0.05\n[warm_up]\nwindow_s = "
    "10\ninterval_s = 1\n";

inline Plan TestPlan() { return ReadPlan(core::Config::FromString(kPlan, "plan.toml")); }

inline hal::sim::TestLab Noisy() {
  hal::sim::TestLab lab;
  lab.lab = "seed = 5";
  lab.errors = "[errors.photon_noise]\n[errors.read_noise]\nrms_dn = 2\n";
  return lab;
}

inline std::filesystem::path NewFolder(const std::string& name) {
  static int counter = 0;
  const auto path = std::filesystem::path(testing::TempDir()) /
                    fmt::format("capture_{}_{}_{}", name, ::getpid(), counter++);
  std::filesystem::remove_all(path);
  return path;
}

class Capture : public testing::Test {
 protected:
  void SetUp() override { core::SetInterruptCountForTest(0); }
  void TearDown() override { core::SetInterruptCountForTest(0); }
};

inline std::vector<core::Json> RecordsOf(const std::filesystem::path& folder,
                                         const std::string& type) {
  std::vector<core::Json> found;
  const session::SessionReader reader(folder);
  for (const auto& record : reader.journal())
    if (record["type"] == type) found.push_back(record);
  return found;
}

}  // namespace luxfield::capture
