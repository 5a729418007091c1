#include "luxfield/reconstruct/solve/kept_moments.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/core/error.h"

namespace luxfield::reconstruct {

using lightfield::Basis;
using lightfield::BasisKind;

Keep KeepFromName(const std::string& name) {
  for (const Keep keep : {Keep::kNone, Keep::kFlux, Keep::kMoments})
    if (name == KeepName(keep)) return keep;
  throw InputError(fmt::format("--keep '{}' is not known; give moments, flux or none", name));
}

std::string KeepName(Keep keep) {
  switch (keep) {
    case Keep::kNone:
      return "none";
    case Keep::kFlux:
      return "flux";
    case Keep::kMoments:
      return "moments";
  }
  throw InputError("a kind of moments that nobody keeps");
}

int MomentsOfAxis(const Basis& basis, int count, Keep keep) {
  const bool straight_lines =
      basis.kind == BasisKind::kBilinear || basis.kind == BasisKind::kBspline2;
  if (!straight_lines || count < basis.cells) return 0;
  return keep == Keep::kNone ? 0 : keep == Keep::kFlux ? 1 : 2;
}

KeptMoments MomentsToKeep(const lightfield::BasisGrid& grid, Keep keep,
                          const lightfield::EdgeLight& edges) {
  return {edges.reached_u() ? 0 : MomentsOfAxis(grid.basis, grid.width, keep),
          edges.reached_v() ? 0 : MomentsOfAxis(grid.basis, grid.height, keep)};
}

AxisMoments MomentsAlong(const Basis& basis, int count, double spacing_m, int moments) {
  AxisMoments result{count, moments, {}, {}};
  const double whole = basis.TotalIntegral(), middle = 0.5 * basis.cells,
               own = basis.FirstMoment(0, basis.cells, middle);  // 0 of symmetric functions
  for (int i = 0; i < count; ++i) {
    const double centre = i - 0.5 * (count - 1);
    const double integrals[2] = {whole, centre * whole + own}, measured[2] = {1, centre};
    for (int k = 0; k < moments; ++k) {
      result.integrals.push_back(spacing_m * integrals[k]);
      result.measured.push_back(measured[k]);
    }
  }
  return result;
}

}  // namespace luxfield::reconstruct
