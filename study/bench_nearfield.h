// `luxfield bench nearfield`: what each estimator costs and how wrong it is on a resident G-buffer.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "lightfield/light_field.h"
#include "render/gbuffer.h"

namespace luxfield::study {

// A headlight like the thesis' car2: 11 x 9 images 256^2 at a spacing of 16.5 mm, delta 0.3 m,
// image plane 0.6 m wide; a low beam with a cut-off, a hot spot, facets and a floor, six decades.
// Synthetic, ours.
struct SyntheticCar2Options {
  int grid_width = 11, grid_height = 9;
  int size = 256;    // square images
  int channels = 1;  // 3: chips of slightly different white
};
lightfield::LightField SyntheticCar2(const SyntheticCar2Options& options = {});

// What a camera beside the headlight sees, analytically: road, wall at 10 m, spheres and a box from
// 0.5 m on.
render::GBuffer RoadGBuffer(const render::Device& device, int width, int height);

struct BenchNearfieldOptions {
  SyntheticCar2Options car2;
  int width = 1024, height = 768;
  std::vector<std::string> estimators;  // empty: all
  std::vector<int> samples_per_pixel{50, 200};
  int repeats = 3;               // the median counts
  int reference_pixels = 20000;  // random subset that errors are taken over, 0: all
  std::string device;            // as --device
  int threads = 0;               // of an OpenCL CPU device, 0: all
};

// Rows [{"scene", "estimator", "spp", "width", "height", "images", "channels", "threads",
// "build_core_s", "fps", "core_s", "rel_rmse", "mean_lab", "bias"}, ...]; spp is 0 for an estimator
// without samples. fps and core_s time the lighting of the resident G-buffer after compilation;
// build_core_s is the CPU time of the tables. The reference is lightfield's closed form in double.
// Throws InputError, DeviceError.
nlohmann::json BenchNearfield(const BenchNearfieldOptions& options = {});

}  // namespace luxfield::study
