#include "render/renderer.h"

#include <fmt/format.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>

#include "core/error.h"
#include "core/file.h"
#include "core/progress.h"
#include "core/random.h"
#include "lightfield/light_vector.h"
#include "preprocess/table_io.h"

namespace luxfield::render {
namespace {

using lightfield::LightField;
using lightfield::Vec3;

std::filesystem::path Temporary(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / ("luxfield_renderer_" + name);
}

// 3 x 2 images of 8 x 6 texels with structure, a lamp 0.1 m wide.
LightField Lamp(int channels, lightfield::FluxUnit unit = lightfield::FluxUnit::kLumen) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.05;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 3, 2, 0.02);
  geometry.lattice = {8, 6, -0.08, 0.06, 0.02, 0.02};
  geometry.channels = channels;
  geometry.unit = unit;
  LightField field(geometry);
  core::Random random(77, 0);
  for (float& value : field.data) value = static_cast<float>(1e6 * random.Uniform());
  return field;
}

// The lamp's file, and its tables beside it unless `tables` is false.
std::filesystem::path WriteLamp(const std::string& name, const LightField& field,
                                bool tables = true) {
  const auto path = Temporary(name + ".lf.exr");
  WriteLightField(path, field);
  const auto tables_path = Temporary(name + ".tab.exr");
  std::filesystem::remove(tables_path);
  if (tables)
    preprocess::WriteTables(
        tables_path, preprocess::BuildTables(field, path.string(), core::Sha256OfFile(path)));
  return path;
}

// A floor, lit from above by `luminaires`.
scene::Scene Floor(std::vector<scene::Luminaire> luminaires) {
  scene::Scene scene;
  scene.geometry.materials = {{"m", {0.25f, 0.5f, 0.75f}, -1}};
  scene::AppendQuad({-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, 0, scene.geometry);
  scene.camera = scene::Camera::LookAt({0.5, -2, 2}, {0, 0.3, 0}, {0, 0, 1}, 70, 24, 16);
  scene.luminaires = std::move(luminaires);
  return scene;
}

scene::Luminaire Above(const std::filesystem::path& file, double x, double scale) {
  return {fmt::format("lamp at {}", x),
          file,
          {},
          scene::LookAt({x, 0, 1}, {0.2, 0.1, 0}, {0, 1, 0}),
          scale};
}

Frame RenderWith(const scene::Scene& scene, RenderOptions options) {
  return Renderer(Device::Open(), scene, options).Render();
}

RenderOptions Unshadowed(const std::string& estimator) {
  RenderOptions options;
  options.estimator = estimator;
  options.shadows = false;
  return options;
}

class RendererTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { core::Progress::SetQuiet(true); }
};

TEST_F(RendererTest, TwoLuminairesAddUpToTheClosedForm) {
  const LightField field = Lamp(3);
  const auto file = WriteLamp("exact", field, false);
  const auto scene = Floor({Above(file, -0.5, 1), Above(file, 0.7, 2.5)});
  const Frame frame = RenderWith(scene, Unshadowed("exact"));
  EXPECT_EQ(frame.unit, lightfield::FluxUnit::kLumen);
  int hits = 0;
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      if (frame.coverage.at(0, row, column) == 0) {
        EXPECT_EQ(frame.radiance.at(1, row, column), 0);
        continue;
      }
      ++hits;
      const Vec3 p{frame.position.at(0, row, column), frame.position.at(1, row, column),
                   frame.position.at(2, row, column)};
      std::array<double, 3> expected{};
      double size = 0;
      for (const auto& luminaire : scene.luminaires) {
        const auto luminaire_from_world = luminaire.world_from_luminaire.Inverse();
        const Vec3 local = luminaire_from_world.Point(p);
        const auto e = ExactIrradiance(field, local, luminaire_from_world.Vector({0, 0, 1}));
        const auto j = ClosedFormLightVector(field, local).j;
        for (int c = 0; c < 3; ++c) expected[c] += luminaire.scale * e[c];
        size += luminaire.scale * Length(j[1]);
      }
      for (int c = 0; c < 3; ++c) {
        // The estimator's bound of 1e-5 |J|, and float32 positions.
        EXPECT_NEAR(frame.irradiance.at(c, row, column), expected[c], 2e-5 * size);
        const double albedo = 0.25 * (c + 1);
        EXPECT_NEAR(frame.radiance.at(c, row, column),
                    albedo / std::numbers::pi * frame.irradiance.at(c, row, column), 1e-6 * size);
      }
      EXPECT_EQ(frame.normal.at(2, row, column), 1);
      EXPECT_EQ(frame.variance.at(0, row, column), 0);
    }
  EXPECT_GT(hits, 200);
}

