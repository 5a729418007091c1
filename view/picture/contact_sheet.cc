#include "luxfield/view/picture/contact_sheet.h"

#include <algorithm>

#include "luxfield/core/colour.h"
#include "luxfield/core/parallel.h"

namespace luxfield::view {

using lightfield::LightField;
using lightfield::LuminaireGeometry;

double LuminanceOf(const LightField& field, const SheetPlace& place) {
  const LuminaireGeometry& geometry = field.geometry;
  const int m = geometry.grid.index(place.i, place.j);
  const std::size_t texel =
      static_cast<std::size_t>(place.row) * geometry.lattice.width + place.column;
  if (geometry.channels == 1) return field.image(m, 0)[texel];
  return core::Luminance(
      {field.image(m, 0)[texel], field.image(m, 1)[texel], field.image(m, 2)[texel]});
}

ContactSheet ContactSheetOf(const LightField& field, int most_side) {
  const auto& [delta_m, grid, lattice, channels, unit] = field.geometry;
  const auto cells = [](int texels, int shrink) { return (texels + shrink - 1) / shrink; };
  ContactSheet sheet;
  const auto fits = [&] {
    return std::max(grid.width * cells(lattice.width, sheet.shrink),
                    grid.height * cells(lattice.height, sheet.shrink)) <= most_side;
  };
  while (!fits() && sheet.shrink < std::max(lattice.width, lattice.height)) ++sheet.shrink;
  sheet.cell_width = cells(lattice.width, sheet.shrink);
  sheet.cell_height = cells(lattice.height, sheet.shrink);
  sheet.values = core::Image(grid.width * sheet.cell_width, grid.height * sheet.cell_height, 1);
  core::ParallelFor(
      static_cast<std::size_t>(sheet.values.height), 8, [&](std::size_t begin, std::size_t end) {
        for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row)
          for (int column = 0; column < sheet.values.width; ++column) {
            SheetPlace place = PlaceOn(sheet, field, column, row);
            const int row_end = std::min(place.row + sheet.shrink, lattice.height),
                      column_begin = place.column,
                      column_end = std::min(column_begin + sheet.shrink, lattice.width);
            double sum = 0;
            int count = 0;
            for (; place.row < row_end; ++place.row)
              for (place.column = column_begin; place.column < column_end; ++place.column, ++count)
                sum += LuminanceOf(field, place);
            sheet.values.at(0, row, column) = static_cast<float>(sum / count);
          }
      });
  return sheet;
}

SheetPlace PlaceOn(const ContactSheet& sheet, const LightField& field, int column, int row) {
  return {column / sheet.cell_width, field.geometry.grid.height - 1 - row / sheet.cell_height,
          column % sheet.cell_width * sheet.shrink, row % sheet.cell_height * sheet.shrink};
}

}  // namespace luxfield::view
