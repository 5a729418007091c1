// Kernels that PoCL compiles for a picture: without a word, and into a folder of the user's own.
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/bench/all/car_field.h"
#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

namespace fs = std::filesystem;

class PoclsKernels : public VerbTest {
 protected:
  void SetUp() override {
    VerbTest::SetUp();
    scene_ = bench::WriteCarField(folder_, 2, 2, 32).string();
  }

  // A picture whose kernels PoCL finds in no cache but those under `home`.
  Outcome Render(const fs::path& home, const std::vector<std::string>& more) {
    std::vector<std::string> words{"env",
                                   "-u",
                                   "POCL_CACHE_DIR",
                                   "XDG_CACHE_HOME=" + home.string(),
                                   BuiltProgram("luxfield").string(),
                                   "render",
                                   scene_,
                                   "-o",
                                   "picture.exr",
                                   "--width",
                                   "32",
                                   "--height",
                                   "24",
                                   "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return RunProgram(words, folder_);
  }

  std::string scene_;
};

int CompiledKernels(const fs::path& folder) {
  if (!fs::exists(folder)) return 0;
  const fs::recursive_directory_iterator files(folder);
  return static_cast<int>(std::count_if(begin(files), end(files), [](const auto& entry) {
    return entry.path().extension() == ".so";
  }));
}

TEST_F(PoclsKernels, AreCompiledWithoutAWord) {
  const std::vector<std::vector<std::string>> pictures = {
      {"--estimator", "volume"},
      {"--estimator", "cells", "--knob", "strategies=newton", "--knob", "strategies-for=all"},
      {"--estimator", "uniform"}};
  for (const auto& picture : pictures) {
    fs::remove_all(folder_ / "home");
    const Outcome outcome = Render(folder_ / "home", picture);
    EXPECT_EQ(outcome.exit_code, 0) << picture[1];
    EXPECT_EQ(outcome.err, "") << picture[1];
  }
}

TEST_F(PoclsKernels, AreNotKeptInTheFolderOfAnotherUser) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives files away";
  const fs::path home = folder_ / "home", pocl = home / "pocl";
  fs::create_directories(pocl);
  ASSERT_EQ(::chown(pocl.c_str(), 65534, 65534), 0);
  fs::permissions(pocl, fs::perms::all);
  const Outcome outcome = Render(home, {"--estimator", "exact"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(fs::is_empty(pocl));
  if (const std::string device = RunLuxfield({"devices"}, folder_).out;
      device.find("PoCL") == std::string::npos)
    GTEST_SKIP() << "the device is not PoCL's";
  EXPECT_GT(CompiledKernels(home / "luxfield/pocl"), 0);
}

}  // namespace
}  // namespace luxfield::e2e
