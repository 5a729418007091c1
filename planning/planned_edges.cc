#include "luxfield/planning/planned_edges.h"

#include <algorithm>

#include "luxfield/core/config.h"
#include "luxfield/hal/sim/lab_description.h"
#include "luxfield/planning/planned_filters.h"

namespace luxfield::planning {

std::optional<lightfield::EdgeLight> PlannedEdgeLight(const std::filesystem::path& lab_toml,
                                                      const lightfield::LuminaireGeometry& geometry,
                                                      bool dual) {
  constexpr int kTexels = 12, kCells = 64;  // of a side: the light of whole rows of filters counts
  const core::Config config = core::Config::FromFile(lab_toml);
  if (dual || config.Table("lab").Text("driver") != "sim") return {};
  const auto lab = hal::sim::ReadLab(config, {});
  PlannedFilters filters{false, geometry.grid, geometry.lattice};
  lightfield::Lattice& lattice = filters.lattice;
  lattice.ds_m *= static_cast<double>(lattice.width) / std::min(lattice.width, kTexels);
  lattice.dt_m *= static_cast<double>(lattice.height) / std::min(lattice.height, kTexels);
  lattice.width = std::min(lattice.width, kTexels);
  lattice.height = std::min(lattice.height, kTexels);
  const auto& grid = geometry.grid;
  const int cells = grid.basis.cells - 1;
  const Rectangle supports{grid.u0_m, grid.u0_m + (grid.width + cells) * grid.spacing_m, grid.v0_m,
                           grid.v0_m + (grid.height + cells) * grid.spacing_m};
  return EdgeLightOf(
      FilterImages(SampleLamp(*lab.lamp, geometry.delta_m, supports, kCells, lattice), filters),
      filters);
}

}  // namespace luxfield::planning
