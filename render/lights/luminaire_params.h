// What kernels need to know of a luminaire. Internal to estimators/.
#pragma once

#include "luxfield/lightfield/light_field.h"
#include "luxfield/render/kernels/luminaire/luminaire_types.clh"
#include "luxfield/scene/transform.h"

namespace luxfield::render {

LuminaireParams MakeLuminaireParams(const lightfield::LuminaireGeometry& geometry, int row_stride,
                                    const scene::Pose& world_from_luminaire);

}  // namespace luxfield::render
