// Lines binned on both planes and fitted: the light field of least squares, and how well a lattice
// suits the lines.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/ray_lines.h"

namespace luxfield::reconstruct {

struct RayTally {
  std::uint64_t rays = 0;
  double flux = 0;  // after scaling, in the file's unit

  void Add(const RayTally& more) {
    rays += more.rays;
    flux += more.flux;
  }
};

// The lines of every texel in their order; those outside the inner cells of F, where the basis
// functions sum to 1, and those outside the lattice on I are left out and counted.
struct RayBins {
  struct Hit {
    lightfield::Vec2 u;  // crossing of F
    double flux;         // as in the file
    std::array<double, 3> xyz;
  };
  struct Texel {
    std::size_t texel, begin, end;  // of its hits
  };
  std::vector<Texel> texels;  // that have hits, upwards
  std::vector<Hit> hits;
  RayTally missed_filter_plane, missed_image_plane, used;
};

// F at z = filter_z_m of the lines' frame. `scale` multiplies the flux in the tallies.
RayBins BinRays(std::span<const RayLine> lines, const lightfield::LuminaireGeometry& geometry,
                double filter_z_m, double scale);

// Least squares texel by texel, each scaled to its rays' flux (import_rays.h), of lines that come
// in blocks: their sums E_ij and, for sigma, sums of squares (8 bytes each, for every coefficient)
// are all that is kept. Every texel adds its lines in their order, so that the result does not
// depend on the blocks.
class RayFit {
 public:
  struct Options {
    double filter_z_m = 0, scale = 1;
    bool sigma = true;          // the counting noise too
    std::size_t block = 65536;  // lines
  };

  RayFit(const lightfield::LuminaireGeometry& geometry, const GramSolver& solver,
         const Options& options);
  void Add(const RayLine& line);
  void AddBlock();  // those that have come since the last block; behind the last line

  const RayTally& missed_filter_plane() const { return missed_filter_plane_; }
  const RayTally& missed_image_plane() const { return missed_image_plane_; }
  const RayTally& used() const { return used_; }

  lightfield::LightField Solution() const;
  lightfield::LightField Sigma() const;

 private:
  void AddTexel(const RayBins& bins, const RayBins::Texel& texel);
  double Correction(std::size_t texel) const;

  lightfield::LuminaireGeometry geometry_;
  const GramSolver& solver_;
  Options options_;
  std::vector<double> gain_u_, gain_v_;  // flux of the fit of one ray of flux 1
  std::vector<RayLine> waiting_;
  std::vector<double> sums_, squares_;         // texel, channel, basis function
  std::vector<double> flux_in_, flux_fitted_;  // of each texel
  RayTally missed_filter_plane_, missed_image_plane_, used_;
};

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
