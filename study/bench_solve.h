// `luxfield bench solve`: how fast the Gram solve runs against the speed of memory.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace luxfield::study {

struct BenchSolveOptions {
  int grid_width = 23, grid_height = 15;  // bspline2: 345 images
  int size = 256;                         // square images
  int channels = 3;
  int repeats = 5;  // the median counts
};

// Rows [{"case", "wall_s", "gb_per_s", "copy_ratio"}, ...] for float, float data swept in double,
// and double. One solve reads every value once and writes it once: gb_per_s counts both, copy_ratio
// is its time over that of a copy of the same bytes by the same threads, taken alternately in the
// same run. Buffers are touched before the clock runs. Throws InputError if an option is below 1.
nlohmann::json BenchSolve(const BenchSolveOptions& options = {});

}  // namespace luxfield::study
