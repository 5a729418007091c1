// The [[view]] tables of a scene.toml (docs/formats/scene.md): places to look from, by name.
#pragma once

#include <filesystem>
#include <string>

#include "luxfield/scene/scene.h"

namespace luxfield::scene {

// The view of that name of a scene that ReadScene reads, with as many pixels as `camera`, which is the
// scene's. Throws InputError that names the views there are.
Camera ReadNamedView(const std::filesystem::path& scene, const std::string& name,
                     const Camera& camera);

}  // namespace luxfield::scene
