// Measurements -> light field (THEORY.md 4).
#pragma once

#include <cstdint>
#include <vector>

#include "lightfield/light_field.h"
#include "lightfield/measurements.h"
#include "reconstruct/report.h"

namespace luxfield::reconstruct {

enum class Precision { kFloat, kDouble };  // of the sweeps; E and C are float32 either way

struct ReconstructOptions {
  Precision precision = Precision::kFloat;
  bool non_negative = false;  // project on C >= 0, keeping every texel's flux (non_negative.h)
};

struct Reconstruction {
  lightfield::LightField coefficients;  // C, W sr^-1 m^-4 (or lm, or relative)
  // Standard deviation of C, propagated from the measurements' sigma as independent between
  // positions: per pixel sum over mn of (G^-1)^2 sigma_mn^2. It belongs to the least-squares
  // solution also where C >= 0 was asked for.
  lightfield::LightField sigma;
  // Filter positions that were unknown, per texel [row][column]; where > 0, C is the one of
  // smallest norm among those that fit what is known (reconstruct/missing_data.h), and where all
  // were unknown C = 0 and sigma = 0 say nothing.
  std::vector<std::uint16_t> unknown_positions;
  ReconstructionReport report;
};

// `basis` filters: the Gram solve. `dual` filters: C_ij = E_ij / h^2 (THEORY.md 3), no solve, and
// unknown values stay unknown. Throws InputError if the measurements do not fit their geometry, or
// as GramSolver and SolveIncomplete do.
Reconstruction Reconstruct(const lightfield::Measurements& measurements,
                           const ReconstructOptions& options = {});

}  // namespace luxfield::reconstruct
