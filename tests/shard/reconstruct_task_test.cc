// Bands of rows solved apart are, to the bit, the rows of the whole.
#include "luxfield/shard/reconstruct_task.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "luxfield/core/error.h"
#include "luxfield/core/execution.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/reconstruct_bands.h"
#include "luxfield/reconstruct/solve/report_json.h"
#include "luxfield/shard/gather.h"
#include "luxfield/shard/run_shard.h"
#include "tests/core/memory_folder.h"
#include "tests/shard/fake_task.h"

namespace luxfield::shard {
namespace {

using lightfield::Measurements;

constexpr std::uint64_t kSeed = 34;
constexpr int kRows = 35, kColumns = 17;  // whose product is no multiple of what travels together

// Noise of five decades with negative values, as solves get them.
Measurements Noise(std::uint64_t stream, int channels) {
  core::Random random(kSeed, stream);
  Measurements result;
  auto& g = result.geometry;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          6, 5, 0.01);
  g.lattice = {kColumns, kRows, -0.1, 0.1, 0.2 / kColumns, 0.2 / kRows};
  g.channels = channels;
  result.provenance = {{"session_plan", "a test"}};
  const std::size_t texels = g.plane_size();
  for (int m = 0; m < g.grid.count(); ++m) {
    auto& position = result.positions.emplace_back();
    for (std::size_t k = 0; k < texels * channels; ++k) {
      const double size = std::pow(10, 5 * random.Uniform() - 3);
      position.irradiance.push_back(static_cast<float>(size * (1 + random.Normal())));
      position.sigma.push_back(static_cast<float>(size * (0.01 + 0.1 * random.Uniform())));
    }
    position.count.assign(texels, 1);
    position.mask.assign(texels, 0);
  }
  return result;
}

// Texels unknown at some positions, in whole columns of the grid and in gaps, and a few everywhere.
void LoseSome(Measurements& measurements) {
  const std::size_t texels = measurements.geometry.plane_size();
  const int width = measurements.geometry.grid.width;
  for (std::size_t m = 0; m < measurements.positions.size(); ++m) {
    auto& position = measurements.positions[m];
    for (std::size_t p = 0; p < texels; ++p) {
      const bool column = p % 7 == 3 && static_cast<int>(m) % width == 0;
      const bool gap = p % 11 == 5 && m == 13;
      const bool all = p == 40 || p == 41 || p == 300;
      if (!column && !gap && !all) continue;
      position.mask[p] = lightfield::kOffSensor;
      for (int channel = 0; channel < measurements.geometry.channels; ++channel)
        position.irradiance[channel * texels + p] = position.sigma[channel * texels + p] = 0;
      position.count[p] = 0;
    }
  }
}

void Displace(Measurements& measurements) {
  core::Random random(kSeed, 99);
  for (auto& position : measurements.positions)
    position.displacement_m = {2e-4 * random.Normal(), 2e-4 * random.Normal()};
}

class ReconstructShards : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = MemoryFolder() /
              fmt::format("luxfield-bands-{}-{}",
                          testing::UnitTest::GetInstance()->current_test_info()->name(), getpid());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void ExpectEqual(const std::vector<Measurements>& measurements,
                   const reconstruct::ReconstructOptions& options = {}) {
    ReconstructFiles files;
    std::vector<Measurements> read;
    reconstruct::SourceHashes sources;
    for (const Measurements& one : measurements) {
      files.measurements.push_back(folder_ / fmt::format("{}.meas.exr", read.size()));
      lightfield::WriteMeasurements(files.measurements.back(), one);
      read.push_back(lightfield::ReadMeasurements(files.measurements.back()));
      sources.measurements.push_back(core::Sha256OfFile(files.measurements.back()));
    }
    auto whole = reconstruct::Reconstruct(read, options);
    reconstruct::StateProvenance(options, sources, &whole);
    lightfield::WriteLightField(folder_ / "whole.lf.exr", whole.coefficients);
    lightfield::WriteLightField(folder_ / "whole.sigma.lf.exr", whole.sigma);
    files.output = folder_ / "joined.lf.exr";
    files.sigma = folder_ / "joined.sigma.lf.exr";
    ExpectBands(files, options, whole);
    const ReconstructTask task(files, options);
    for (const int shards : {1, 3, 5, kRows}) {
      const auto job_folder = folder_ / fmt::format("job{}", shards);
      std::filesystem::remove_all(job_folder);
      WriteJob(job_folder, MakeJob("reconstruct", {}, task, shards));
      const Job job = ReadJob(job_folder);
      for (int n = 0; n < shards; ++n) {
        core::Execution execution;
        execution.threads = 1 + n % 2;
        core::RunWith(execution, [&] { RunShard(job_folder, job, task, n); });
      }
      Gather(job_folder, job, task);
      EXPECT_TRUE(BytesOf(files.output) == BytesOf(folder_ / "whole.lf.exr")) << shards;
      EXPECT_TRUE(BytesOf(files.sigma) == BytesOf(folder_ / "whole.sigma.lf.exr")) << shards;
    }
  }

