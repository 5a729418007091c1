// A lamp over a floor with a box on it, for tests of whole pictures.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/scene/scene.h"

namespace luxfield::render {

// A soft beam, so that no few pixels hold all the noise.
inline lightfield::LightField SoftLamp() {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.1;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 4, 3, 0.02);
  geometry.lattice = {32, 32, -0.16, 0.16, 0.01, 0.01};
  lightfield::LightField field(geometry);
  for (int m = 0; m < geometry.grid.count(); ++m)
    for (int row = 0; row < 32; ++row)
      for (int column = 0; column < 32; ++column) {
        const auto s = geometry.lattice.centre(row, column);
        field.image(m, 0)[static_cast<std::size_t>(row) * 32 + column] =
            static_cast<float>((1 + m) * std::exp(-40 * (s.x * s.x + s.y * s.y)));
      }
  return field;
}

inline scene::Scene LampOverFloor(bool with_box = true) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / "luxfield_soft_lamp.lf.exr";
  lightfield::WriteLightField(file, SoftLamp());
  scene::Scene scene;
  scene.geometry.materials.emplace_back();
  scene::AppendQuad({-3, -1, 0}, {6, 0, 0}, {0, 8, 0}, 0, scene.geometry);
  if (with_box)
    scene::AppendBox(scene::Translation({0.2, 2.5, 0.2}) * scene::Scaling({0.4, 0.4, 0.4}), 0,
                     scene.geometry);
  scene.camera = scene::Camera::LookAt({-1, -1, 1.5}, {0, 2.5, 0.2}, {0, 0, 1}, 50, 40, 30);
  scene.luminaires.push_back(
      {"lamp", file, {}, scene::LookAt({0, 0, 0.6}, {0, 5, 0.3}, {0, 0, 1}), 1});
  return scene;
}

}  // namespace luxfield::render
