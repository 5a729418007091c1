// Tables of a light field in a file, image by image, are to the byte those of one in memory.
#include "luxfield/preprocess/table_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "luxfield/core/resident_memory.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/preprocess/table_io.h"
#include "tests/core/memory_folder.h"
#include "tests/seed.h"

namespace luxfield::preprocess {
namespace {

class TableFiles : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // C of eight decades and either sign; every fourth image is dark.
  lightfield::LightField Field(int channels, std::uint64_t stream) {
    core::Random random(TestSeed(34), stream);
    lightfield::LuminaireGeometry g;
    g.delta_m = 0.3;
    g.grid = lightfield::BasisGrid::Centred(
        lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 4, 3, 0.01);
    g.lattice = {11, 7, -0.1, 0.1, 0.02, 0.03};
    g.channels = channels;
    lightfield::LightField field(g);
    for (int m = 0; m < g.grid.count(); ++m)
      for (int channel = 0; channel < channels; ++channel)
        for (float& c : field.image(m, channel))
          c = m % 4 == 3 ? 0
                         : static_cast<float>(std::pow(10, 8 * random.Uniform() - 4) *
                                              (random.Uniform() < 0.2 ? -1 : 1));
    return field;
  }

  std::filesystem::path folder_ = MemoryFolder() / fmt::format("table_files_{}", ::getpid());
};

TEST_F(TableFiles, AreThoseOfALightFieldInMemory) {
  for (const int channels : {1, 3}) {
    const auto field = Field(channels, static_cast<std::uint64_t>(channels));
    TableSource source{folder_ / "x.lf.exr", "x.lf.exr", {}};
    lightfield::WriteLightField(source.light_field, field);
    source.sha256 = core::Sha256OfFile(source.light_field);
    const Tables tables = BuildTables(field, "x.lf.exr", source.sha256);
    WriteTables(folder_ / "whole.tab.exr", tables);
    for (source.images_at_once = 1; source.images_at_once < 20; source.images_at_once += 6) {
      const auto points = WriteTablesOf(source, folder_ / "some.tab.exr");
      EXPECT_TRUE(core::ReadFile(folder_ / "some.tab.exr") ==
                  core::ReadFile(folder_ / "whole.tab.exr"))
          << channels << " channels, " << source.images_at_once << " at once";
      for (int m = 0; m < tables.count(); ++m) EXPECT_EQ(points[m].lit, tables.Total(m) > 0) << m;
    }
  }
}

TEST_F(TableFiles, AsManyImagesAtOnceAsFit) {
  const auto geometry = Field(3, 9).geometry;
  for (const int images : {1, 2, 5})
    EXPECT_EQ(TableImagesWithin(geometry, "x", TableBytes(geometry, images), 8), images);
  EXPECT_EQ(TableImagesWithin(geometry, "x", TableBytes(geometry, 3) - 1, 8), 2);
  EXPECT_EQ(TableImagesWithin(geometry, "x", TableBytes(geometry, 9), 8), 8);
  EXPECT_THROW(TableImagesWithin(geometry, "x", TableBytes(geometry, 1) - 1, 8), InputError);
}

// What is taken fits, and little more is asked for: of images that are few and large, and of
// parts that are many and small.
TEST_F(TableFiles, TakeWhatIsEstimated) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer's own memory is several times the program's";
#endif
  constexpr double kMib = 1 << 20, kSpareMib = 32;
  for (const auto& [grid, texels] : {std::pair{2, 1024}, {6, 512}, {20, 64}})
    for (const int images : {1, 3}) {
      TableSource source{folder_ / "x.lf.exr", "x.lf.exr", {}, images};
      lightfield::LuminaireGeometry g;
      {
        g.delta_m = 0.3;
        g.grid = lightfield::BasisGrid::Centred(
            lightfield::Basis::Make(lightfield::BasisKind::kBspline2), grid, grid, 0.01);
        g.lattice = {texels, texels, -0.1, 0.1, 0.2 / texels, 0.2 / texels};
        g.channels = 1;
        lightfield::LightField field(g);
        for (int m = 0; m < g.grid.count(); ++m)
          for (std::size_t k = 0; k < g.plane_size(); ++k)
            field.image(m, 0)[k] = static_cast<float>(k % 251);
        lightfield::WriteLightField(source.light_field, field);
      }
      source.sha256 = core::Sha256OfFile(source.light_field);
      ::malloc_trim(0);
      const double before = static_cast<double>(core::ResidentBytes()) / kMib;
      core::TakePeakMib();
      WriteTablesOf(source, folder_ / "x.tab.exr");
      const double taken = core::TakePeakMib() - before,
                   estimate = static_cast<double>(TableBytes(g, images)) / kMib;
      std::printf("%d x %d images of %d^2, %d at once: %.1f of %.1f MiB\n", grid, grid, texels,
                  images, taken, estimate);
      EXPECT_LT(taken, estimate);
      EXPECT_GT(taken, estimate - kSpareMib);
    }
}

}  // namespace
}  // namespace luxfield::preprocess
