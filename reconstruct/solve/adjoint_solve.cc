#include "luxfield/reconstruct/solve/adjoint_solve.h"

#include <algorithm>
#include <map>

#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/kept_moments.h"
#include "luxfield/reconstruct/solve/missing_data.h"
#include "luxfield/reconstruct/solve/moment_constraint.h"

namespace luxfield::reconstruct {

using lightfield::Measurements;
using lightfield::Weights;

namespace {

// C = E / h^2 where it is known, else 0.
Weights DualWeights(const Measurements& measurements, const Weights& coefficient_weights) {
  const auto& geometry = measurements.geometry;
  const double per_h2 = 1 / (geometry.grid.spacing_m * geometry.grid.spacing_m);
  const std::size_t texels = geometry.plane_size(), values = texels * geometry.channels;
  Weights weights(coefficient_weights.size());
  for (std::size_t k = 0; k < weights.size(); ++k)
    if (!(measurements.positions[k / values].mask[k % texels] & lightfield::kUnknownMask))
      weights[k] = per_h2 * coefficient_weights[k];
  return weights;
}

}  // namespace

Weights AdjointSolve(const Measurements& measurements, const Weights& coefficient_weights,
                     const FilterSystem* system, Keep keep) {
  if (measurements.filter == lightfield::FilterKind::kDual && !system)
    return DualWeights(measurements, coefficient_weights);
  const auto& geometry = measurements.geometry;
  const std::size_t texels = geometry.plane_size(), values = texels * geometry.channels;
  const int images = geometry.grid.count();
  const KeptMoments kept =
      MomentsToKeep(geometry.grid, keep, FindEdgeLight(std::span(&measurements, 1)));
  const GramSolver solver(geometry.grid, kept);
  Weights weights(coefficient_weights.size());
  std::vector<const double*> in;
  std::vector<double*> out;
  for (int m = 0; m < images; ++m) {
    in.push_back(coefficient_weights.data() + static_cast<std::size_t>(m) * values);
    out.push_back(weights.data() + static_cast<std::size_t>(m) * values);
  }
  if (!system) solver.SolveTransposed(in.data(), out.data(), values);

  // The others by their own matrix, one per set of known positions.
  std::map<std::vector<bool>, std::vector<std::size_t>> dense;
  for (std::size_t p = 0; p < texels; ++p) {
    std::vector<bool> known(static_cast<std::size_t>(images));
    bool complete = true;
    for (int m = 0; m < images; ++m) {
      known[m] = !(measurements.positions[m].mask[p] & lightfield::kUnknownMask);
      complete &= known[m];
    }
    if (!complete || system) dense[known].push_back(p);
  }
  MomentConstraint constraint;
  if (system) constraint = ConstrainMoments(*system, geometry.grid, kept);
  const std::vector<double> a = system ? system->Dense() : std::vector<double>{};
  for (const auto& [known, pixels] : dense) {
    PixelWeights inverse = system ? MinimumNorm(a, images, known)
                                  : MinimumNormWeights(GramSystem(solver), known).Dense();
    if (system && std::find(known.begin(), known.end(), false) == known.end())
      inverse.weights = constraint.Map(inverse.weights);
    const std::size_t columns = inverse.known.size();
    for (const std::size_t p : pixels)
      for (int channel = 0; channel < geometry.channels; ++channel) {
        const std::size_t at = channel * texels + p;
        for (int m = 0; m < images; ++m) out[m][at] = 0;
        for (std::size_t k = 0; k < columns; ++k) {
          double sum = 0;
          for (int m = 0; m < images; ++m) sum += inverse.weights[m * columns + k] * in[m][at];
          out[inverse.known[k]][at] = sum;
        }
      }
  }
  return weights;
}

}  // namespace luxfield::reconstruct
