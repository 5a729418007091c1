// `luxfield bench signed`: what negative coefficients do to pictures, and what cutting them off
// does.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/planning/reference_lamps.h"

namespace luxfield::bench {

struct BenchSignedOptions {
  std::vector<lightfield::BasisKind> bases{
      lightfield::BasisKind::kBox, lightfield::BasisKind::kBilinear,
      lightfield::BasisKind::kQuadratic, lightfield::BasisKind::kBspline2};
  std::vector<int> grids{7, 9, 11};  // basis functions along each axis, at least 5
  std::vector<planning::ReferenceLampKind> lamps{
      planning::ReferenceLampKind::kDisc,      planning::ReferenceLampKind::kFilament,
      planning::ReferenceLampKind::kRing,      planning::ReferenceLampKind::kGaussian,
      planning::ReferenceLampKind::kHeadlight, planning::ReferenceLampKind::kFaceted};
  int size = 40;               // texels of an image along each axis
  int receivers = 100;         // surface points, ReferenceReceivers
  int samples_per_pixel = 64;  // of the samplers
  int seeds = 16;              // pictures that noise and z-tests are taken over, at least 4
  std::uint64_t seed = 1;
  std::string device;  // as --device
  int threads = 0;     // of an OpenCL CPU device, 0: all
};

// One row per basis, grid and lamp. The lamp, 48 mm of radius, lies inside the grid's interior
// cells; `signed` is its projection on the grid, and what that becomes when it is made non-negative
// (reconstruct/solve/non_negative.h) is compared with it. Errors are RMS over the receivers, over
// the mean irradiance of the lamp itself:
//
//   negative_share     sum of |C < 0| over sum of C > 0 of the projection
//   signed_error, non_negative_error    irradiance in closed form against the lamp's
//   signed_noise, non_negative_noise    of `cells`, one picture against the closed form
//   windowed_noise     of `windowed` on the signed one
//   cells_t2, windowed_t2    mean squared z of the receivers' means over the seeds, signed;
//                      expected (seeds - 1) / (seeds - 3)
//   cells_z            sum of all those errors, in its standard errors
//
// Throws InputError for numbers out of range, DeviceError.
nlohmann::json BenchSigned(const BenchSignedOptions& options = {});

}  // namespace luxfield::bench
