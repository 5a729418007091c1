// `luxfield bench filters`: what a wrong print does to C, and what measuring it brings back.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace luxfield::bench {

struct BenchFiltersOptions {
  std::filesystem::path lab, plan;  // a basis or dual filter on either rig
  std::filesystem::path folder;     // scratch
  double registration = 0.01;       // of the print: its shift in spacings, along a diagonal
  double density = 0.02;            // relative error of its transmittance
  // Beside them a print always has: 0.1 degrees of rotation, 1 % of its tone curve's slope, and
  // grain of 0.5 % rms, a thirtieth of the spacing wide.
  int pixels = 512;  // side of the photographs of the filter
  std::uint64_t seed = 1;
};

// The lamp is the lab's own as far as the basis can hold it (the true light field, C >= 0), so that
// truth and reconstruction live in one space whatever the filter; traced with 12 nodes a filter's
// cell or the lab's own number, if that is more. Sessions with photon noise, read noise, dark
// current and PRNU, the same random numbers in each:
//   perfect print, ideal filter assumed        the noise floor
//   print with the errors, ideal filter        what not measuring costs
//   print with the errors, measured filter     photographs of the simulated bench -> MeasureFilter
// Rows: case, rel_rmse, rel_l2 of C against the truth, over_floor (rel_l2 over that of the floor),
// condition, noise_gain, solve; the last one also what the photographs found: shift_error_m of the
// print (of a pair the plus part's) and light_ratio.
nlohmann::json BenchFilters(const BenchFiltersOptions& options);

}  // namespace luxfield::bench
