// The ways in which benches light a scene: shadows off and on, surfaces Lambertian and as they are.
#pragma once

#include <vector>

#include "luxfield/scene/scene.h"

namespace luxfield::bench {

struct SceneCase {
  bool shadows = false;
  bool glossy = false;  // as the scene is; else with all materials Lambertian
};

// All four; the two Lambertian ones of a scene without glossy materials.
std::vector<SceneCase> CasesOf(const scene::Scene& scene);

// The scene with the surfaces of the case.
scene::Scene SceneOf(scene::Scene scene, const SceneCase& c);

}  // namespace luxfield::bench
