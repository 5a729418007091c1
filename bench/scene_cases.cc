#include "luxfield/bench/scene_cases.h"

#include <algorithm>

namespace luxfield::bench {

std::vector<SceneCase> CasesOf(const scene::Scene& scene) {
  const auto& materials = scene.geometry.materials;
  const bool is_glossy = std::any_of(materials.begin(), materials.end(), scene::IsGlossy);
  std::vector<SceneCase> cases;
  for (const bool shadows : {false, true}) {
    cases.push_back({shadows, false});
    if (is_glossy) cases.push_back({shadows, true});
  }
  return cases;
}

scene::Scene SceneOf(scene::Scene scene, const SceneCase& c) {
  if (!c.glossy) scene::MakeLambertian(scene.geometry);
  return scene;
}

}  // namespace luxfield::bench
