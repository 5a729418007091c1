#include "luxfield/view/lighting/load_scene.h"

#include <algorithm>

#include "luxfield/core/config.h"
#include "luxfield/core/error.h"
#include "luxfield/scene/named_view.h"
#include "luxfield/view/lighting/measured_lamps.h"
#include "luxfield/view/lighting/stage.h"

namespace luxfield::view {
namespace {

constexpr int kStageWidth = 1024, kStageHeight = 768;

// That the scene names.
void AddMeshes(const std::filesystem::path& scene_file, std::vector<std::filesystem::path>& files) {
  try {
    const core::Config config = core::Config::FromFile(scene_file);
    for (const core::Config& mesh : config.Tables("mesh")) files.push_back(mesh.Path("file"));
  } catch (const InputError&) {
    // Another file by now, which its reader says what is wrong with.
  }
}

}  // namespace

scene::Scene LoadScene(const SceneOptions& options, SceneKind kind) {
  if (kind == SceneKind::kStage && !options.view.empty())
    throw InputError("--view is of a scene.toml, and a light field has no views; drop it");
  if (kind == SceneKind::kStage)
    return Stage(options.file, kFirstScreen_m, options.width.value_or(kStageWidth),
                 options.height.value_or(kStageHeight));
  scene::SceneOverrides overrides;
  overrides.width = options.width;
  overrides.height = options.height;
  scene::Scene scene = scene::ReadScene(options.file, overrides);
  if (!options.view.empty())
    scene.camera = scene::ReadNamedView(options.file, options.view, scene.camera);
  return scene;
}

LitRequest RequestOf(const scene::Scene& scene, const SceneOptions& options) {
  LitRequest request;
  request.camera = scene.camera;
  for (const auto& luminaire : scene.luminaires)
    request.lamps.push_back({luminaire.world_from_luminaire, luminaire.scale, luminaire.colour});
  for (const auto& light : scene.classical_lights)
    request.classical_lights.push_back({light.world_from_light, light.scale, light.colour});
  request.error = options.error;
  request.shadows = options.shadows;
  request.seed = options.seed;
  return request;
}

std::vector<std::filesystem::path> FilesOf(const scene::Scene& scene) {
  std::vector<std::filesystem::path> files;
  for (const scene::Luminaire& lamp : scene.luminaires)
    files.insert(files.end(), {lamp.light_field, SigmaBeside(lamp.light_field)});
  for (const scene::ClassicalLight& light : scene.classical_lights)
    files.push_back(light.distribution);
  if (scene.environment) files.push_back(scene.environment->file);
  for (const scene::Texture& texture : scene.geometry.textures) files.emplace_back(texture.name);
  if (!scene.file.empty()) {
    files.push_back(scene.file);
    AddMeshes(scene.file, files);
  }
  std::ranges::sort(files);
  const auto again = std::ranges::unique(files);
  files.erase(again.begin(), again.end());
  return files;
}

}  // namespace luxfield::view
