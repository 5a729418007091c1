// What is to be lit: a scene's file, or a light field on a stage.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/view/lighting/lit_view.h"

namespace luxfield::view {

struct SceneOptions {
  std::filesystem::path file;
  std::optional<int> width, height;  // of the picture instead of the scene's
  std::string view = {};             // a [[view]] of the scene; empty: its camera
  double error = 0.005;
  bool shadows = true;
  std::string device;
  int threads = 0;
  std::uint64_t seed = 1;
};

enum class SceneKind { kScene, kStage };

// scene.toml, or the stage of view/lighting/stage.h with the light field. Throws InputError.
scene::Scene LoadScene(const SceneOptions& options, SceneKind kind);

// Camera and lamps as the scene has them, lit as the options say.
LitRequest RequestOf(const scene::Scene& scene, const SceneOptions& options);

// The files that a scene is read and lit from: its own, those of lamps with what is known of their noise
// beside them, of classical lights, meshes and the environment, and textures; each once, whether it is
// there or not.
std::vector<std::filesystem::path> FilesOf(const scene::Scene& scene);

}  // namespace luxfield::view
