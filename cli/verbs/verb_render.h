// The options of `render`, for what else runs it (verb_shard.cc).
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/render/lights/shadow_maps.h"
#include "luxfield/render/renderer.h"
#include "luxfield/scene/scene.h"

namespace luxfield::cli {

struct RenderVerbOptions {
  std::string scene, output, png, radiance_map, irradiance_map, display, device;
  std::vector<std::string> light_fields, tables, knobs;
  std::optional<double> exposure;
  std::optional<int> width, height;
  std::vector<double> scale;
  render::RenderOptions render;
  std::string shadows = render::ShadowsName(render::Shadows::kTraced);
  std::string error, time, reference;  // "0.5%", "40ms", a picture
  bool estimator_given = false, samples_given = false, approximation_given = false,
       shadow_map_given = false;
};

void AddRenderOptions(CLI::App& verb, const std::shared_ptr<RenderVerbOptions>& options);

// What they change of the scene, and how it is lit. Throw InputError.
scene::SceneOverrides OverridesOf(const RenderVerbOptions& options);
render::RenderOptions HowToRender(const RenderVerbOptions& options, std::uint64_t seed);

// Throws InputError where a light field of the scene is absent, and for options that the picture
// would not depend on.
void RequireRenderable(const RenderVerbOptions& options, const scene::Scene& scene);

}  // namespace luxfield::cli
