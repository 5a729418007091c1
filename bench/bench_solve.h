// `luxfield bench solve`: how fast the Gram solve runs against the speed of memory.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace luxfield::bench {

struct BenchSolveOptions {
  int grid_width = 23, grid_height = 15;  // bspline2: 345 images
  int size = 256;                         // square images
  int channels = 3;
  int repeats = 5;          // the median counts
  bool float_only = false;  // only the first row
  double noise = 1e-3;  // of E for the non-negative solve, standard deviation over the largest E
};

// Rows [{"case", "wall_s", "gb_per_s", "copy_ratio"}, ...] for float, float data swept in double,
// and double. One solve reads every value once and writes it once: gb_per_s counts both, copy_ratio
// is its time over that of a copy of the same bytes by the same threads, taken alternately in the
// same run. Buffers are touched before the clock runs.
//
// One row more for the non-negative solve: of E = G C + noise with C >= 0 known (a spot per image
// over a dim ground, brightest in the middle of the grid). wall_s is from C_0 = G^-1 E to C >= 0,
// and beside it
//   iterations, kkt_residual   of the slowest block; the worst residual of the stopping rule
//                              (reconstruct/solve/non_negative.h), a certificate of optimality
//   signed_error, clamped_error, error   RMSE over RMS of C_0, max(C_0, 0) and the result
// Throws InputError if an option is below 1, or the noise negative.
nlohmann::json BenchSolve(const BenchSolveOptions& options = {});

}  // namespace luxfield::bench
