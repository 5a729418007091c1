// `luxfield bench keep`: what the solve makes of lamps that no basis holds, with and without the
// moments that it keeps, against the lamps themselves.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchKeepOptions {
  std::vector<std::string> bases{"box", "bilinear", "quadratic", "bspline2"};
  // Interior cells over 2.4 radii of the lamp, which lies a little beside their middle.
  std::vector<int> cells{6, 9, 14};
  std::vector<std::string> lamps;  // empty: all of ReferenceLamps
  int texels = 40;                 // of a side of the lattice, which is three times as wide
  int receivers = 60;              // ReferenceReceivers
  bool irradiance_metric = false;  // rows of it, where moments are kept
  std::uint64_t seed = 1;
};

// Rows: basis, cells, lamp, keep ("none", "flux", "moments"), solve ("signed", "clamped",
// "non_negative", "non_negative_irradiance"), and
//   flux_error          of the flux through all texels, relative: sum C over the lamp's own
//   irradiance_error    root mean square over the receivers of the error over that of the lamp's
//                       irradiance, each times z^2
//   negative            sum of |C < 0| over sum of C > 0
//   edge_reached        light in the ramps of the grid: nothing is kept across it
//   damage_undone       of "non_negative_irradiance": share of the damage of "non_negative"
//                       (undone_damage.h), absent where there is none
//   damage_undone_low, damage_undone_high    its interval of 90 % over sets of such receivers
//   iterations, unconverged, wall_s    of "non_negative_irradiance", wall_s of the whole solve
// The lamp is measured by ideal filters without noise; the truth is its own integral
// (reference_lamps.h). `clamped` is max(C, 0) of the signed solution. What the lattice on I costs
// is in all of them. Throws InputError for names that it does not know.
nlohmann::json BenchKeep(const BenchKeepOptions& options = {});

}  // namespace luxfield::bench
