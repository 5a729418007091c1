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

// 10 s before the first sample and half a second for each; an error of 4 % at 64 samples needs four
// times as many for 2 %.
TEST(PeerCost, IsThatOfAPictureOfTheError) {
  PeerFigures figures{.few = 4, .spp = 64, .few_core_s = 12, .core_s = 42, .rel_rmse = 0.04};
  PeerCost cost = CostAtError(figures, 0.02);
  EXPECT_DOUBLE_EQ(cost.sample_core_s, 0.5);
  EXPECT_DOUBLE_EQ(cost.fixed_core_s, 10);
  EXPECT_DOUBLE_EQ(cost.light_core_s, 128);
  EXPECT_DOUBLE_EQ(cost.whole_core_s, 138);
  figures.rel_rmse = 0;
  EXPECT_DOUBLE_EQ(CostAtError(figures, 0.02).light_core_s, 0.5);  // one sample at least
  figures.core_s = 11;
  cost = CostAtError(figures, 0.02);
  EXPECT_EQ(cost.sample_core_s, 0);
  EXPECT_DOUBLE_EQ(cost.fixed_core_s, 12);
}

TEST(PeerCost, SamplesAreThePowerOfFourNearestToTheError) {
  EXPECT_EQ(SamplesFor(0.02, 0.08, 4), 64);
  EXPECT_EQ(SamplesFor(0.02, 0.0559, 4), 16);  // 31.2 samples
  EXPECT_EQ(SamplesFor(0.02, 0.0575, 4), 64);  // 33.1
  EXPECT_EQ(SamplesFor(0.02, 0, 4), 16);
  EXPECT_EQ(SamplesFor(1e-4, 1, 4), 256);
}

TEST(MeansAgree, ToTheirNoiseAndHalfAPerMille) {
  const PeerFigures ours{.mean = 100, .mean_se = 0.03};
  PeerFigures peer{.mean = 100.1999, .mean_se = 0.04};
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
  return options;
}

// Without a peer our own rows stand there, and the peers are named as missing.
TEST(BenchPeers, NamesWhatIsMissing) {
  const PeersOptions options = Small("missing");
  const auto rows = BenchPeers(options);
  ASSERT_EQ(rows.size(), 6u);
  for (int k = 0; k < 6; ++k) {
    const auto& row = rows[k];
    EXPECT_EQ(row.at("scene"), options.scenes[k / 3]);
    EXPECT_EQ(row.contains("missing"), k % 3 != 0) << row;
    if (k % 3 != 0) continue;
    EXPECT_EQ(row.at("renderer"), "luxfield");
    EXPECT_GT(row.at("mean"), 0);
    EXPECT_GT(row.at("whole_core_s"), 0);
    EXPECT_EQ(row.at("whole_ratio"), 1);
    EXPECT_EQ(row.at("mean_off"), 0);
    EXPECT_EQ(row.at("agrees"), true);
  }
  EXPECT_EQ(rows[1].at("renderer"), "cycles");
  EXPECT_NE(rows[1].at("missing").get<std::string>().find("/nowhere/python"), std::string::npos);
  std::filesystem::remove_all(options.folder);
}

// Spot lights, whose light leaves both peers' pictures with some 1 % of noise in the mean.
TEST(BenchPeers, PeersShowTheSameScene) {
  using bridges::ForeignProgram;
  LUXFIELD_NEEDS_FOREIGN("python");
  PeersOptions options = Small("peers");
  options.python = ForeignProgram("python");
  options.scenes = {"spot lights"};
  options.width = 96;
  options.height = 72;
  options.error = 1;
  const auto rows = BenchPeers(options);
  ASSERT_EQ(rows.size(), 3u);
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
