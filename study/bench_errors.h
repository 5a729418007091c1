// `luxfield bench errors`: does the propagated sigma tell the random error of C, and what does each
// systematic source do?
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::study {

struct BenchErrorsOptions {
  std::filesystem::path lab, plan;  // a lab whose [errors.*] tables state the sizes
  std::filesystem::path folder;     // scratch; sessions are deleted as they are used up
  int seeds = 20;
  std::uint64_t seed = 1;
};

// One session per seed with the random sources alone (photon noise, read noise, dark current, PRNU,
// quantisation), then one per systematic source alone (all others off, quantisation on). Rows:
//   case, seeds, rel_rmse (of C against the truth), sigma_ratio
// sigma_ratio, on the row "random": sqrt( mean over seeds and coefficients of (C - mean_seeds C)^2
// n/(n-1) / mean sigma^2 ); 1 means that sigma is right. The same ratio over the texels of each
// quartile of sigma is in sigma_ratio_quartiles.
nlohmann::json BenchErrors(const BenchErrorsOptions& options);

}  // namespace luxfield::study