  // One after the other in this process.
  void ExpectBands(const ReconstructFiles& files, const reconstruct::ReconstructOptions& options,
                   const reconstruct::Reconstruction& whole) {
    for (const int rows : {16, 32, kRows}) {
      const auto report = reconstruct::ReconstructInBands(files, options, rows);
      EXPECT_TRUE(BytesOf(files.output) == BytesOf(folder_ / "whole.lf.exr")) << rows;
      EXPECT_TRUE(BytesOf(files.sigma) == BytesOf(folder_ / "whole.sigma.lf.exr")) << rows;
      nlohmann::json of_bands = ToJson(report), of_whole = ToJson(whole.report);
      for (const char* sum : {"c_mean", "negative_energy", "sigma_relative", "sigma_median"}) {
        // The median of bands is interpolated between values that differ by 2^-10.
        const double tolerance = sum == std::string("sigma_median") ? 0x1p-10 : 1e-6;
        EXPECT_NEAR(of_bands[sum].get<double>(), of_whole[sum].get<double>(),
                    tolerance * std::abs(of_whole[sum].get<double>()))
            << sum;
        of_bands.erase(sum);
        of_whole.erase(sum);
      }
      EXPECT_EQ(of_bands, of_whole) << rows;
    }
  }

  std::filesystem::path folder_;
};

TEST_F(ReconstructShards, OfTheGramSolve) {
  ExpectEqual({Noise(1, 3)});
  ExpectEqual({Noise(2, 1)},
              {.precision = reconstruct::Precision::kDouble, .keep = reconstruct::Keep::kNone});
}

TEST_F(ReconstructShards, WithTexelsOfWhichSomeOrNothingIsKnown) {
  Measurements measurements = Noise(3, 3);
  LoseSome(measurements);
  ExpectEqual({measurements});
}

TEST_F(ReconstructShards, OfDisplacedPositions) {
  Measurements measurements = Noise(4, 1);
  Displace(measurements);
  ExpectEqual({measurements});
  LoseSome(measurements);
  ExpectEqual({measurements});
}

TEST_F(ReconstructShards, OfSeveralMeasurements) { ExpectEqual({Noise(5, 1), Noise(6, 1)}); }

TEST_F(ReconstructShards, OfTheNonNegativeSolve) {
  ExpectEqual({Noise(7, 3)}, {.non_negative = true});
}

TEST_F(ReconstructShards, OfDualFilters) {
  Measurements measurements = Noise(8, 3);
  measurements.filter = lightfield::FilterKind::kDual;
  ExpectEqual({measurements});
  LoseSome(measurements);
  ExpectEqual({measurements});
}

// As many rows as fit, all of them or a multiple of 16, and a sentence where 16 do not fit.
TEST_F(ReconstructShards, BandsAreWhatFits) {
  ReconstructFiles files;
  files.measurements = {folder_ / "one.meas.exr"};
  lightfield::WriteMeasurements(files.measurements[0], Noise(10, 1));
  for (const int rows : {16, 32, kRows})
    EXPECT_EQ(reconstruct::BandRows(files, reconstruct::BandBytes(files, rows)), rows);
  EXPECT_EQ(reconstruct::BandRows(files, reconstruct::BandBytes(files, kRows) - 1), 32);
  EXPECT_EQ(reconstruct::BandRows(files, reconstruct::BandBytes(files, 31)), 16);
  EXPECT_THROW(reconstruct::BandRows(files, reconstruct::BandBytes(files, 16) - 1), InputError);
}

// What takes sums over all texels is refused, and not done for the rows alone.
TEST_F(ReconstructShards, SumsOverAllTexelsAreRefused) {
  const std::vector<Measurements> one{Noise(9, 1)};
  const reconstruct::WholeFigures whole = reconstruct::FindWholeFigures(one);
  reconstruct::ReconstructOptions regularised, by_irradiance;
  regularised.regularise = true;
  by_irradiance.non_negative = true;
  by_irradiance.metric = reconstruct::NonNegativeMetric::kIrradiance;
  for (const auto& options : {regularised, by_irradiance})
    EXPECT_THROW(reconstruct::ReconstructRows(one, options, whole), InputError);
}

}  // namespace
}  // namespace luxfield::shard
