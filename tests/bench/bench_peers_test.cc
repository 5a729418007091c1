#include "luxfield/bench/peers/bench_peers.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "luxfield/bench/peers/peer_scenes.h"
#include "luxfield/core/error.h"
#include "tests/bridges/foreign.h"

namespace luxfield::bench {
namespace {

// 10 s before the first sample and half a second for each.
TEST(PeerCost, IsThatOfAPictureOfTheError) {
  PeerFigures figures{.points = {{4, 12, 0.16}, {64, 42, 0.04}}};
  PeerCost cost = CostAtError(figures, 0.02);
  EXPECT_DOUBLE_EQ(cost.samples, 256);
  EXPECT_DOUBLE_EQ(cost.sample_core_s, 0.5);
  EXPECT_DOUBLE_EQ(cost.fixed_core_s, 10);
  EXPECT_DOUBLE_EQ(cost.light_core_s, 128);
  EXPECT_DOUBLE_EQ(cost.whole_core_s, 138);
  figures.points.back().core_s = 11;
  cost = CostAtError(figures, 0.02);
  EXPECT_EQ(cost.sample_core_s, 0);
  EXPECT_DOUBLE_EQ(cost.fixed_core_s, 12);
}

// Errors as n^-1/2 from 4 to 16 samples, as n^-1 from there to 64.
TEST(PeerCost, SamplesFollowTheErrorsThatWereMeasured) {
  const std::vector<PeerPoint> points{{4, 0, 0.8}, {16, 0, 0.4}, {64, 0, 0.1}};
  EXPECT_NEAR(SamplesAtError(points, 0.8), 4, 1e-12);
  EXPECT_NEAR(SamplesAtError(points, 0.4 * std::sqrt(2)), 8, 1e-12);
  EXPECT_NEAR(SamplesAtError(points, 0.4), 16, 1e-12);
  EXPECT_NEAR(SamplesAtError(points, 0.2), 32, 1e-12);
  EXPECT_NEAR(SamplesAtError(points, 0.1), 64, 1e-12);
  EXPECT_NEAR(SamplesAtError(points, 0.05), 256, 1e-12);  // beyond, n^-1/2 again
  EXPECT_NEAR(SamplesAtError(points, 1.6), 1, 1e-12);
  EXPECT_EQ(SamplesAtError(points, 16), 1);
  EXPECT_EQ(SamplesAtError({{4, 0, 0}, {16, 0, 0}}, 0.02), 1);  // no noise
  EXPECT_EQ(SamplesAtError({{4, 0, 0.8}, {16, 0, 0}}, 0.02), 16);
}

TEST(PeerCost, PointsAreMeasuredUntilTheErrorIsNear) {
  const auto last = [](double error, double exponent) {
    return MeasurePoints(error,
                         [exponent](int spp) {
                           return PeerPoint{spp, 0, std::pow(spp, exponent)};
                         })
        .back()
        .spp;
  };
  EXPECT_EQ(last(0.13, -0.5), 16);
  EXPECT_EQ(last(0.12, -0.5), 64);
  EXPECT_EQ(last(1, -0.5), 16);
  EXPECT_EQ(last(0.008, -1), 64);
  EXPECT_EQ(last(1e-4, -0.5), 256);
}

TEST(MeansAgree, ToTheirNoiseAndHalfAPerMille) {
  const PeerFigures ours{.points = {}, .mean = 100, .mean_se = 0.03};
  PeerFigures peer{.points = {}, .mean = 100.1999, .mean_se = 0.04};
  EXPECT_TRUE(MeansAgree(ours, peer));
  peer.mean = 100.2001;
  EXPECT_FALSE(MeansAgree(ours, peer));
  peer.mean = 99.7999;
  EXPECT_FALSE(MeansAgree(ours, peer));
}

PeersOptions Small(const std::string& name) {
  PeersOptions options;
  options.folder = std::filesystem::path(testing::TempDir()) /
                   ("bench_peers_" + name + "_" + std::to_string(::getpid()));
  options.python = "/nowhere/python";
  options.scripts = LUXFIELD_SOURCE_DIR "/bench/peers";
  options.distribution = LUXFIELD_SOURCE_DIR "/data/scenes/tube.ies";
  options.scenes = {"spot lights", "IES lamp"};
  options.width = 24;
  options.height = 18;
  options.triangles = 200;
  options.runs = 2;
  options.error = 1;
  return options;
}

// Without a peer our own rows stand there, and the peers are named as missing.
TEST(BenchPeers, NamesWhatIsMissing) {
  const PeersOptions options = Small("missing");
  const auto rows = BenchPeers(options);
  const std::vector<std::string> renderers{"luxfield", "cycles", "mitsuba", "pbrt"};
  ASSERT_EQ(rows.size(), 2 * renderers.size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto& row = rows[k];
    const bool ours = k % renderers.size() == 0;
    EXPECT_EQ(row.at("scene"), options.scenes[k / renderers.size()]);
    EXPECT_EQ(row.at("renderer"), renderers[k % renderers.size()]);
    EXPECT_EQ(row.contains("missing"), !ours) << row;
    if (!ours) continue;
    EXPECT_GT(row.at("mean"), 0);
    EXPECT_GT(row.at("whole_core_s"), 0);
    EXPECT_EQ(row.at("whole_ratio"), 1);
    EXPECT_EQ(row.at("mean_off"), 0);
    EXPECT_EQ(row.at("agrees"), true);
  }
  EXPECT_NE(rows[1].at("missing").get<std::string>().find("/nowhere/python"), std::string::npos);
  std::filesystem::remove_all(options.folder);
}

// Spot lights, whose light leaves the peers' pictures with some 1 % of noise in the mean.
TEST(BenchPeers, PeersShowTheSameScene) {
  using bridges::ForeignProgram;
  LUXFIELD_NEEDS_FOREIGN("python");
  PeersOptions options = Small("peers");
  options.python = ForeignProgram("python");
  options.scenes = {"spot lights"};
  options.width = 96;
  options.height = 72;
  const auto rows = BenchPeers(options);
  ASSERT_EQ(rows.size(), 4u);
  for (const auto& row : rows) {
    if (row.contains("missing")) {
      std::printf("SKIPPED: %s\n", row.dump().c_str());
      continue;
    }
    EXPECT_EQ(row.at("spp"), 16);
    EXPECT_LT(std::abs(row.at("mean_off").get<double>()), 0.05) << row;
    EXPECT_LT(row.at("rel_rmse"), 10) << row;
  }
  std::filesystem::remove_all(options.folder);
}

TEST(BenchPeers, AFolderWithoutScriptsIsAnInputError) {
  PeersOptions options = Small("scripts");
  options.scripts = options.folder;
  EXPECT_THROW(BenchPeers(options), InputError);
  std::filesystem::remove_all(options.folder);
}

}  // namespace
}  // namespace luxfield::bench
