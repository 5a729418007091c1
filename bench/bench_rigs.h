// `luxfield bench rigs`: the noise of C and of radiance behind single filters against dual ones.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

namespace luxfield::bench {

struct BenchRigsOptions {
  int grid_width = 11, grid_height = 9;
  int size = 128;  // square images: every texel is one draw
  std::uint64_t seed = 1;
};

// Two rigs of equal spacing h that see light of the same radiance everywhere on F, with the same
// number of captures of the same exposure: `single`, bspline2 prints scaled to full transmittance,
// taken twice and averaged; `dual`, quadratic (a = 1/2), the two halves of every dual function
// (docs/theory.md 3, "Filters"). Noise `read` is the same in every capture, sigma 1; noise `shot`
// has the capture's irradiance, in units of h^2 times the radiance, as variance. Rows
//   noise, rig
//   sigma_c      root mean square of the sigma that Reconstruct states, in units of 1 / h^2
//   spread_c     the same of C - truth over all texels: sigma_c is right where they agree
//   spread_l     root mean square error of sum C Phi at random places of interior cells
//   c_ratio, l_ratio    of `single`: its spreads over those of `dual`
// Throws InputError if the grid has no interior cell or the size is below 1.
nlohmann::json BenchRigs(const BenchRigsOptions& options = {});

}  // namespace luxfield::bench
