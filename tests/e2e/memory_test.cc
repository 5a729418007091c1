// Verbs take no more than --memory, however many positions there are, and say what they need where
// that is too little. The program is a fresh process: what a test has allocated is not in its peak.
#include <fmt/format.h>

#include <regex>

#include "luxfield/bench/all/bench_memory.h"
#include "luxfield/bench/all/car_field.h"
#include "luxfield/bench/all/process.h"
#include "luxfield/bench/bench_merge.h"
#include "luxfield/core/stopwatch.h"
#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

class Memory : public VerbTest {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer's own memory is several times the program's";
#endif
    VerbTest::SetUp();
  }

  // Largest resident set of the program with these arguments, MiB.
  double PeakMib(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), bench::LuxfieldProgram());
    arguments.emplace_back("--quiet");
    core::TakePeakMib();  // the process begins with this one's peak
    return bench::RunProcess(arguments, folder_).peak_mib;
  }

  // MiB that a verb asks for beyond the `given` ones; 0 where these are and may be enough.
  int MissingMib(std::vector<std::string> arguments, int given, bool may_be_enough = false) {
    arguments.insert(arguments.end(), {"--memory", fmt::format("{}M", given), "--quiet"});
    const Outcome outcome = RunLuxfield(arguments, folder_);
    if (may_be_enough && outcome.exit_code == 0) return 0;
    EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
    std::smatch found;
    if (std::regex_search(outcome.err, found, std::regex("([0-9]+) MiB more")))
      return std::stoi(found[1]);
    ADD_FAILURE() << outcome.err;
    return 0;
  }
};

// 144 positions are 264 MiB while they are solved at once, their tables 226 MiB while they are
// written at once, both beside the program.
TEST_F(Memory, DoesNotGrowWithTheNumberOfPositions) {
  constexpr int kMib = 208;
  bench::BenchMemoryOptions how;
  how.folder = folder_;
  how.works = {"reconstruct", "preprocess"};
  how.texels = 256;
  how.memory = fmt::format("{}M", kMib);
  how.grids = {4, 12};
  const nlohmann::json rows = bench::BenchMemory(how);
  ASSERT_EQ(rows.size(), 6u);
  for (const auto& row : rows) {
    std::printf("%s, %d positions: %.0f MiB\n", row.at("work").get<std::string>().c_str(),
                row.at("positions").get<int>(), row.at("peak_mib").get<double>());
    EXPECT_LT(row.at("peak_mib"), kMib) << row;
    EXPECT_GT(row.at("peak_mib"), 20) << row;  // it was measured
  }
}

// 64 images are 64 MiB and 225 are 225 MiB, of which the limit leaves room for some columns; the
// program takes some 200 MiB of it, most of them the OpenCL driver's.
TEST_F(Memory, OfAPictureDoesNotGrowWithTheLightField) {
  constexpr int kMib = 384;
  bench::BenchMemoryOptions how;
  how.folder = folder_;
  how.works = {"render"};
  how.memory = fmt::format("{}M", kMib);
  how.grids = {8, 15};
  const nlohmann::json rows = bench::BenchMemory(how);
  ASSERT_EQ(rows.size(), 4u);
  for (const auto& row : rows) {
    std::printf("%s, %d images: %.0f MiB\n", row.at("work").get<std::string>().c_str(),
                row.at("positions").get<int>(), row.at("peak_mib").get<double>());
    EXPECT_LT(row.at("peak_mib"), kMib) << row;
  }
}

// By the closed form, which every light field of this size fits into memory for: the same picture.
TEST_F(Memory, APictureIsTheSameWithinALimit) {
  const auto scene = bench::WriteCarField(folder_, 6, 4, 256);
  for (const char* estimator : {"exact", "volume"}) {
    std::vector<std::string> render{"render",      scene,     "-o",        "whole.exr",
                                    "--estimator", estimator, "--shadows", "none",
                                    "--width",     "96",      "--height",  "64"};
    Run(render);
    render[3] = "within.exr";
    render.insert(render.end(), {"--memory", "2G", "--reference", "whole.exr"});
    const nlohmann::json figures = Run(render);
    EXPECT_LT(figures.at("true_rel_rmse"), 1e-6) << estimator;
  }
}

// What a picture asks for is enough, and is not exceeded.
TEST_F(Memory, WhatAPictureAsksForIsEnough) {
  const auto scene = bench::WriteCarField(folder_, 2, 12, 1024);  // columns of 48 MiB
  const std::vector<std::string> render{"render",      scene,   "-o",        folder_ / "x.exr",
                                        "--estimator", "exact", "--shadows", "none",
                                        "--width",     "96",    "--height",  "64"};
  PeakMib(render);  // kernels are built
  int given = 165;  // the program's own, and less than the picture takes
  int refusals = 0;
  while (const int missing = MissingMib(render, given, /*may_be_enough=*/true)) {
    given += missing + 1;
    ASSERT_LT(++refusals, 4);
  }
  EXPECT_GE(refusals, 1);
  EXPECT_LE(refusals, 2);  // for the picture, and for a column
  auto words = render;
  words.insert(words.end(), {"--memory", fmt::format("{}M", given)});
  const double peak = PeakMib(words);
  std::printf("%.0f of %d MiB\n", peak, given);
  EXPECT_LT(peak, given);
}

// What the sentence asks for is enough, and is not exceeded.
TEST_F(Memory, WhatAMergeAsksForIsEnough) {
  bench::WriteMergeSession({.grid_width = 2,
                            .grid_height = 1,
                            .exposures = 3,
                            .sensor = 1024,
                            .lattice = 1000,
                            .reflector = false,
                            .folder = folder_,
                            .keep = true,
                            .cases = {}},
                           folder_ / "session");
  const std::vector<std::string> merge{"merge", folder_ / "session", "-o", folder_ / "m.meas.exr"};
  constexpr int kGiven = 128;
  const int enough = kGiven + MissingMib(merge, kGiven) + 1;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "m.meas.exr"));
  auto words = merge;
  words.insert(words.end(), {"--memory", fmt::format("{}M", enough)});
  const double peak = PeakMib(words);
  std::printf("%.0f of %d MiB\n", peak, enough);
  EXPECT_LT(peak, enough);
}

}  // namespace
}  // namespace luxfield::e2e
