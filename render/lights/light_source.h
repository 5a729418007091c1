// A light on a device, of whatever kind: what estimators light with.
#pragma once

#include <functional>
#include <variant>

#include "luxfield/render/lights/area_light.h"
#include "luxfield/render/lights/classical_light.h"
#include "luxfield/render/lights/environment_light.h"
#include "luxfield/render/lights/luminaire_on_device.h"
#include "luxfield/scene/transform.h"

namespace luxfield::render {

struct PosedLuminaire {
  const LuminaireOnDevice& luminaire;
  scene::Pose world_from_luminaire{};
};

// It refers to the light, which has to outlive it.
using LightSource = std::variant<PosedLuminaire, std::reference_wrapper<const AreaLightSource>,
                                 std::reference_wrapper<const ClassicalLightSource>,
                                 std::reference_wrapper<const EnvironmentLight>>;

}  // namespace luxfield::render
