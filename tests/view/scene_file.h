// A scene of a lamp, a floor and a box as files.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "luxfield/lightfield/light_field.h"
#include "tests/render/small_scene.h"

namespace luxfield::view {

constexpr char kSceneText[] = R"(# A lamp over a floor.
[camera]
position = [-1, -1, 1.5]
look_at = [0, 2.5, 0.2]
vertical_fov_deg = 50
width = 160
height = 120

[[material]]
name = "grey"
albedo = [0.5, 0.4, 0.3]

[[quad]]
corner = [-3, -1, 0]
edge_u = [6, 0, 0]
edge_v = [0, 8, 0]
material = "grey"

[[box]]
size = [0.4, 0.4, 0.4]
position = [0.2, 2.5, 0.2]
material = "grey"

[[luminaire]]
name = "lamp"
file = "lamp.lf.exr"  # beside this file
position = [0, 0, 0.6]
look_at = [0, 5, 0.3]
)";

// scene.toml and lamp.lf.exr in `folder`; its lamp's unit is lm. Returns the scene's path.
inline std::filesystem::path WriteSceneFile(const std::filesystem::path& folder) {
  lightfield::LightField lamp = render::SoftLamp();
  lamp.geometry.unit = lightfield::FluxUnit::kLumen;
  for (float& value : lamp.data) value *= 1e5f;
  lightfield::WriteLightField(folder / "lamp.lf.exr", lamp);
  std::ofstream(folder / "scene.toml") << kSceneText;
  return folder / "scene.toml";
}

}  // namespace luxfield::view
