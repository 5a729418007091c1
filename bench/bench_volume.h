// `luxfield bench volume`: whether light-vector volumes keep the error they state, at receivers of
// every kind.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace luxfield::bench {

struct BenchVolumeOptions {
  int receivers = 100;  // of each kind
  double max_rel_error = 2e-3;
  std::uint64_t seed = 1;
  std::string device;  // as --device
  int threads = 0;     // of an OpenCL CPU device, 0: all
};

// Four bases, three grids (the first of images of one texel) and images of six lamps
// (planning/reference_lamps.h; but the filament, which they do not resolve). Each lights receivers
// of four kinds: in front of I; with the horizon through the supports, anywhere; between the planes
// or on I; just before F. The volume is made for some, and the device lights others by `volume`.
//
// Rows [{"basis", "grid", "lamp", "nodes", "met", "stated", "receivers", "rel_rmse", "table",
// "cuts", "cut", "between", "worst", "off", "lost"}, ...]: the volume's nodes, whether it met the
// error asked for in its bytes, and the relative RMSE that it states; receivers that see light, and
// the RMSE over the mean of the closed form in double: over all of them, over those that the table
// lights, over the `cuts` whose horizon cuts, over those between the planes. Of receivers that are
// not the table's, the largest error over |J|; and of those that it reaches with a hundredth of
// itself, how many are off by more than 5 %, and how many are dark. Throws InputError, DeviceError.
nlohmann::json BenchVolume(const BenchVolumeOptions& options = {});

}  // namespace luxfield::bench
