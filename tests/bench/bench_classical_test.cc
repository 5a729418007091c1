// From where on a photometric file is good enough: a square lamp whose points shine alike, so that its
// area is right everywhere and its point off as the square of size over distance.
#include "luxfield/bench/bench_classical.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::bench {
namespace {

TEST(BenchClassical, GoodFromIsWhereTheCurveStaysBelow) {
  const std::vector<ErrorAt> curve{{0.1, 0.4}, {1, 0.04}, {2, 0.05}, {10, 0.002}};
  EXPECT_EQ(GoodFrom(curve, 0.001), std::nullopt);
  EXPECT_EQ(GoodFrom(curve, 0.5), 0.1);
  EXPECT_NEAR(*GoodFrom(curve, 0.05), 0.8, 1e-12);  // ln 8 / ln 10 of the way
  EXPECT_NEAR(*GoodFrom(curve, 0.01), 2 * std::sqrt(5), 1e-12);
}

// 0.2 m x 0.2 m of one radiance in each direction, L = (1 - |t|^2 / 2)^2 by tangents t up to 1.4,
// which the lattice holds from every point.
std::filesystem::path WriteEvenLamp() {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.2;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBox), 16, 16, 0.0125);
  geometry.lattice = {80, 80, -0.4, 0.4, 0.01, 0.01};
  geometry.unit = lightfield::FluxUnit::kLumen;
  lightfield::LightField field(geometry);
  const auto& lattice = geometry.lattice;
  for (int m = 0; m < geometry.grid.count(); ++m) {
    const double u = geometry.grid.u0_m + (m % 16 + 0.5) * 0.0125,
                 v = geometry.grid.v0_m + (m / 16 + 0.5) * 0.0125;
    const auto image = field.image(m, 0);
    for (int row = 0; row < lattice.height; ++row)
      for (int column = 0; column < lattice.width; ++column) {
        const lightfield::Vec2 centre = lattice.centre(row, column);
        const double cosine = lightfield::CosTheta(geometry.delta_m, {u, v}, centre),
                     tangent2 = 1 / (cosine * cosine) - 1,
                     radiance = std::pow(std::max(0.0, 1 - tangent2 / 2), 2);
        image[static_cast<std::size_t>(row) * lattice.width + column] =
            static_cast<float>(radiance * std::pow(cosine, 4) / std::pow(geometry.delta_m, 2));
      }
  }
  const auto path = std::filesystem::path(testing::TempDir()) / "luxfield_even.lf.exr";
  lightfield::WriteLightField(path, field);
  return path;
}

TEST(BenchClassical, TheModelOfTheLampIsRightAndThePointConverges) {
  BenchClassicalOptions options;
  options.lamps = {WriteEvenLamp()};
  options.nearest_m = 0.5;
  options.farthest_m = 8;
  options.per_decade = 4;
  options.receivers = 10;
  const auto result = BenchClassical(options);
  std::map<std::string, std::vector<double>> open, edge;
  for (const auto& row : result.at("rows")) {
    open[row.at("model")].push_back(row.at("illuminance_error"));
    edge[row.at("model")].push_back(row.at("edge_error"));
  }
  for (const auto& [model, errors] : open) {
    for (std::size_t k = 0; k < errors.size(); ++k)
      std::printf("%s %zu: %.5f %.5f\n", model.c_str(), k, errors[k], edge[model][k]);
  }
  // Cells of 12.5 mm hold the light of their middles, and texels are steps of 10 mm.
  for (const double error : open["area"]) EXPECT_LT(error, 5e-3);
  EXPECT_GT(open["point"].front(), 4 * open["area"].front());
  // Distances ascend by 16^(1/5).
  EXPECT_NEAR(std::log(open["point"][0] / open["point"][3]) / std::log(std::pow(16, 0.6)), 2, 0.2);
  EXPECT_GT(open["point"].front(), open["linear"].front());
  EXPECT_GT(edge["point"].front(), 3 * edge["area"].front());
  EXPECT_EQ(result.at("good_from").size(), 3 * options.errors.size());
}

}  // namespace
}  // namespace luxfield::bench
