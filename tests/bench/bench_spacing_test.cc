#include "luxfield/bench/bench_spacing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "tests/planning/demo_lab.h"
#include "tests/planning/lab_session.h"

namespace luxfield::bench {
namespace {

// kSquareLab with another lamp.
std::string LabWith(const std::string& lamp) {
  const std::string square = "kind = \"square\"\nside_m = 0.066\nradiance = 1e5\n";
  std::string text = planning::kSquareLab;
  return text.replace(text.find(square), square.size(), lamp);
}

// A headlight's cut-off is finer than any spacing tried.
TEST(BenchSpacing, FinerFiltersLeaveLessOfALamp) {
  const planning::ScratchFolder scratch("bench_spacing");
  const auto file = [&](const char* name) { return scratch.path() / name; };
  core::WriteFileAtomically(file("lab.toml"), LabWith("kind = \"headlight\"\n"));
  core::WriteFileAtomically(file("plan.toml"), planning::kSquarePlan);
  core::WriteFileAtomically(file("scene.toml"), planning::kWallScene);
  BenchSpacingOptions options;
  options.lab = file("lab.toml");
  options.plan = file("plan.toml");
  options.scene = file("scene.toml");
  options.folder = file("scratch");
  options.spacings_mm = {66, 33, 22};
  options.deltas_m = {0.3, 0.9};
  options.texels = 32;
  options.width = 24;
  options.height = 18;
  const nlohmann::json rows = BenchSpacing(options);
  ASSERT_EQ(rows.size(), 5u);
  for (const auto& row : rows) std::printf("%s\n", row.dump().c_str());
  const auto of = [&](std::size_t row, const char* key) { return rows[row][key].get<double>(); };
  // The lens is 180 mm wide, some 10 more are searched: 3 interior cells and one on either side.
  EXPECT_EQ(rows[0]["positions"], 25);
  EXPECT_EQ(rows[2]["positions"], 11 * 11);
  // The plan's spacing at the plan's delta is one case, whichever varies.
  for (const char* key : {"positions", "texel_mm", "flux_error", "rel_rmse", "rel_l2", "mean_lab"})
    EXPECT_EQ(rows[1][key], rows[3][key]) << key;
  EXPECT_NEAR(of(1, "texel_mm"), 16.5, 1e-9);  // 528 mm in 32
  // Away from the 180 to 195 mm of the lamp the side grows as delta does.
  EXPECT_NEAR(32 * of(4, "texel_mm"), 3 * 528 - 2 * 188, 20);
  EXPECT_LT(of(2, "rel_l2"), 0.8 * of(0, "rel_l2"));
  EXPECT_LT(of(2, "mean_lab"), of(0, "mean_lab"));
  for (std::size_t row = 0; row < rows.size(); ++row)
    EXPECT_LT(std::abs(of(row, "flux_error")), 0.02) << row;
}

TEST(BenchSpacing, LightFieldsHaveOnePlaneDistance) {
  const planning::ScratchFolder scratch("bench_spacing_field");
  const auto lab = scratch.path() / "lab.toml";
  core::WriteFileAtomically(lab, LabWith("kind = \"lightfield\"\nfile = \"lamp.lf.exr\"\n"));
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          3, 3, 0.033);
  g.lattice = {2, 2, -0.2, 0.2, 0.2, 0.2};
  lightfield::WriteLightField(scratch.path() / "lamp.lf.exr", lightfield::LightField(g));
  BenchSpacingOptions options;
  options.lab = lab;
  EXPECT_THROW(BenchSpacing(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
