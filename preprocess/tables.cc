#include "luxfield/preprocess/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/preprocess/summed_area.h"
#include "luxfield/preprocess/table_images.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LightField;

// The fractional texel index where the piecewise linear cdf(k), k = 0..count, reaches half of its
// end value.
template <typename Cdf>
double Median(int count, Cdf cdf) {
  const double half = 0.5 * static_cast<double>(cdf(count));
  int low = 0, high = count;  // cdf(low) <= half < cdf(high)
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (static_cast<double>(cdf(middle)) <= half ? low : high) = middle;
  }
  const double a = static_cast<double>(cdf(low)), b = static_cast<double>(cdf(high));
  return low + (half - a) / (b - a);
}

}  // namespace

MedianPoint FindMedianPoint(const std::uint64_t* sat, const lightfield::Lattice& lattice) {
  const int width = lattice.width, height = lattice.height;
  const auto at = [&](int row, int column) {
    return sat[static_cast<std::size_t>(row) * (width + 1) + column];
  };
  if (at(height, width) == 0) return {};
  const double column = Median(width, [&](int c) { return at(height, c); });
  // A lit column: the marginal rises inside it.
  int c = std::min(static_cast<int>(column), width - 1);
  while (at(height, c + 1) == at(height, c) && c > 0) --c;
  const double row = Median(height, [&](int r) { return at(r, c + 1) - at(r, c); });
  return {true, lattice.s_of_column(column), lattice.t_of_row(row)};
}

Tables TablesWithoutImages(const lightfield::LuminaireGeometry& geometry,
                           const std::string& sha256) {
  Tables tables;
  tables.width = geometry.lattice.width;
  tables.height = geometry.lattice.height;
  tables.grid_width = geometry.grid.width;
  tables.grid_height = geometry.grid.height;
  tables.basis_cells = geometry.grid.basis.cells;
  tables.light_field_sha256 = sha256;
  tables.exponent.assign(tables.count(), 0);
  return tables;
}

std::vector<ReferencePosition> ReferencePositions(const Tables& tables,
                                                  std::span<const MedianPoint> points) {
  const int n = tables.basis_cells;
  const int cells_u = tables.grid_width + n - 1, cells_v = tables.grid_height + n - 1;
  std::vector<ReferencePosition> reference(static_cast<std::size_t>(cells_u) * cells_v);
  for (int cell_j = 0; cell_j < cells_v; ++cell_j)
    for (int cell_i = 0; cell_i < cells_u; ++cell_i) {
      double s_m = 0, t_m = 0;
      int images = 0;
      for (int j = std::max(0, cell_j - n + 1); j <= std::min(cell_j, tables.grid_height - 1); ++j)
        for (int i = std::max(0, cell_i - n + 1); i <= std::min(cell_i, tables.grid_width - 1);
             ++i) {
          const MedianPoint& point = points[j * tables.grid_width + i];
          if (!point.lit) continue;
          s_m += point.s_m;
          t_m += point.t_m;
          ++images;
        }
      if (images > 0)
        reference[static_cast<std::size_t>(cell_j) * cells_u + cell_i] = {
            static_cast<float>(s_m / images), static_cast<float>(t_m / images), images};
    }
  return reference;
}

double Tables::FixedPointToLuminance(int m, std::uint64_t units) const {
  return std::ldexp(static_cast<double>(units), -exponent[m]);
}

Tables BuildTables(const LightField& field, const std::string& name, const std::string& sha256) {
  const auto& g = field.geometry;
  Tables tables = TablesWithoutImages(g, sha256);
  tables.sat.resize(tables.sat_size() * tables.count());
  std::vector<MedianPoint> points(tables.exponent.size());
  core::ParallelFor(tables.exponent.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<float> magnitude(g.plane_size());
    for (std::size_t m = begin; m < end; ++m) {
      const double sum = MagnitudeSum(field, name, static_cast<int>(m), magnitude);
      std::uint64_t* sat = tables.sat.data() + tables.sat_size() * m;
      tables.exponent[m] =
          BuildSummedArea(std::span<const float>(magnitude), sum, tables.width, tables.height, sat);
      points[m] = FindMedianPoint(sat, g.lattice);
    }
  });
  tables.reference = ReferencePositions(tables, points);
  return tables;
}

void CheckTables(const Tables& tables, const std::string& tables_name,
                 const lightfield::LuminaireGeometry& geometry,
                 const std::string& light_field_sha256) {
  const char* remedy = "make the tables again with 'luxfield preprocess'";
  if (tables.light_field_sha256 != light_field_sha256)
    throw InputError(tables_name,
                     fmt::format("made from the light field with SHA-256 {}, but this one has {}",
                                 tables.light_field_sha256, light_field_sha256),
                     remedy);
  if (tables.width != geometry.lattice.width || tables.height != geometry.lattice.height ||
      tables.grid_width != geometry.grid.width || tables.grid_height != geometry.grid.height ||
      tables.basis_cells != geometry.grid.basis.cells)
    throw InputError(
        tables_name,
        fmt::format("holds {} x {} images of {} x {} texels and {} cells, the light field {} x {} "
                    "of {} x {} "
                    "and {}",
                    tables.grid_width, tables.grid_height, tables.width, tables.height,
                    tables.basis_cells, geometry.grid.width, geometry.grid.height,
                    geometry.lattice.width, geometry.lattice.height, geometry.grid.basis.cells),
        remedy);
}

}  // namespace luxfield::preprocess
