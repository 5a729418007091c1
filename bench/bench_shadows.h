// `luxfield bench shadows`: what each kind of visibility costs and how far it is from tracing a ray
// to every light sample.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/bench/bench_nearfield.h"
#include "luxfield/core/image.h"

namespace luxfield::bench {

struct BenchShadowsOptions {
  // Like the thesis' car1: 5 x 5 images, which makes 49 cells.
  render::SyntheticCar2Options lamp{.grid_width = 5, .grid_height = 5};
  int width = 256, height = 192;
  int reference_samples = 4096;  // per pixel, traced, in two independent halves
  std::vector<int> samples_per_pixel{16, 50, 200};
  std::vector<int> map_sizes{96, 192, 384};
  // exact, and what is compared with it.
  std::vector<std::string> estimators{"exact", "windowed"};
  std::string pictures;  // a folder for pictures and Lab differences as PNG; empty: none
  std::string device;    // as --device
  int threads = 0;       // of an OpenCL CPU device, 0: all
};

// The lamp lights bench/occluder_scene.h. Rows [{"variant", "maps", "map_size", "spp", "mean_lab", "rel_rmse",
// "bias", "core_s", "build_core_s"}, ...] of the irradiance against the reference, by the unbiased
// `windowed`. The row `reference` states the error of the reference itself: half of the difference
// of its halves. core_s is the CPU time of lighting the resident G-buffer, build_core_s that of
// casting the maps, both after compilation. Throws InputError, DeviceError.
nlohmann::json BenchShadows(const BenchShadowsOptions& options = {});

}  // namespace luxfield::bench
