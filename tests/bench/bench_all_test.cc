// The rows of `bench all`, and what they are measured on: meshes, rays, lamps, a sampler.
#include "luxfield/bench/all/bench_all.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "luxfield/bench/all/process.h"
#include "luxfield/bench/bench_lamps.h"
#include "luxfield/bench/bench_rays.h"
#include "luxfield/bench/device_limits.h"
#include "luxfield/bench/hill_mesh.h"
#include "luxfield/bench/plain_cdf.h"
#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/scene/mesh.h"
#include "tests/seed.h"

namespace luxfield::bench {
namespace {

std::filesystem::path Folder() {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "bench_all";
  std::filesystem::create_directories(folder);
  return folder;
}

TEST(BenchAll, RatiosAreAboveOneWhereTheTargetIsMissed) {
  Figures figures;
  figures.runs = {3, 1, 2};
  figures.peer = "a copy";
  figures.peer_value = 0.5;
  nlohmann::json row = RowOf({"a time", "s", 1}, figures);
  EXPECT_EQ(row["work"], "a time");
  EXPECT_EQ(row["unit"], "s");
  EXPECT_EQ(row["value"], 2);
  EXPECT_EQ(row["target"], 1);
  EXPECT_EQ(row["ratio_to_target"], 2);
  EXPECT_EQ(row["peer"], "a copy");
  EXPECT_EQ(row["peer_value"], 0.5);
  EXPECT_EQ(row["runs"], nlohmann::json({3, 1, 2}));
  EXPECT_TRUE(row["limit"].is_null());
  row = RowOf({"a rate", "fps", 5, true}, figures);
  EXPECT_EQ(row["ratio_to_target"], 2.5);
  figures.target = 8;
  row = RowOf({"a rate", "fps", 5, true}, figures);
  EXPECT_EQ(row["target"], 8);
  EXPECT_EQ(row["ratio_to_target"], 4);
}

// Linux hands the peak of a process that starts a program on to it.
TEST(BenchAll, TheMemoryOfAProgramIsItsOwn) {
  constexpr std::size_t kMib = std::size_t{1} << 20, kOurs_mib = 300;
  { std::vector<char> ours(kOurs_mib * kMib, 1); }
  const ProcessRun run = RunProcess({"/bin/true"}, Folder());
  EXPECT_GT(run.peak_mib, 0);
  EXPECT_LT(run.peak_mib, kOurs_mib);
}

// Two box functions one metre wide on F, from 0.1 m on; I lies half-way to the receivers, 1 m above
// F, so that windows on it are half as wide, from 0.05 m on, in texels of 0.25 m.
TEST(BenchAll, MultiplyAddsOfExactAreTwoForEveryTexelSeen) {
  const auto device = render::Device::Open();
  lightfield::LightField field;
  auto& g = field.geometry;
  g.grid = {lightfield::Basis::Make(lightfield::BasisKind::kBox), 2, 1, 0.1, 0.1, 1};
  g.lattice = {.width = 8, .height = 4, .s0_m = 0, .t1_m = 1, .ds_m = 0.25, .dt_m = 0.25};
  g.delta_m = 0.5;
  std::vector<cl_float4> position(4, {{0, 0, 1, 1}}), normal(4, {{0, 0, -1, 0}});
  position[3].s[3] = 0;  // sees nothing
  render::GBuffer gbuffer(device, 4, 1);
  gbuffer.position.Upload(std::span<const cl_float4>(position));
  gbuffer.normal.Upload(std::span<const cl_float4>(normal));
  // Columns: 0.05 to 0.55 m and 0.55 to 1.05 m, three texels each; rows: 0.05 to 0.55 m, three.
  constexpr double kSeen = (3 + 3) * 3;
  EXPECT_EQ(ExactMultiplyAdds(field, gbuffer), 3 * 2 * kSeen);
}

TEST(BenchAll, WhatCannotBeMeasuredHasARowThatSaysWhy) {
  AllOptions options;
  options.runs = 1;
  options.scenes = Folder() / "nowhere";
  options.folder = Folder();
  options.works = {"garage", "at equal error, 512 x 384"};
  const nlohmann::json result = BenchAll(options);
  EXPECT_TRUE(result["device"].is_string());
  EXPECT_TRUE(result["version"].is_string());
  ASSERT_EQ(result["rows"].size(), 2u);
  for (const auto& row : result["rows"]) {
    EXPECT_TRUE(row["value"].is_null());
    EXPECT_TRUE(row["ratio_to_target"].is_null());
    EXPECT_GT(row["target"].get<double>(), 0);
    EXPECT_TRUE(row["runs"].empty());
    EXPECT_FALSE(row["limit"].get<std::string>().empty());
  }
  EXPECT_NE(result["rows"][0]["limit"].get<std::string>().find("nowhere"), std::string::npos);
  options.works = {"no such work"};
  EXPECT_THROW(BenchAll(options), InputError);
}

TEST(BenchAll, HillsAreReadBackFromPly) {
  const scene::Geometry hills = HillMesh(200);
  ASSERT_EQ(hills.triangles.size(), 200u);
  WritePly(Folder() / "hills.ply", hills);
  scene::Geometry read;
  scene::AppendMesh(Folder() / "hills.ply", {}, {}, read);
  ASSERT_EQ(read.triangles.size(), hills.triangles.size());
  for (std::size_t k = 0; k < hills.triangles.size(); ++k)
    for (int corner = 0; corner < 3; ++corner)
      EXPECT_EQ(read.corner(k, corner), hills.corner(k, corner));
}

TEST(BenchAll, DeviceAndEmbreeHitTheSame) {
  BenchRaysOptions options;
  options.triangles = 2000;
  options.width = 64;
  options.height = 48;
  options.runs = 1;
  const auto speeds = BenchRays(options);
  ASSERT_EQ(speeds.size(), 3u);
  for (const RaySpeed& speed : speeds) {
    // Two of 3072 rays may pass an edge on different sides, in float32.
    EXPECT_NEAR(speed.device_hits, speed.embree_hits, 2.5 / 3072) << speed.rays;
    EXPECT_GT(speed.embree_hits, 0.01) << speed.rays;
    EXPECT_LT(speed.embree_hits, 0.99) << speed.rays;
  }
}

TEST(BenchAll, OneLampTakesNoMoreSamplesThanAskedFor) {
  BenchLampsOptions options;
  options.lamps = {1, 2};
  options.width = 32;
  options.height = 24;
  options.runs = 2;
  options.folder = Folder();
  const auto all = BenchLamps(options);
  ASSERT_EQ(all.size(), 2u);
  // Sides of boxes that face away from the lamp take none.
  EXPECT_LE(all[0].samples_per_pixel, options.samples_per_pixel);
  EXPECT_GT(all[0].samples_per_pixel, options.samples_per_pixel / 2);
  for (const LampsFigures& figures : all) {
    EXPECT_EQ(figures.core_s.size(), 2u);
    EXPECT_GT(figures.relative_variance, 0);
    EXPECT_LT(figures.relative_variance, 10);
  }
}

TEST(BenchAll, ExponentsAreSlopesOfLogarithms) {
  std::vector<LampsFigures> all;
  for (const int lamps : {1, 10, 200, 5000})
    all.push_back({lamps, {0.3 * std::sqrt(lamps)}, 16, 0.01 * std::pow(lamps, -0.25)});
  EXPECT_NEAR(ExponentOf(all, CostOf), 0.5, 1e-12);
  EXPECT_NEAR(ExponentOf(all, CostAtEqualError), 0.25, 1e-12);
}

// Chi-squared over all 24 texels of three images, one of them dark.
TEST(PlainCdf, DrawsInProportionToC) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.3;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBox), 3, 1, 0.1);
  geometry.lattice = {4, 2, -0.2, 0.1, 0.1, 0.1};
  lightfield::LightField field(geometry);
  core::Random random(TestSeed(6), 1);
  double total = 0;
  for (const int m : {0, 2})
    for (float& c : field.image(m, 0)) total += c = 0.1f + random.UniformFloat();
  const PlainCdf cdf(field);
  constexpr int kDraws = 100000;
  std::vector<double> counts(field.data.size());
  for (int k = 0; k < kDraws; ++k) {
    const float a = random.UniformFloat(), b = random.UniformFloat();
    const auto texel = cdf.Draw(a, b, random.UniformFloat());
    ++counts[(static_cast<std::size_t>(texel.image) * 2 + texel.row) * 4 + texel.column];
  }
  double chi_squared = 0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double expected = kDraws * field.data[k] / total;
    if (expected > 0)
      chi_squared += std::pow(counts[k] - expected, 2) / expected;
    else
      EXPECT_EQ(counts[k], 0);
  }
  EXPECT_LT(chi_squared, 60);  // 15 degrees of freedom: exceeded once in 4e6
}

}  // namespace
}  // namespace luxfield::bench
