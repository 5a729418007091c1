// `luxfield bench error-runs`: one picture of an error asked for, again and again, as users start it
// on a busy machine. Is the same estimator chosen, and what does it cost where another one is?
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/core/image.h"

namespace luxfield::bench {

struct ErrorRunsOptions {
  std::filesystem::path scene;
  std::string error = "3%";      // asked for, as of `luxfield render`, with traced shadows
  int runs = 20;                 // of the seeds seed, seed + 1 ..; at least 2
  int load = 4;                  // threads that compute something else meanwhile
  std::uint64_t seed = 1;        // of the first run
  int width = 0, height = 0;     // pixels; 0: the scene's
  std::filesystem::path folder;  // scratch
  std::string device;            // as --device
  int threads = 0;               // of an OpenCL CPU device, 0: all
};

// Rows [{"run", "estimator", "spp", "wall_s", "core_s" (of the process), "estimated", "reached"}].
// `estimated` is the relative RMSE that the run states of itself, `reached` what its picture shows
// (ErrorsAmong). A run before them fills the caches. Throws InputError, DeviceError.
nlohmann::json BenchErrorRuns(const ErrorRunsOptions& options);

// {"runs", "estimators" (name -> runs), "flips", "flip_ratio", "core_s", "wall_s" (medians),
// "worst_core_s", "worst_reached"} of such rows: flips are runs of another estimator than most
// have, flip_ratio is the largest median of core-seconds of an estimator over the least, 1 without
// flips.
nlohmann::json ErrorRunsSummary(const nlohmann::json& rows);

// Relative RMSE of each of n independent pictures x_k of one expectation,
//
//   e_k^2 = mean (x_k - m_k)^2 (n - 1) / n / m^2,   m_k the mean of the others, m of all pixels,
//
// which is right in the mean where all are equally noisy; the noise of the others, a share
// 1 / (n - 1) of theirs, is in it otherwise. What all err in alike, as a bias, is not.
std::vector<double> ErrorsAmong(const std::vector<core::Image>& pictures);

}  // namespace luxfield::bench