TEST_F(RendererTest, PixelSamplesAverageAndCoverEdges) {
  const LightField field = Lamp(1);
  auto scene = Floor({Above(WriteLamp("edges", field, false), 0, 1)});
  auto options = Unshadowed("exact");
  options.antialias = 16;
  const Frame fine = RenderWith(scene, options);
  options.antialias = 1;
  constexpr int kBlock = 8;
  scene.camera.width *= kBlock;
  scene.camera.height *= kBlock;
  const Frame large = RenderWith(scene, options);
  const double brightest =
      *std::max_element(large.irradiance.data.begin(), large.irradiance.data.end());
  int edges = 0, inner = 0;
  for (int row = 0; row < fine.height; ++row)
    for (int column = 0; column < fine.width; ++column) {
      double sum = 0, hits = 0, low = 1e30, high = 0;
      for (int i = 0; i < kBlock * kBlock; ++i) {
        const int y = row * kBlock + i / kBlock, x = column * kBlock + i % kBlock;
        hits += large.coverage.at(0, y, x);
        const double e = large.irradiance.at(0, y, x);
        sum += e;
        low = std::min(low, e);
        high = std::max(high, e);
      }
      const double share = fine.coverage.at(0, row, column);
      const double e = fine.irradiance.at(0, row, column);
      // 16 Hammersley points miss the area of a half-plane by at most 3 points.
      EXPECT_NEAR(share, hits / (kBlock * kBlock), 3.0 / 16);
      edges += share > 0 && share < 1;
      if (hits == kBlock * kBlock) {
        ++inner;
        EXPECT_NEAR(e, sum / hits, 0.1 * (high - low) + 5e-5 * brightest);
      }
      // Edge pixels show part of the radiance, but the whole irradiance.
      EXPECT_NEAR(fine.radiance.at(0, row, column), share * 0.25 / std::numbers::pi * e, 1e-5 * e);
    }
  EXPECT_GT(edges, 10);
  EXPECT_GT(inner, 100);
}

TEST_F(RendererTest, AnEmptySceneAndAnUnlitOneAreBlack) {
  auto scene = Floor({});
  const Frame unlit = RenderWith(scene, Unshadowed("exact"));
  EXPECT_THAT(unlit.radiance.data, testing::Each(0.0f));
  EXPECT_GT(*std::max_element(unlit.coverage.data.begin(), unlit.coverage.data.end()), 0.0f);
  scene.geometry = {};
  scene.luminaires = {Above(WriteLamp("empty", Lamp(1), false), 0, 1)};
  const Frame empty = RenderWith(scene, Unshadowed("exact"));
  EXPECT_THAT(empty.radiance.data, testing::Each(0.0f));
  EXPECT_THAT(empty.coverage.data, testing::Each(0.0f));
}

TEST_F(RendererTest, WrongInputIsNamed) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  const auto file = WriteLamp("wrong", Lamp(1), false);
  const auto scene = Floor({Above(file, 0, 1)});
  auto options = Unshadowed("magic");
  EXPECT_THAT([&] { RenderWith(scene, options); }, ThrowsMessage<InputError>(HasSubstr("magic")));
  options = Unshadowed("exact");
  options.samples_per_pixel = 0;
  EXPECT_THAT([&] { RenderWith(scene, options); },
              ThrowsMessage<InputError>(HasSubstr("samples per pixel")));
  EXPECT_THROW(RenderWith(Floor({Above(Temporary("nowhere.lf.exr"), 0, 1)}), Unshadowed("exact")),
               InputError);
  const auto watts = WriteLamp("watts", Lamp(1, lightfield::FluxUnit::kWatt), false);
  EXPECT_THAT(
      [&] {
        RenderWith(Floor({Above(file, 0, 1), Above(watts, 1, 1)}), Unshadowed("exact"));
      },
      ThrowsMessage<InputError>(HasSubstr("unit")));
}

}  // namespace
}  // namespace luxfield::render
