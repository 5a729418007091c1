// Rays binned on both planes and fitted: the light field of least squares, and how well a lattice
// suits the rays.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "luxfield/formats/ray_file.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/ray_lines.h"

namespace luxfield::reconstruct {

struct RayTally {
  std::uint64_t rays = 0;
  double flux = 0;  // after scaling, in the file's unit
};

// The rays of every texel in the file's order; those outside the inner cells of F, where the basis
// functions sum to 1, and those outside the lattice on I are left out and counted.
struct RayBins {
  struct Hit {
    lightfield::Vec2 u;  // crossing of F
    double flux;         // as in the file
    std::size_t ray;
  };
  std::vector<std::size_t> first;  // of each texel, and the end
  std::vector<Hit> hits;
  RayTally missed_filter_plane, missed_image_plane, used;
};

// F at z = filter_z_m of the lines' frame. `scale` multiplies the flux in the tallies.
RayBins BinRays(std::span<const RayLine> lines, const lightfield::LuminaireGeometry& geometry,
                double filter_z_m, double scale);

// Least squares texel by texel, each scaled to its rays' flux (import_rays.h); sigma is the
// counting noise. Both have the geometry wanted; three channels need rays with tristimulus values.
void FitRays(const formats::RayFile& file, const RayBins& bins, double scale,
             const GramSolver& solver, lightfield::LightField& c, lightfield::LightField& sigma);

// Unbiased estimate of the integrated squared error of the fit's phase-space density, over position
// and slope (d^2u d^2m, s = u + delta m), less the part that no lattice changes (Rudemo, Scand. J.
// Statist. 9, 1982; Bowman, Biometrika 71, 1984). With K the kernel of the projection on the span,
//
//   V = sum_k flux_k^2 K(k, k)                the variance of the fit,
//   B = sum_(k != l) flux_k flux_l K(k, l)    an estimate of the squared norm of its expectation,
//   risk = delta^2 (share V - B)
//
// `share` of the luminaire's rays are in the bins, whose flux was multiplied by 1 / share.
double LatticeRisk(const RayBins& bins, const lightfield::LuminaireGeometry& geometry,
                   const GramSolver& solver, double share);

}  // namespace luxfield::reconstruct
