// A scene of ours for environment maps: three balls on a floor under the open sky.
#pragma once

#include "luxfield/scene/scene.h"

namespace luxfield::bench {

// A floor of 12 m x 12 m with a diffuse ball, one of rough gold and one of glossy plastic (Phong),
// 1 m wide, seen from some 5 m away: normals of all directions that a camera can see, places that
// see half of the sky and places that see little of it. No light.
scene::Scene BallScene(int width, int height);

}  // namespace luxfield::bench
