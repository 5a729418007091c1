// What a geometry is, as a hash: of whatever files it was read from.
#pragma once

#include <string>

#include "luxfield/scene/geometry.h"

namespace luxfield::scene {

// SHA-256 of what pictures show of it: vertices, triangles, materials, texels; not of names.
std::string Sha256Of(const Geometry& geometry);

}  // namespace luxfield::scene
