#include "luxfield/planning/filter_choice.h"

#include <algorithm>
#include <cmath>

namespace luxfield::planning {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::Vec2;

std::vector<FilterFamily> FilterFamilies() {
  std::vector<FilterFamily> families;
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    const Basis basis = Basis::Make(kind);
    families.push_back({basis, false, basis.name()});
    if (kind == BasisKind::kBilinear || kind == BasisKind::kQuadratic)
      families.push_back({basis, true, basis.name() + ", dual"});
  }
  return families;
}

Rectangle SeenBySensor(const rig::Homography& image_from_sensor, int width, int height) {
  const double x = width, y = height;
  const Vec2 top_left = image_from_sensor.Map({0, 0}), top_right = image_from_sensor.Map({x, 0}),
             bottom_right = image_from_sensor.Map({x, y}),
             bottom_left = image_from_sensor.Map({0, y});
  return {std::max(top_left.x, bottom_left.x), std::min(top_right.x, bottom_right.x),
          std::max(bottom_left.y, bottom_right.y), std::min(top_left.y, top_right.y)};
}

lightfield::Lattice LatticeOver(const Rectangle& rectangle, double pitch_m, int texels) {
  const double width = rectangle.x1 - rectangle.x0, height = rectangle.y1 - rectangle.y0;
  const double step =
      pitch_m * std::max(1.0, std::ceil(std::max(width, height) / (texels * pitch_m) * (1 - 1e-9)));
  lightfield::Lattice lattice;
  lattice.width = std::max(1, static_cast<int>(width / step + 1e-9));
  lattice.height = std::max(1, static_cast<int>(height / step + 1e-9));
  lattice.ds_m = lattice.dt_m = step;
  lattice.s0_m = 0.5 * (rectangle.x0 + rectangle.x1 - lattice.width * step);
  lattice.t1_m = 0.5 * (rectangle.y0 + rectangle.y1 + lattice.height * step);
  return lattice;
}

std::optional<PlannedFilters> Lay(const FilterFamily& family, int cells, int fewer,
                                  const FilterField& field) {
  const Rectangle& lit = field.lit;
  const double width = lit.x1 - lit.x0, height = lit.y1 - lit.y0,
               h = std::max(width, height) / cells;
  const auto count = [&](double length) {
    return static_cast<int>(std::ceil(length / h - 1e-9)) + family.basis.cells - 1 - fewer;
  };
  PlannedFilters filters;
  filters.dual = family.dual;
  filters.grid = lightfield::BasisGrid::Centred(family.basis, std::max(1, count(width)),
                                                std::max(1, count(height)), h);
  auto& grid = filters.grid;
  grid.u0_m += 0.5 * (lit.x0 + lit.x1);
  grid.v0_m += 0.5 * (lit.y0 + lit.y1);
  const Vec2 low = grid.centre(0, 0), high = grid.centre(grid.width - 1, grid.height - 1);
  if (!field.stage.Contain(low) || !field.stage.Contain(high)) return {};

  // Texels that every position sees, a pixel from the sensor's edge.
  const lightfield::Lattice& all = field.lattice;
  const double edge = field.pitch_m;
  const int first = std::max(0, static_cast<int>(std::ceil(
                                    all.column_of_s(high.x + field.sensor.x0 + edge) - 1e-9))),
            end = std::min(all.width, static_cast<int>(std::floor(
                                          all.column_of_s(low.x + field.sensor.x1 - edge) + 1e-9))),
            top = std::max(0, static_cast<int>(
                                  std::ceil(all.row_of_t(low.y + field.sensor.y1 - edge) - 1e-9))),
            bottom = std::min(
                all.height,
                static_cast<int>(std::floor(all.row_of_t(high.y + field.sensor.y0 + edge) + 1e-9)));
  if (first >= end || top >= bottom) return {};
  filters.lattice = all;
  filters.lattice.width = end - first;
  filters.lattice.height = bottom - top;
  filters.lattice.s0_m = all.s_of_column(first);
  filters.lattice.t1_m = all.t_of_row(top);
  return filters;
}

}  // namespace luxfield::planning
