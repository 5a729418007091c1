#include "luxfield/view/lighting/load_scene.h"

#include "luxfield/core/error.h"
#include "luxfield/scene/named_view.h"
#include "luxfield/view/lighting/stage.h"

namespace luxfield::view {
namespace {

constexpr int kStageWidth = 1024, kStageHeight = 768;

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

}  // namespace luxfield::view
