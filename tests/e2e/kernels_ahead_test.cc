// Kernels that are compiled before the first picture whose estimator is chosen are those that it takes.
#include <algorithm>
#include <filesystem>
#include <set>
#include <string>

#include "luxfield/bench/all/car_field.h"
#include "luxfield/bench/all/process.h"
#include "luxfield/core/file.h"
#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

namespace fs = std::filesystem;

class KernelsAhead : public VerbTest {
 protected:
  // As on a machine that has compiled nothing yet.
  void Luxfield(std::vector<std::string> arguments) {
    const fs::path cache = folder_ / "cache";
    fs::create_directories(cache / "pocl");
    arguments.insert(arguments.begin(), bench::LuxfieldProgram());
    arguments.emplace_back("--quiet");
    bench::RunProcess(arguments, folder_,
                      {{"XDG_CACHE_HOME", cache}, {"POCL_CACHE_DIR", cache / "pocl"}});
  }

  // The compiled kernels, each with the work-groups that it is for: PoCL's files PROGRAM/KERNEL/GROUPS.
  std::set<std::string> Compiled() const {
    std::set<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / "cache/pocl"))
      if (entry.path().extension() == ".so")
        files.insert(fs::relative(entry.path(), folder_ / "cache/pocl").string());
    return files;
  }
};

bool HasKernel(const std::set<std::string>& files, const std::string& name) {
  return std::any_of(files.begin(), files.end(),
                     [&](const std::string& file) { return file.ends_with("/" + name + ".so"); });
}

TEST_F(KernelsAhead, AreThoseOfThePilots) {
  const fs::path scene = bench::WriteCarField(folder_, 3, 3, 64);
  std::string text = core::ReadFile(scene);
  for (const bool glossy : {false, true}) {
    fs::remove_all(folder_ / "cache");
    const auto at = text.find("albedo");
    ASSERT_NE(at, std::string::npos);
    if (glossy) text.insert(at, "kind = \"ggx\"\nroughness = 0.4\n");
    core::WriteFileAtomically(scene, text);
    Luxfield({"cache", "--compile", glossy ? "glossy" : "lambertian"});
    const std::set<std::string> ahead = Compiled();
    if (ahead.empty()) GTEST_SKIP() << "the device is not PoCL's";
    for (const char* kernel : {"Windowed", "Cells", "WindowMasses"})
      EXPECT_TRUE(HasKernel(ahead, kernel)) << kernel;
    EXPECT_EQ(HasKernel(ahead, "Gloss"), glossy);
    Luxfield({"render", scene.string(), "-o", "picture.exr", "--error", "20%", "--width", "256",
              "--height", "192"});
    for (const std::string& file : Compiled()) {
      if (ahead.contains(file)) continue;
      for (const char* kernel : {"Windowed", "Cells", "WindowMasses", "WindowSpans", "Gloss"})
        EXPECT_NE(fs::path(file).stem(), kernel) << file << ": compiled in vain, or once more";
    }
  }
}

// What is kept of the other process is all that is kept of programs where an estimator is chosen.
TEST_F(KernelsAhead, AreBegunByTheFirstPictureWhoseEstimatorIsChosen) {
  const fs::path scene = bench::WriteCarField(folder_, 2, 2, 32);
  const auto begun = [&](const std::vector<std::string>& more) {
    fs::remove_all(folder_ / "cache");
    std::vector<std::string> words{"render", scene.string(), "-o", "picture.exr", "--width",
                                   "32",     "--height",     "24", "--error",     "50%"};
    words.insert(words.end(), more.begin(), more.end());
    Luxfield(words);
    Luxfield({"cache", "--json", (folder_ / "cache.json").string()});
    return nlohmann::json::parse(core::ReadFile(folder_ / "cache.json"))["kinds"].contains(
        "programs");
  };
  EXPECT_FALSE(begun({"--estimator", "windowed"}));
  if (Compiled().empty()) GTEST_SKIP() << "the device is not PoCL's";
  EXPECT_TRUE(begun({}));
}

}  // namespace
}  // namespace luxfield::e2e
