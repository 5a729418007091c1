// Groups of columns: their light adds up to that of the whole.
#include "luxfield/lightfield/field_columns.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_field_file.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "tests/seed.h"

namespace luxfield::lightfield {
namespace {

// No two lengths alike, off the axis.
LightField Grain(int channels) {
  LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = BasisGrid::Centred(Basis::Make(BasisKind::kBspline2), 5, 3, 0.0165);
  g.grid.u0_m += 0.011;
  g.lattice = {11, 7, -0.14, 0.13, 0.02, 0.03};
  g.channels = channels;
  LightField field(g);
  core::Random random(TestSeed(12), 0);
  for (float& c : field.data) c = random.UniformFloat() - 0.25f;
  return field;
}

TEST(FieldColumns, TheGroupsOfAFileAddUpToIt) {
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield_field_columns.lf.exr";
  for (const int channels : {1, 3}) {
    const LightField field = Grain(channels), other(field.geometry);
    WriteLightFields(file, std::vector<PosedLightField>{{"a", {}, other}, {"b", {}, field}});
    LightFieldFile reader(file);
    for (const int at_once : {1, 2, 3, 5, 9}) {
      const FieldColumns columns(reader, 1, at_once);
      EXPECT_EQ(columns.geometry(), field.geometry);
      core::Random random(TestSeed(13), 0);
      for (int trial = 0; trial < 20; ++trial) {
        const Vec2 u{0.1 * random.Uniform() - 0.04, 0.1 * random.Uniform() - 0.05};
        const Vec2 s{0.22 * random.Uniform() - 0.14, 0.21 * random.Uniform() - 0.08};
        const auto whole = FluxDensity(field, u, s);
        std::array<double, 3> sum{};
        int next = 0;
        columns.ForEachGroup([&](const LightField& group, int first) {
          EXPECT_EQ(first, next);
          EXPECT_LE(group.geometry.grid.width, at_once);
          next += group.geometry.grid.width;
          const auto part = FluxDensity(group, u, s);
          for (std::size_t c = 0; c < 3; ++c) sum[c] += part[c];
        });
        EXPECT_EQ(next, 5);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], whole[c], 1e-13) << at_once;
      }
    }
  }
}

TEST(FieldColumns, AFieldIsOneGroup) {
  const LightField field = Grain(1);
  int groups = 0;
  FieldColumns(field).ForEachGroup([&](const LightField& group, int first) {
    ++groups;
    EXPECT_EQ(first, 0);
    EXPECT_EQ(&group, &field);
  });
  EXPECT_EQ(groups, 1);
}

}  // namespace
}  // namespace luxfield::lightfield
