// `luxfield bench errors`: does the propagated sigma tell the random error of C, and what does each
// systematic source do?
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchErrorsOptions {
  std::filesystem::path lab, plan;  // a lab whose [errors.*] tables state the sizes
  std::filesystem::path folder;     // scratch; sessions are deleted as they are used up
  int seeds = 20;
  std::uint64_t seed = 1;
  bool random_only = false;  // leaves out all rows but `random`
};

// Rows: `random`, one session per seed with photon noise, read noise, dark current, PRNU and
// quantisation alone; `realistic`, one session per seed with every source on; then one session per
// systematic source alone (quantisation stays).
//   case, seeds
//   rel_rmse (RMSE / mean), rel_l2 (RMSE / RMS)   of the flux density of all rays, against the lamp
//                                     itself (traced_lamp.h); RMS over the seeds
//   floor_rel_rmse, floor_rel_l2      the same of the lamp's projection onto the plan's filters
//   projection_rel_rmse, projection_rel_l2   of C against that projection
//   flux_error                        against the lamp's, relative; the mean over the seeds
// and over seeds
//   sigma_ratio = sqrt( mean of (C - mean over seeds of C)^2 n/(n-1) / mean of sigma^2 )
// over all seeds and coefficients, sigma_ratio_q1 .. q4 the same over the quarters of the
// coefficients in order of their true size, dark to bright: 1 means that sigma is right.
nlohmann::json BenchErrors(const BenchErrorsOptions& options);

}  // namespace luxfield::bench
