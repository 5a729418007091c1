#include "luxfield/bench/bench_balance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "luxfield/bench/feedback_pictures.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"

namespace luxfield::bench {
namespace {

std::filesystem::path OurScene(const std::string& name) {
  return std::filesystem::path(LUXFIELD_SOURCE_DIR "/data/scenes/balance") / (name + ".toml");
}

// A small run: samples that follow the BRDF hardly ever meet the smallest light, and a chosen share
// finds that out.
TEST(BenchBalance, ChosenSharesAvoidTheStrategyThatFails) {
  BenchBalanceOptions options;
  options.scenes = {OurScene("plates")};
  options.width = 32;
  options.height = 24;
  options.samples_per_light = 64;
  options.pilot = 32;
  options.seeds = 6;
  options.reference_samples = 2000;
  const auto result = BenchBalance(options);
  ASSERT_EQ(result["rows"].size(), 8u);
  std::map<std::string, double> variance;
  for (const auto& row : result["rows"]) {
    const auto strategy = row["strategy"].get<std::string>();
    variance[strategy] = row["rel_variance"];
    std::printf("%s: relative variance %.4g +- %.2g, efficiency %.3f of balance\n",
                strategy.c_str(), variance[strategy], row["rel_variance_se"].get<double>(),
                row["rel_efficiency"].get<double>());
    EXPECT_EQ(row["scene"], "plates");
    EXPECT_GT(row["efficiency"].get<double>(), 0);
    EXPECT_LT(row["rel_variance_se"].get<double>(), variance[strategy]);
  }
  EXPECT_LT(variance.at("alpha_newton"), 0.1 * variance.at("brdf_only"));
  ASSERT_EQ(result["search"].size(), 1u);
  const auto& search = result["search"][0];
  EXPECT_LE(search["rel_variance"].get<double>(), 1.5 * variance.at("balance"));
  EXPECT_GT(search["of_each_pixel"].get<double>(), 0);
  EXPECT_GT(search["known"].get<double>(), 0);
  EXPECT_LT(search["known"].get<double>(), 1.5 * search["newton"].get<double>());
  ASSERT_EQ(result["steps"].size(), 2u);
  EXPECT_EQ(result["steps"][1]["scene"], "all");
  EXPECT_TRUE(result["steps"][0]["holds"]) << result["steps"][0];
  ASSERT_EQ(result["claims"].size(), 2u);
  EXPECT_TRUE(result["claims"][0]["holds"].is_boolean());
}

TEST(BenchBalance, WrongOptionsAreNamed) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  BenchBalanceOptions options;
  options.seeds = 3;
  EXPECT_THAT([&] { BenchBalance(options); }, ThrowsMessage<InputError>(HasSubstr("seeds")));
  options = {};
  options.samples_per_light = 2;
  EXPECT_THAT([&] { BenchBalance(options); }, ThrowsMessage<InputError>(HasSubstr("samples")));
}

TEST(Feedback, ShowsWhereSamplesGo) {
  const scene::Scene scene = scene::ReadScene(
      OurScene("mixed"), {.light_fields = {}, .tables = {}, .width = 32, .height = 24});
  const Feedback feedback = MakeFeedback(render::Device::Open(), scene,
                                         {.samples_per_light = 32,
                                          .pilot = 16,
                                          .shadows = true,
                                          .seeds = 3,
                                          .reference_samples = 256});
  ASSERT_THAT(feedback.lights, testing::ElementsAre("light 1", "light 2", "environment"));
  ASSERT_EQ(feedback.light_shares.size(), 3u);
  std::size_t hit = 0, uneven = 0, last_hit = 0;
  for (std::size_t k = 0; k < feedback.light_share.data.size(); ++k) {
    const float share = feedback.light_share.data[k];
    const bool missed = std::isnan(share);
    EXPECT_EQ(std::isnan(feedback.variance_gain.data[k]), missed);
    EXPECT_EQ(std::isnan(feedback.face_shares.data[k]), missed);
    if (missed) continue;
    ++hit;
    last_hit = k;
    uneven += std::abs(share - 0.5f) > 0.1f;
    EXPECT_TRUE(share > 0.024f && share < 0.976f) << share;
    EXPECT_LE(std::abs(feedback.variance_gain.data[k]), 1);
    double faces = 0;
    for (int face = 0; face < 6; ++face) faces += feedback.face_shares.plane(face)[k];
    EXPECT_NEAR(faces, 1, 1e-4);
  }
  EXPECT_GT(hit, 300u);
  EXPECT_LT(hit, 32u * 24);
  EXPECT_GT(uneven, hit / 4);
  EXPECT_NE(feedback.variance_gain.data[last_hit], 0);

  const auto folder = std::filesystem::path(testing::TempDir()) / "luxfield_feedback_test";
  const auto files = WriteFeedback(feedback, folder);
  EXPECT_EQ(files.size(), 8u);
  for (const auto& file : files) EXPECT_GT(std::filesystem::file_size(file), 500u) << file;
  const core::ExrReader reader(files[0]);
  EXPECT_THAT(reader.parts()[0].channels,
              testing::IsSupersetOf({"R", "light_share.Y", "light_share_3.Y", "variance_gain.Y",
                                     "lab_gain.Y", "faces.-z"}));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::bench
