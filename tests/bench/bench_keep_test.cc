#include "luxfield/bench/bench_keep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"

namespace luxfield::bench {
namespace {

// A disc on coarse grids: least squares alone lose flux, the solve that keeps moments does not,
// and irradiance gains by it; with C >= 0, too.
TEST(BenchKeep, MomentsMendFluxAndIrradianceOfADisc) {
  BenchKeepOptions options;
  options.bases = {"bilinear", "bspline2"};
  options.cells = {6};
  options.lamps = {"disc"};
  options.texels = 24;
  options.receivers = 16;
  const auto rows = BenchKeep(options);
  ASSERT_EQ(rows.size(), 2u * 3 * 3);
  std::map<std::string, nlohmann::json> by;
  for (const auto& row : rows) {
    EXPECT_FALSE(row.at("edge_reached").get<bool>());
    by[row.at("basis").get<std::string>() + " " + row.at("keep").get<std::string>() + " " +
       row.at("solve").get<std::string>()] = row;
  }
  const auto figure = [&](const std::string& name, const char* key) {
    return std::abs(by.at(name).at(key).get<double>());
  };
  for (const std::string basis : {"bilinear", "bspline2"}) {
    EXPECT_GT(figure(basis + " none signed", "flux_error"), 2e-3) << basis;
    for (const char* kept : {" flux signed", " moments signed", " moments non_negative"})
      EXPECT_LT(figure(basis + kept, "flux_error"), 2e-5) << basis << kept;
    EXPECT_GT(figure(basis + " moments clamped", "flux_error"), 1e-3);
    EXPECT_LT(figure(basis + " moments signed", "irradiance_error"),
              0.5 * figure(basis + " none signed", "irradiance_error"));
    EXPECT_EQ(figure(basis + " moments non_negative", "negative"), 0);
    EXPECT_GT(figure(basis + " moments signed", "negative"), 0.001);
  }
  options.lamps = {"candle"};
  EXPECT_THROW(BenchKeep(options), InputError);
}

// Facets, whose beams end sharply: C >= 0 nearest texel by texel sends light astray, and nearest in
// irradiance it does not; both keep the flux.
TEST(BenchKeep, IrradianceMetricUndoesDamageOfFacets) {
  BenchKeepOptions options;
  options.bases = {"bilinear", "bspline2"};
  options.cells = {6};
  options.lamps = {"faceted"};
  options.texels = 32;
  options.receivers = 24;
  options.irradiance_metric = true;
  const auto rows = BenchKeep(options);
  ASSERT_EQ(rows.size(), 2u * (3 * 3 + 1));
  for (const std::size_t k : {9, 19}) {
    const auto& row = rows[k];
    ASSERT_EQ(row.at("solve"), "non_negative_irradiance");
    EXPECT_EQ(row.at("unconverged"), 0u);
    EXPECT_EQ(row.at("negative"), 0);
    EXPECT_LT(std::abs(row.at("flux_error").get<double>()), 2e-5);
    EXPECT_LT(row.at("irradiance_error").get<double>(),
              rows[k - 1].at("irradiance_error").get<double>());
    EXPECT_GT(row.at("damage_undone").get<double>(), 0.35) << row;
    EXPECT_LE(row.at("damage_undone").get<double>(), 1);
    EXPECT_LE(row.at("damage_undone_low"), row.at("damage_undone"));
    EXPECT_GE(row.at("damage_undone_high"), row.at("damage_undone"));
  }
}

}  // namespace
}  // namespace luxfield::bench
