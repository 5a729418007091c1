// Small lamps and scenes for tests of the renderer.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "luxfield/preprocess/table_io.h"
#include "luxfield/render/renderer.h"

namespace luxfield::render {

using lightfield::LightField;
using lightfield::Vec3;

inline std::filesystem::path Temporary(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / ("luxfield_renderer_" + name);
}

// 3 x 2 images of 8 x 6 texels with structure, a lamp 0.1 m wide.
inline LightField Lamp(int channels, lightfield::FluxUnit unit = lightfield::FluxUnit::kLumen) {
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
inline std::filesystem::path WriteLamp(const std::string& name, const LightField& field,
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
inline scene::Scene Floor(std::vector<scene::Luminaire> luminaires) {
  scene::Scene scene;
  scene.geometry.materials = {{"m", {0.25f, 0.5f, 0.75f}, -1}};
  scene::AppendQuad({-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, 0, scene.geometry);
  scene.camera = scene::Camera::LookAt({0.5, -2, 2}, {0, 0.3, 0}, {0, 0, 1}, 70, 24, 16);
  scene.luminaires = std::move(luminaires);
  return scene;
}

inline scene::Luminaire Above(const std::filesystem::path& file, double x, double scale) {
  return {fmt::format("lamp at {}", x),
          file,
          {},
          scene::LookAt({x, 0, 1}, {0.2, 0.1, 0}, {0, 1, 0}),
          scale};
}

inline Frame RenderWith(const scene::Scene& scene, RenderOptions options) {
  LitScene lit(Device::Open(), scene);
  return Renderer(lit, options).Render();
}

inline RenderOptions Unshadowed(const std::string& estimator) {
  RenderOptions options;
  options.estimator = estimator;
  options.shadows = Shadows::kNone;
  return options;
}

class RendererTest : public testing::Test {
 protected:
};

}  // namespace luxfield::render
