// `luxfield bench plan`: are plans for a target as accurate and as long as they were predicted?
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace luxfield::bench {

struct BenchPlanOptions {
  std::filesystem::path lab = "data/labs/motorcycle.toml", plan = "data/plans/bike.toml",
                        scene = "data/scenes/garage.toml";
  std::filesystem::path folder;  // scratch
  std::vector<double> targets = {0.08, 0.04, 0.02, 0.01};
  int runs = 3;  // captures of each
  int texels = 128, receivers = 600;
  std::uint64_t seed = 1;
};

// For every target the fastest confirmed plan, captured on the simulated lab with other random
// numbers each time, merged, reconstructed, and its picture's irradiance held against the lamp's
// own by quadrature, on receivers that the search did not see. Two rows each: `noise`, with photon
// noise, read noise, dark current and PRNU alone (and rounding), and `all`, with every error of the
// lab, which the prediction leaves out:
//   target, sources, family, positions, spacing_mm, runs
//   truncation, noise, predicted   relative errors (CapturePlanner)
//   observed                       RMS over runs
//   ratio, ratio_se                observed / predicted, and its standard error from the scatter of
//                                  the runs (0 for one run); both on the same receivers
//   picture_se                     of `predicted`, as an estimate of the whole picture's error
//   retaken                        frames that were taken again or flagged, all runs together
//   capture_s, rig_s, time_ratio   predicted and on the rig's clock, the mean over runs
// and a last row `search` with plans, truth_error, samples_error, wall_s. A target that no plan
// meets has the most accurate plan's row. Throws what CapturePlanner throws.
nlohmann::json BenchPlan(const BenchPlanOptions& options);

}  // namespace luxfield::bench
