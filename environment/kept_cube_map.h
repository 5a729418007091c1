// The cube map of a picture that was resampled before, from the cache (core/cache.h).
#pragma once

#include <filesystem>
#include <optional>

#include "luxfield/environment/cube_map.h"
#include "luxfield/environment/environment_layouts.h"

namespace luxfield::environment {

// MakeCubeMap(ReadEnvironmentPicture(path, named), face_size), to the bit. Throws what these throw.
CubeMap KeptCubeMap(const std::filesystem::path& path, std::optional<EnvironmentLayout> named,
                    int face_size);

}  // namespace luxfield::environment
