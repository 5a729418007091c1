// device_bench as a GPU machine would run it, and its kernels under a simulator that checks every
// access.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "luxfield/render/accuracy/car2.h"
#include "luxfield/render/estimators/estimator.h"
#include "program.h"

namespace luxfield::e2e {
namespace {

// A preloaded simulator and a sanitizer's runtime exclude each other, and so do a list of libraries
// and a sanitizer's.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

// car2 with few texels, few pixels: windows off the image, horizons that cut, pixels without a hit.
const std::vector<std::string> kTiny{
    "--width", "16",      "--height", "12", "--grid-width", "3", "--grid-height",      "3",
    "--size",  "8",       "--spp",    "8",  "--repeats",    "1", "--reference-pixels", "0",
    "--json",  "out.json"};

std::vector<std::string> Command(std::vector<std::string> words,
                                 const std::vector<std::string>& more) {
  words.push_back(BuiltProgram("device_bench").string());
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(DeviceBench, LinksOnlyOpenClAndTheSystem) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer links its own runtime";
  const auto folder = FreshFolder("ldd");
  const Outcome outcome = RunProgram({"ldd", BuiltProgram("device_bench").string()}, folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  std::set<std::string> libraries;
  for (std::string line, name; std::getline(lines, line);) {
    std::istringstream(line) >> name;
    libraries.insert(name.substr(name.rfind('/') + 1));
  }
  EXPECT_TRUE(libraries.contains("libOpenCL.so.1"));
  for (const auto& library : libraries)
    EXPECT_THAT(library,
                testing::AnyOf(testing::StartsWith("linux-vdso"), testing::StartsWith("ld-linux"),
                               "libOpenCL.so.1", "libc.so.6", "libm.so.6"));
}

TEST(DeviceBench, ReportsDeviceTimesAndErrors) {
  const auto folder = FreshFolder("device_bench");
  const Outcome outcome = RunProgram(Command({}, kTiny), folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto report = nlohmann::json::parse(ReadText(folder / "out.json"));
  for (const char* key : {"device", "platform", "opencl", "driver", "version"})
    EXPECT_FALSE(report.at(key).get<std::string>().empty()) << key;
  std::set<std::string> estimators;
  for (const auto& row : report.at("rows")) {
    estimators.insert(row.at("estimator"));
    double device_s = 0;
    for (const auto& kernel : row.at("kernels")) {
      EXPECT_GE(kernel.at("launches").get<int>(), 1) << row;
      device_s += kernel.at("device_s").get<double>();
    }
    EXPECT_GT(device_s, 0) << row;
    EXPECT_EQ(row.at("samples_per_s").get<double>() > 0, row.at("spp").get<int>() > 0) << row;
    if (row.at("estimator") == "exact") {
      EXPECT_LT(row.at("rel_rmse").get<double>(), 1e-5);
    }
  }
  EXPECT_THAT(estimators, testing::IsSupersetOf({"exact", "windowed", "thesis"}));
  EXPECT_EQ(RunProgram(Command({}, {"--device", "no such device"}), folder).exit_code, 2);
  EXPECT_EQ(RunProgram(Command({}, {"--size", "0"}), folder).exit_code, 2);
}

// Oclgrind 21.10 watches every access for bounds and races. Its --uninitialized crashes on vector
// shuffles with undefined lanes (float3), so uninitialised reads are looked for by their effect:
// automatic variables and fresh buffers once hold zeros, once a pattern (NaN for floats), and
// nothing may come out differently.
class KernelCheck : public testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "oclgrind cannot be preloaded under a sanitizer";
    if (RunProgram({"oclgrind", "--version"}, folder_).exit_code != 0)
      GTEST_SKIP() << "NOT CHECKED: oclgrind is not installed (packages.txt); kernels were not "
                      "checked for races and bounds";
  }

  // `program` with a simulated device, every complaint in the file "log".
  Outcome RunChecked(const std::vector<std::string>& program, bool pattern,
                     const std::string& tuning = {}) const {
    // Inlining leaves annotations that Oclgrind 21.10 does not know.
    const std::string options =
        std::string(
            "-Dalways_inline=noinline -Dinline=__attribute__((noinline)) "
            "-ftrivial-auto-var-init=") +
        (pattern ? "pattern"
                 : "zero -enable-trivial-auto-var-init-zero-knowing-it-will-be-removed-from-clang");
    // A cache of its own: other build options, the same device.
    std::vector<std::string> words{"env",
                                   "XDG_CACHE_HOME=" + (folder_ / (pattern ? "p" : "z")).string(),
                                   pattern ? "MALLOC_PERTURB_=85" : "MALLOC_PERTURB_=0",
                                   "LUXFIELD_TUNING=" + tuning,
                                   "oclgrind",
                                   "--data-races",
                                   "--check-api",
                                   "--log",
                                   "log",
                                   "--build-options",
                                   options};
    words.insert(words.end(), program.begin(), program.end());
    return RunProgram(words, folder_);
  }

  const std::filesystem::path folder_ = FreshFolder("oclgrind");
};

TEST_F(KernelCheck, EstimatorsHaveNoRacesStayInBoundsAndReadWhatWasWritten) {
  // Kernels as cut for a GPU and for a CPU; NaN is refused by the bench's own comparison.
  for (const std::string tuning :
       {"group=8,pixels=1,shared=1,lanes=4", "group=8,pixels=8,shared=4"}) {
    nlohmann::json rows[2];
    for (const bool pattern : {false, true}) {
      const Outcome outcome = RunChecked(Command({}, kTiny), pattern, tuning);
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_EQ(ReadText(folder_ / "log"), "");
      const auto report = nlohmann::json::parse(ReadText(folder_ / "out.json"));
      EXPECT_THAT(report.at("device").get<std::string>(), testing::HasSubstr("Oclgrind"));
      for (const auto& row : report.at("rows"))
        rows[pattern].push_back({row.at("estimator"), row.at("rel_rmse"), row.at("bias")});
    }
    EXPECT_EQ(rows[0], rows[1]) << tuning;
  }
}

// The same for what the bench leaves out: primary visibility, shadows, materials.
TEST_F(KernelCheck, RenderingHasNoRacesStaysInBoundsAndReadsWhatWasWritten) {
  lightfield::WriteLightField(
      folder_ / "lamp.lf.exr",
      render::SyntheticCar2({.grid_width = 3, .grid_height = 2, .size = 8, .channels = 3}));
  WriteText(folder_ / "scene.toml", R"(
camera = {position = [0.4, -1.5, 1.2], look_at = [0, 1.5, 0.2], width = 12, height = 9}
material = [{name = "grey", albedo = [0.5, 0.6, 0.7]}]
quad = [{corner = [-2, -1, 0], edge_u = [4, 0, 0], edge_v = [0, 6, 0], material = "grey"}]
box = [{size = [0.4, 0.3, 0.5], position = [0, 1.5, 0.25], material = "grey"}]
[[luminaire]]
file = "lamp.lf.exr"
position = [0, 0, 0.5]
look_at = [0, 3, 0]
)");
  const auto check = [&](const std::vector<std::string>& options) {
    std::vector<std::string> command{
        BuiltProgram("luxfield").string(), "render", "scene.toml", "-o", "out.exr", "--spp", "4"};
    command.insert(command.end(), options.begin(), options.end());
    std::string pictures[2];
    for (const bool pattern : {false, true}) {
      const Outcome outcome = RunChecked(command, pattern, "group=4,pixels=1,shared=1,lanes=4");
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_EQ(ReadText(folder_ / "log"), "") << options.at(1);
      pictures[pattern] = ReadText(folder_ / "out.exr");
    }
    EXPECT_TRUE(pictures[0] == pictures[1]) << options.at(1) << " reads what was not written";
  };
  for (const auto& traits : render::EstimatorList()) check({"--estimator", traits.name});
  check({"--shadows", "soft-maps", "--estimator", "volume"});

  // Many lights, of which points draw some or leave some out.
  WriteText(folder_ / "scene.toml", ReadText(folder_ / "scene.toml") + R"(
[[light]]
kind = "rectangle"
radiance = [9, 8, 7]
position = [1, 1, 1]
look_at = [0, 2, 0]
size = [0.3, 0.2]
[[light]]
kind = "sphere"
radiance = [9, 8, 7]
position = [-1, 1, 1]
radius = 0.1
[[luminaire]]
file = "lamp.lf.exr"
position = [-1, 4, 0.7]
look_at = [0, 2, 0]
[[luminaire.array]]
count = 9
step = [0.3, 0, 0.1]
)");
  check({"--estimator", "cells"});
  check({"--estimator", "exact", "--shadows", "none"});
}

// The checks can fail: a kernel with each of the faults.
TEST_F(KernelCheck, NoticesARaceAStrayWriteAndAnUnsetVariable) {
  WriteText(folder_ / "bad.cl", R"(
__kernel void Race(__global float* out) { out[0] = (float)get_global_id(0); }
__kernel void Stray(__global float* out) { out[get_global_id(0) + 1] = 1.0f; }
__kernel void Unset(__global float* out) {
  float x[4];
  x[0] = 1.0f;
  out[get_global_id(0)] = x[get_global_id(0)];
})");
  const auto run = [&](const std::string& kernel, bool pattern) {
    WriteText(folder_ / "bad.sim",
              "bad.cl\n" + kernel + "\n4 1 1\n4 1 1\n<size=16 float fill=0 dump>\n");
    const Outcome outcome = RunChecked({"oclgrind-kernel", "bad.sim"}, pattern);
    return outcome.out;
  };
  run("Race", false);
  EXPECT_THAT(ReadText(folder_ / "log"), testing::HasSubstr("race"));
  run("Stray", false);
  EXPECT_THAT(ReadText(folder_ / "log"), testing::HasSubstr("Invalid write"));
  EXPECT_NE(run("Unset", false), run("Unset", true));
}

}  // namespace
}  // namespace luxfield::e2e
