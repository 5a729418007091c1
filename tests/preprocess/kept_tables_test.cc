// Tables from the cache are those that are built, to the bit: cold, warm, off and damaged.
#include "luxfield/preprocess/kept_tables.h"

#include <gtest/gtest.h>

#include "luxfield/core/random.h"
#include "tests/cache_folder.h"
#include "tests/seed.h"

namespace luxfield::preprocess {
namespace {

class KeptTablesTest : public testing::Test {
 protected:
  void SetUp() override {
    lightfield::LuminaireGeometry geometry;
    geometry.delta_m = 0.3;
    geometry.grid = lightfield::BasisGrid::Centred(
        lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 3, 2, 0.02);
    geometry.lattice = {17, 12, -0.2, 0.2, 0.4 / 17, 0.4 / 12};
    geometry.channels = 3;
    field_ = lightfield::LightField(geometry);
    core::Random random(TestSeed(4), 0);
    for (float& c : field_.data) c = random.UniformFloat() - 0.1f;
    for (int k = 0; k < 300; ++k)
      receivers_.push_back(
          {{random.Uniform() - 0.5, random.Uniform() - 0.5, 0.5 + 2 * random.Uniform()},
           {0, 0, -1}});
  }

  FieldSource Field() const {
    return [this] { return field_; };
  }

  const CacheFolder cache_{"kept_tables"};
  lightfield::LightField field_;
  std::vector<Receiver> receivers_;
  const FieldOrigin origin_{"lamp.lf.exr", std::string(64, 'a')};
};

TEST_F(KeptTablesTest, SummedAreasAreTheSame) {
  ExpectSameWithAnyCache(
      cache_, [&] { return KeptTables(Field(), origin_); },
      [](const Tables& a, const Tables& b) {
        EXPECT_EQ(a.width, b.width);
        EXPECT_EQ(a.height, b.height);
        EXPECT_EQ(a.grid_width, b.grid_width);
        EXPECT_EQ(a.grid_height, b.grid_height);
        EXPECT_EQ(a.basis_cells, b.basis_cells);
        EXPECT_EQ(a.light_field_sha256, b.light_field_sha256);
        EXPECT_EQ(a.sat, b.sat);
        EXPECT_EQ(a.exponent, b.exponent);
        EXPECT_EQ(a.reference, b.reference);
      });
}

TEST_F(KeptTablesTest, CellsAreTheSame) {
  ExpectSameWithAnyCache(
      cache_, [&] { return KeptCellTables(Field(), origin_); },
      [](const CellTables& a, const CellTables& b) {
        EXPECT_EQ(a.width, b.width);
        EXPECT_EQ(a.height, b.height);
        EXPECT_EQ(a.grid_width, b.grid_width);
        EXPECT_EQ(a.grid_height, b.grid_height);
        EXPECT_EQ(a.sat, b.sat);
        EXPECT_EQ(a.exponent, b.exponent);
      });
}

TEST_F(KeptTablesTest, VolumesAreTheSame) {
  ExpectSameWithAnyCache(
      cache_, [&] { return KeptVolume(field_, origin_, receivers_, {.max_rel_error = 0.02}); },
      [](const VolumeForError& a, const VolumeForError& b) {
        EXPECT_TRUE(a.met);
        EXPECT_EQ(a.met, b.met);
        EXPECT_EQ(a.rel_error, b.rel_error);
        EXPECT_EQ(a.builds, b.builds);
        EXPECT_EQ(a.volume.geometry, b.volume.geometry);
        EXPECT_EQ(a.volume.coefficients, b.volume.coefficients);
        for (const auto axis :
             {&LightVectorVolume::tau, &LightVectorVolume::a_y, &LightVectorVolume::a_x}) {
          EXPECT_EQ((a.volume.*axis).first, (b.volume.*axis).first);
          EXPECT_EQ((a.volume.*axis).spacing, (b.volume.*axis).spacing);
          EXPECT_EQ((a.volume.*axis).nodes, (b.volume.*axis).nodes);
        }
        ASSERT_EQ(a.judges.size(), b.judges.size());
        for (std::size_t k = 0; k < a.judges.size(); ++k) {
          EXPECT_EQ(a.judges[k].irradiance, b.judges[k].irradiance);
          EXPECT_EQ(a.judges[k].by_volume, b.judges[k].by_volume);
        }
      });
}

// All that decides a table is in its key: each change is an entry of its own.
TEST_F(KeptTablesTest, EachChangeIsAnotherEntry) {
  KeptVolume(field_, origin_, receivers_, {.max_rel_error = 0.02});
  KeptTables(Field(), origin_);
  KeptCellTables(Field(), origin_);
  EXPECT_EQ(cache_.Files().size(), 3u);
  KeptVolume(field_, origin_, receivers_, {.max_rel_error = 0.021});
  EXPECT_EQ(cache_.Files().size(), 4u);
  receivers_[17].p.x += 1e-12;
  KeptVolume(field_, origin_, receivers_, {.max_rel_error = 0.02});
  EXPECT_EQ(cache_.Files().size(), 5u);
  KeptTables(Field(), {"lamp.lf.exr", std::string(64, 'b')});
  EXPECT_EQ(cache_.Files().size(), 6u);
  KeptCellTables(Field(), {"lamp.lf.exr", std::string(64, 'a') + " +z"});
  EXPECT_EQ(cache_.Files().size(), 7u);
  // One that does not meet its error is none.
  EXPECT_FALSE(
      KeptVolume(field_, origin_, receivers_, {.max_rel_error = 1e-9, .max_bytes = 100000}).met);
  EXPECT_EQ(cache_.Files().size(), 7u);
}

}  // namespace
}  // namespace luxfield::preprocess
