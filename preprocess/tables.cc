#include "preprocess/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LightField;

// Sums stay below 2^62 plus half a quantum per texel.
constexpr int kTotalBits = 62;

[[noreturn]] void RefuseTexel(const LightField& field, const std::string& name, int m,
                              std::size_t texel) {
  const auto& g = field.geometry;
  const int width = g.lattice.width;
  for (int channel = 0; channel < g.channels; ++channel) {
    const float c = field.image(m, channel)[texel];
    if (c >= 0 && std::isfinite(c)) continue;
    const bool finite = std::isfinite(c);
    throw InputError(
        name,
        fmt::format("image C.{:02d}.{:02d} is {} at row {}, column {}", m / g.grid.width,
                    m % g.grid.width, c, texel / width, texel % width),
        finite ? "sampling needs C >= 0: make the light field with 'luxfield reconstruct "
                 "--non-negative'"
               : "repair it, or make the light field again with 'luxfield reconstruct "
                 "--non-negative'");
  }
  throw InputError(name, "a coefficient changed while it was read", "run again");
}

// Writes Y of every texel and returns its sum; refuses what cannot be sampled.
double LuminanceSum(const LightField& field, const std::string& name, int m,
                    std::vector<float>& luminance) {
  const std::size_t size = field.geometry.plane_size();
  bool good = true;
  double sum = 0;
  if (field.geometry.channels == 1) {
    const auto c = field.image(m, 0);
    for (std::size_t k = 0; k < size; ++k) {
      good &= c[k] >= 0 && c[k] <= std::numeric_limits<float>::max();
      luminance[k] = c[k];
      sum += c[k];
    }
  } else {
    const auto r = field.image(m, 0), g = field.image(m, 1), b = field.image(m, 2);
    for (std::size_t k = 0; k < size; ++k) {
      good &= std::min({r[k], g[k], b[k]}) >= 0 && r[k] + g[k] + b[k] <= 3e38;
      luminance[k] = TexelLuminance(field, m, k);
      sum += luminance[k];
    }
  }
  if (good && sum <= std::numeric_limits<float>::max()) return sum;
  for (std::size_t k = 0; k < size; ++k)
    for (int channel = 0; channel < field.geometry.channels; ++channel) {
      const float c = field.image(m, channel)[k];
      if (!(c >= 0) || !std::isfinite(c)) RefuseTexel(field, name, m, k);
    }
  throw InputError(name,
                   fmt::format("the sum of image C.{:02d}.{:02d} exceeds the range of float32",
                               m / field.geometry.grid.width, m % field.geometry.grid.width),
                   "scale the light field down");
}

// One pass over the image, row prefix plus the row above; returns the exponent.
int BuildSat(const std::vector<float>& luminance, double sum, int width, int height,
             std::uint64_t* sat) {
  std::fill(sat, sat + width + 1, 0);
  int exponent = 0;
  if (sum > 0) {
    int binary_exponent = 0;
    std::frexp(sum, &binary_exponent);
    exponent = kTotalBits - binary_exponent;
  }
  const double scale = std::ldexp(1.0, exponent);
  for (int r = 0; r < height; ++r) {
    const std::uint64_t* above = sat + static_cast<std::size_t>(r) * (width + 1);
    std::uint64_t* row = sat + static_cast<std::size_t>(r + 1) * (width + 1);
    const float* texel = luminance.data() + static_cast<std::size_t>(r) * width;
    std::uint64_t prefix = 0;
    row[0] = 0;
    for (int c = 0; c < width; ++c) {
      // Adding 0.5 is exact below 2^52 quanta; above, every value is a whole number already.
      const double quanta = texel[c] * scale;
      prefix += static_cast<std::uint64_t>(
          static_cast<std::int64_t>(quanta < 0x1p51 ? quanta + 0.5 : quanta));
      row[c + 1] = above[c + 1] + prefix;
    }
  }
  return exponent;
}

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

struct Point {
  bool lit = false;
  double s_m = 0, t_m = 0;
};

Point MedianPoint(const Tables& tables, int m, const lightfield::Lattice& lattice) {
  if (tables.Quanta(m, 0, 0, tables.width, tables.height) == 0) return {};
  const double column =
      Median(tables.width, [&](int c) { return tables.Quanta(m, 0, 0, c, tables.height); });
  // A lit column: the marginal rises inside it.
  int c = std::min(static_cast<int>(column), tables.width - 1);
  while (tables.Quanta(m, c, 0, c + 1, tables.height) == 0 && c > 0) --c;
  const double row = Median(tables.height, [&](int r) { return tables.Quanta(m, c, 0, c + 1, r); });
  return {true, lattice.s_of_column(column), lattice.t_of_row(row)};
}

void FillReference(const lightfield::LuminaireGeometry& geometry, Tables& tables) {
  std::vector<Point> points(tables.count());
  core::ParallelFor(points.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m)
      points[m] = MedianPoint(tables, static_cast<int>(m), geometry.lattice);
  });
  const int n = tables.basis_cells;
  const int cells_u = tables.grid_width + n - 1, cells_v = tables.grid_height + n - 1;
  tables.reference.assign(static_cast<std::size_t>(cells_u) * cells_v, {});
  for (int cell_j = 0; cell_j < cells_v; ++cell_j)
    for (int cell_i = 0; cell_i < cells_u; ++cell_i) {
      double s_m = 0, t_m = 0;
      int images = 0;
      for (int j = std::max(0, cell_j - n + 1); j <= std::min(cell_j, tables.grid_height - 1); ++j)
        for (int i = std::max(0, cell_i - n + 1); i <= std::min(cell_i, tables.grid_width - 1);
             ++i) {
          const Point& point = points[j * tables.grid_width + i];
          if (!point.lit) continue;
          s_m += point.s_m;
          t_m += point.t_m;
          ++images;
        }
      if (images > 0)
        tables.reference[static_cast<std::size_t>(cell_j) * cells_u + cell_i] = {
            static_cast<float>(s_m / images), static_cast<float>(t_m / images), images};
    }
}

}  // namespace

double Tables::QuantaToLuminance(int m, std::uint64_t quanta) const {
  return std::ldexp(static_cast<double>(quanta), -exponent[m]);
}

float TexelLuminance(const LightField& field, int m, std::size_t texel) {
  if (field.geometry.channels == 1) return field.image(m, 0)[texel];
  return static_cast<float>(0.2126 * field.image(m, 0)[texel] + 0.7152 * field.image(m, 1)[texel] +
                            0.0722 * field.image(m, 2)[texel]);
}

Tables BuildTables(const LightField& field, const std::string& name, const std::string& sha256) {
  const auto& g = field.geometry;
  Tables tables;
  tables.width = g.lattice.width;
  tables.height = g.lattice.height;
  tables.grid_width = g.grid.width;
  tables.grid_height = g.grid.height;
  tables.basis_cells = g.grid.basis.cells;
  tables.light_field_sha256 = sha256;
  tables.exponent.assign(tables.count(), 0);
  tables.sat.resize(tables.sat_size() * tables.count());
  core::ParallelFor(tables.exponent.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<float> luminance(g.plane_size());
    for (std::size_t m = begin; m < end; ++m) {
      const double sum = LuminanceSum(field, name, static_cast<int>(m), luminance);
      tables.exponent[m] = BuildSat(luminance, sum, tables.width, tables.height,
                                    tables.sat.data() + tables.sat_size() * m);
    }
  });
  FillReference(g, tables);
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
