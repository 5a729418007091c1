// luxfield info of environment maps.
#pragma once

#include <string>

#include "luxfield/core/json.h"

namespace luxfield::cli {

// Prints layout, size, mean radiance, irradiance of surfaces that face up and down, and the
// brightest pixel. `layout` is a name of environment/environment_layouts.h, or empty where the file
// tells it.
core::Json InfoEnvironment(const std::string& path, const std::string& layout);

// The same of a folder or list of frames: their number, size and light, and how fast they stream.
core::Json InfoEnvironmentSequence(const std::string& path, const std::string& layout);

}  // namespace luxfield::cli
