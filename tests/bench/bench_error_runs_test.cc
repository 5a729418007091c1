#include "luxfield/bench/all/bench_error_runs.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "luxfield/render/accuracy/car2.h"
#include "tests/seed.h"

namespace luxfield::bench {
namespace {

// Pictures of known noise about a picture that is not even: each error's square is right in the
// mean over many sets.
TEST(ErrorsAmong, AreThoseOfTheNoise) {
  const std::uint64_t seed = TestSeed(7);
  constexpr int kSets = 40, kPictures = 5;
  constexpr double kNoise = 0.2, kMean = 2;
  double sum = 0, squares = 0;
  for (int set = 0; set < kSets; ++set) {
    core::Random random(seed, static_cast<std::uint64_t>(set));
    std::vector<core::Image> pictures(kPictures, core::Image(20, 10, 1));
    for (core::Image& picture : pictures)
      for (std::size_t i = 0; i < picture.data.size(); ++i)
        picture.data[i] =
            static_cast<float>(kMean * (i % 2 ? 1.5 : 0.5) + kNoise * random.Normal());
    double of_set = 0;
    for (const double error : ErrorsAmong(pictures))
      of_set += std::pow(error * kMean / kNoise, 2) / kPictures;
    sum += of_set;
    squares += of_set * of_set;
  }
  const double mean = sum / kSets, sigma = std::sqrt((squares / kSets - mean * mean) / (kSets - 1));
  std::printf("squared error over the noise's %.4f +- %.4f\n", mean, sigma);
  EXPECT_LT(std::abs(mean - 1), 4.5 * sigma);
  EXPECT_LT(sigma, 0.02);
}

TEST(ErrorRunsSummary, TellsFlipsAndTheirCost) {
  const auto row = [](const char* estimator, double core_s, double reached) {
    return nlohmann::json{
        {"estimator", estimator}, {"core_s", core_s}, {"wall_s", 2 * core_s}, {"reached", reached}};
  };
  const auto summary = ErrorRunsSummary({row("gloss", 10, 0.01), row("cells", 12, 0.02),
                                         row("gloss", 11, 0.015), row("gloss", 8, 0.01)});
  EXPECT_EQ(summary.at("runs"), 4);
  EXPECT_EQ(summary.at("flips"), 1);
  EXPECT_EQ(summary.at("estimators").at("gloss"), 3);
  EXPECT_DOUBLE_EQ(summary.at("flip_ratio"), 1.2);
  EXPECT_DOUBLE_EQ(summary.at("worst_core_s"), 12);
  EXPECT_DOUBLE_EQ(summary.at("worst_reached"), 0.02);
  EXPECT_DOUBLE_EQ(
      ErrorRunsSummary({row("gloss", 10, 0.01), row("gloss", 20, 0.01)}).at("flip_ratio"), 1);
}

// A lamp before a box, whose penumbra is sampled, twice, beside a thread of load.
TEST(BenchErrorRuns, RunsTheProgramAsUsersStartIt) {
  ErrorRunsOptions options;
  options.folder = std::filesystem::path(testing::TempDir()) /
                   ("bench_error_runs_" + std::to_string(::getpid()));
  std::filesystem::create_directories(options.folder);
  options.scene = options.folder / "scene.toml";
  lightfield::WriteLightField(options.folder / "lamp.lf.exr", render::SyntheticCar2({3, 3, 16, 1}));
  core::WriteFileAtomically(options.scene, R"([camera]
position = [1, -2, 2.5]
look_at = [0, 3, 0]
width = 32
height = 24

[[material]]
name = "road"
albedo = [0.3, 0.3, 0.3]

[[quad]]
corner = [-10, -5, 0]
edge_u = [20, 0, 0]
edge_v = [0, 30, 0]
material = "road"

[[box]]
size = [1, 0.2, 0.6]
position = [0, 2, 0.3]
material = "road"

[[luminaire]]
file = "lamp.lf.exr"
position = [0, 0, 0.7]
look_at = [0, 10, 0.6]
)");
  options.error = "20%";
  options.runs = 2;
  options.load = 1;
  const auto rows = BenchErrorRuns(options);
  ASSERT_EQ(rows.size(), 2u);
  for (const auto& row : rows) {
    EXPECT_GT(row.at("core_s"), 0);
    EXPECT_GT(row.at("spp"), 0);
    EXPECT_LE(row.at("estimated"), 0.2);
    EXPECT_GT(row.at("reached"), 0);  // of other random numbers
    EXPECT_LT(row.at("reached"), 0.5);
    EXPECT_DOUBLE_EQ(row.at("reached"),
                     rows[0].at("reached"));  // of two, each is the other's judge
  }
  EXPECT_FALSE(std::filesystem::exists(options.folder / "picture.exr"));
  std::filesystem::remove_all(options.folder);
}

}  // namespace
}  // namespace luxfield::bench
