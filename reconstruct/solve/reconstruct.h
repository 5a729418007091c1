// Measurements -> light field (docs/theory.md 4).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measured_filter.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/solve/kept_moments.h"
#include "luxfield/reconstruct/solve/report.h"

namespace luxfield::reconstruct {

// What the solution of some rows of the image plane takes from all of them. With it the solution of
// the rows is, to the bit, these rows of the solution of all.
struct WholeFigures {
  std::optional<lightfield::EdgeLight> edges;  // absent: dual filters
  // Root mean square of sigma over the known texels of every position of all measurements; empty
  // where the ideal filters at their places need none.
  std::vector<double> position_noise;
};

enum class Precision { kFloat, kDouble };  // of the sweeps; E and C are float32 either way

struct ReconstructOptions {
  Precision precision = Precision::kFloat;
  bool non_negative = false;  // project on C >= 0, keeping every texel's flux
  // Nearest texel by texel (non_negative.h), or in what receivers see (irradiance_metric.h).
  NonNegativeMetric metric = NonNegativeMetric::kCoefficients;
  // The filter as it was measured; null: ideal filters.
  const lightfield::MeasuredFilter* filter = nullptr;
  // A system this close to a separable one (Frobenius norm, relative) is solved as separable: C is
  // off by about as much, in the worst mode by the condition number times it.
  double separable_tolerance = 1e-6;
  // Smoother C at the price of a bias that the report states (regularise.h).
  bool regularise = false;
  std::optional<double> lambda{};  // absent: the one of least estimated error
  // What the solution has of the measurements without projection, where the lamp lies inside the
  // grid and the filters can tell (kept_moments.h, edge_light.h); kNone: least squares alone.
  Keep keep = Keep::kMoments;
  // Of measurements that are rows of others; null: they are the whole. Rows cannot be projected by
  // irradiance nor regularised, which take sums over all texels.
  const WholeFigures* whole = nullptr;
};

struct Reconstruction {
  lightfield::LightField coefficients;  // C, W sr^-1 m^-4 (or lm, or relative)
  // Standard deviation of C, propagated from the measurements' sigma as independent between
  // positions: per pixel sum over mn of R^2 sigma_mn^2, R the map that made C of E. It belongs to
  // the least-squares solution also where C >= 0 was asked for, and knows nothing of a
  // regularisation's bias. Where positions were unknown it holds the variance of the prior as well
  // (reconstruct/solve/pixel_weights.h).
  lightfield::LightField sigma;
  // Measurements that were unknown, per texel [row][column]; where > 0 and too few are left, C is
  // the one of smallest norm among those that fit what is known; where all were unknown C = 0.
  std::vector<std::uint16_t> unknown_positions;
  // RowSquares (pixel_weights.h) of the least-squares solution: the sigma of texels of which nothing
  // is known follows from those of all rows.
  std::vector<double> row_squares;
  ReconstructionReport report;
};

// Of the whole of these measurements.
WholeFigures FindWholeFigures(std::span<const lightfield::Measurements> measurements,
                              const ReconstructOptions& options = {});

// `basis` filters at their places: the Gram solve, with the moments that are kept. `dual` filters
// at theirs: C_ij = E_ij / h^2 (docs/theory.md 3), no solve, and unknown values stay unknown.
// Measured filters, displaced positions, several measurements of one geometry or a regularisation:
// the forward model <Phi*_r, Phi_m> (filter_system.h), by its separable factors where it has them,
// in double. Throws InputError if the measurements do not fit their geometry, each other or the
// filter, or as GramSolver, FilterSystem, SolveIncomplete, SolveGeneral and Regularise do.
Reconstruction Reconstruct(std::span<const lightfield::Measurements> measurements,
                           const ReconstructOptions& options = {});
Reconstruction Reconstruct(const lightfield::Measurements& measurements,
                           const ReconstructOptions& options = {});

// SHA-256 of the files that a solution is made of.
struct SourceHashes {
  std::vector<std::string> measurements;  // in their order
  std::string filter;                     // empty: ideal filters
};

// Adds to the provenance of C and sigma, which is the measurements', what they were solved of and
// how.
void StateProvenance(const ReconstructOptions& options, const SourceHashes& sources,
                     Reconstruction* result);

}  // namespace luxfield::reconstruct
