// A day of frames through the renderer: the part "sequence" of `luxfield bench environment`.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "luxfield/bench/bench_environment.h"
#include "luxfield/render/device/device.h"

namespace luxfield::bench {

// The three balls (bench/ball_scene.h), Lambertian, under each frame of options.sequence as
// `luxfield render` takes them, without files; samples are options.samples_per_pixel.front(). Rows
// without and with traced shadows: "frames", "spp", "shadows", "fps" of everything, "next_ms", of
// waiting for the reader, upload and tables, "render_ms", and the process' largest resident set in
// the first and in the second half of the frames, "first_half_mib" and "second_half_mib". Throws
// InputError as LitScene.
nlohmann::json SequenceRows(const render::Device& device, const BenchEnvironmentOptions& options);

}  // namespace luxfield::bench
