// `luxfield bench nearfield`: what each estimator costs and how wrong it is on a resident G-buffer.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/render/accuracy/car2.h"

namespace luxfield::bench {

struct BenchNearfieldOptions {
  render::SyntheticCar2Options car2;
  int width = 1024, height = 768;
  std::vector<std::string> estimators;  // empty: all
  std::vector<int> samples_per_pixel{50, 200};
  int repeats = 3;               // the median counts
  int reference_pixels = 20000;  // random subset that errors are taken over, 0: all
  std::string device;            // as --device
  int threads = 0;               // of an OpenCL CPU device, 0: all
};

// Rows [{"scene", "estimator", "spp", "width", "height", "images", "channels", "threads",
// "build_core_s", "fps", "core_s", "device_s", "samples_per_s", "kernels", "rel_rmse", "mean_lab",
// "bias"}, ...]; spp is 0 for an estimator without samples. fps, core_s and device_s (the kernels'
// own time, by their events) time the lighting of the resident G-buffer after compilation;
// samples_per_s counts light samples by wall time; build_core_s is the CPU time of the tables. The
// reference is lightfield's closed form in double. Throws InputError, DeviceError.
nlohmann::json BenchNearfield(const BenchNearfieldOptions& options = {});

}  // namespace luxfield::bench
