#include "luxfield/lightfield/field_columns.h"

#include <algorithm>
#include <span>

#include "luxfield/core/progress.h"
#include "luxfield/lightfield/light_field_file.h"

namespace luxfield::lightfield {

LuminaireGeometry ColumnGroup::GeometryIn(const LuminaireGeometry& whole) const {
  LuminaireGeometry group = whole;
  group.grid.width = count;
  group.grid.u0_m = whole.grid.u0_m + first * whole.grid.spacing_m;
  return group;
}

int ColumnGroup::ImageIn(const LuminaireGeometry& whole, int m) const {
  return whole.grid.index(first + m % count, m / count);
}

std::vector<ColumnGroup> GroupsOf(const LuminaireGeometry& whole, int at_once) {
  std::vector<ColumnGroup> groups;
  for (int first = 0; first < whole.grid.width; first += at_once)
    groups.push_back({first, std::min(at_once, whole.grid.width - first)});
  return groups;
}

FieldColumns::FieldColumns(LightFieldFile& file, std::size_t field, int at_once)
    : FieldColumns(file.fields().at(field).geometry, [&file, field, at_once](const Visitor& visit) {
        const LuminaireGeometry& whole = file.fields()[field].geometry;
        for (const ColumnGroup& group : GroupsOf(whole, at_once)) {
          core::ThrowIfInterrupted();
          LightField columns(group.GeometryIn(whole));
          const std::size_t image = whole.plane_size() * static_cast<std::size_t>(whole.channels);
          for (int m = 0; m < columns.geometry.grid.count(); ++m)
            file.ReadImage(
                field, group.ImageIn(whole, m),
                std::span(columns.data).subspan(static_cast<std::size_t>(m) * image, image));
          visit(columns, group.first);
        }
      }) {}

}  // namespace luxfield::lightfield
