// The options of `render` and what follows from them, for what else renders (verb_shard.cc).
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/cli/verbs/png_options.h"
#include "luxfield/core/json.h"
#include "luxfield/render/renderer.h"
#include "luxfield/scene/motion_path.h"
#include "luxfield/scene/scene.h"

namespace luxfield::cli {

struct RenderVerbOptions {
  std::string scene, view, sequence, output, radiance_map, irradiance_map, display, device;
  PngOptions png;
  std::vector<std::string> light_fields, tables, knobs;
  std::optional<int> width, height, antialias;
  std::vector<double> scale;
  render::RenderOptions render;
  std::string shadows = render::ShadowsName(render::Shadows::kTraced);
  std::string error, time, reference, memory;  // "0.5%", "40ms", a picture, "2G"
  bool estimator_given = false, samples_given = false, approximation_given = false,
       shadow_map_given = false, resume = false;
};

void AddRenderOptions(CLI::App& verb, const std::shared_ptr<RenderVerbOptions>& options);

// What is lit and how.
struct RenderSetUp {
  RenderVerbOptions options;                 // with `render` complete
  scene::Scene scene;                        // as the options have it
  std::vector<scene::Placement> placements;  // of each frame of --sequence
};

// Reads the scene and its path. Throws InputError, for options that contradict each other or would
// not be read too.
RenderSetUp SetUpRender(RenderVerbOptions options, std::uint64_t seed);

// The files that the options name.
void WritePictures(const render::Frame& frame, const RenderVerbOptions& options);

// Prints what the frame is, and the same as JSON.
core::Json Describe(const render::Frame& frame, const RenderVerbOptions& options,
                    const std::string& device);

}  // namespace luxfield::cli
