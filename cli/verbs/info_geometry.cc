#include "luxfield/cli/verbs/info_geometry.h"

#include <fmt/format.h>

namespace luxfield::cli {

void PrintGeometry(const lightfield::LuminaireGeometry& g) {
  const auto& l = g.lattice;
  fmt::print("  basis        {} x {} {}{}, spacing {:.6g} mm, support corner ({:.6g}, {:.6g}) mm\n",
             g.grid.width, g.grid.height, g.grid.basis.name(),
             g.grid.basis.kind == lightfield::BasisKind::kQuadratic
                 ? fmt::format(" (a = {})", g.grid.basis.a)
                 : "",
             1e3 * g.grid.spacing_m, 1e3 * g.grid.u0_m, 1e3 * g.grid.v0_m);
  fmt::print("  planes       F at z = 0, I at z = {:.6g} m\n", g.delta_m);
  fmt::print(
      "  images       {} x {} texels of {:.6g} x {:.6g} mm on I, {:.4g} x {:.4g} m, {} channel{}\n",
      l.width, l.height, 1e3 * l.ds_m, 1e3 * l.dt_m, l.extent_s_m(), l.extent_t_m(), g.channels,
      g.channels == 1 ? "" : "s");
}

core::Json GeometryJson(const lightfield::LuminaireGeometry& g) {
  return {{"basis", g.grid.basis.name()},
          {"grid_width", g.grid.width},
          {"grid_height", g.grid.height},
          {"spacing_m", g.grid.spacing_m},
          {"delta_m", g.delta_m},
          {"width", g.lattice.width},
          {"height", g.lattice.height},
          {"channels", g.channels},
          {"unit", lightfield::FluxUnitName(g.unit)}};
}

}  // namespace luxfield::cli
