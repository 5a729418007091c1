#include "luxfield/preprocess/cell_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/preprocess/summed_area.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Basis;
using lightfield::LightField;
using Matrix = std::array<std::array<double, Basis::kMaxCells>, Basis::kMaxCells>;

// The lower triangular L with L L^T = <B_k, B_l> over one cell, B_k the basis function of which it
// is cell k. The pieces are independent polynomials, so the Gram matrix is positive definite.
Matrix CellFactor(const Basis& basis) {
  Matrix factor{};
  for (int k = 0; k < basis.cells; ++k)
    for (int l = 0; l <= k; ++l) {
      double rest = 0;
      for (int p = 0; p < 3; ++p)
        for (int q = 0; q < 3; ++q) rest += basis.c[k][p] * basis.c[l][q] / (p + q + 1);
      for (int i = 0; i < l; ++i) rest -= factor[k][i] * factor[l][i];
      factor[k][l] = k == l ? std::sqrt(rest) : rest / factor[l][l];
    }
  return factor;
}

// Images whose squared light Q counts, `weight` times each.
struct WeighedImages {
  double weight;
  std::size_t plane_size;
  std::vector<float> values;  // of image m from m * plane_size on

  const float* image(int m) const { return values.data() + plane_size * m; }
};

WeighedImages Channel(const LightField& field, int channel, double weight) {
  const auto& g = field.geometry;
  WeighedImages images{weight, g.plane_size(), {}};
  for (int m = 0; m < g.grid.count(); ++m)
    images.values.insert(images.values.end(), field.image(m, channel).begin(),
                         field.image(m, channel).end());
  return images;
}

// One channel as it is. Colours by their luminance, which is above 0 wherever a channel is as long
// as C >= 0; else channel by channel, so that none has light where Q is 0.
std::vector<WeighedImages> ImagesOf(const LightField& field, const std::string& name) {
  const auto& g = field.geometry;
  WeighedImages magnitudes{1, g.plane_size(), std::vector<float>(g.plane_size() * g.grid.count())};
  core::ParallelFor(g.grid.count(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m)
      MagnitudeSum(field, name, static_cast<int>(m),
                   std::span(magnitudes.values).subspan(m * g.plane_size(), g.plane_size()));
  });
  const bool negative = std::ranges::any_of(field.data, [](float c) { return c < 0; });
  if (!negative) return {std::move(magnitudes)};
  if (g.channels == 1) return {Channel(field, 0, 1)};
  const core::Rgb& w = core::kLuminanceWeights;
  return {Channel(field, 0, w[0]), Channel(field, 1, w[1]), Channel(field, 2, w[2])};
}

// Q of one row of texels. With C the n x n active images, integral E^2 = |L^T C L|^2 (Frobenius):
// a sum of squares, so a lit texel is never lost to cancellation.
void CellRow(const lightfield::BasisGrid& grid, const Matrix& factor,
             const std::vector<WeighedImages>& weighed, int a, int b, std::size_t first,
             std::span<double> part, std::span<double> density) {
  const int n = grid.basis.cells;
  std::fill(density.begin(), density.end(), 0.0);
  for (const WeighedImages& images : weighed)
    for (int l = 0; l < n; ++l)
      for (int k = 0; k < n; ++k) {
        std::fill(part.begin(), part.end(), 0.0);
        // Image (a - x, b - y) is active with cell x, y of its support.
        for (int y = l; y < n; ++y)
          for (int x = k; x < n; ++x) {
            const int i = a - x, j = b - y;
            if (i < 0 || i >= grid.width || j < 0 || j >= grid.height) continue;
            const double weight = factor[x][k] * factor[y][l];
            const float* image = images.image(grid.index(i, j)) + first;
            for (std::size_t c = 0; c < part.size(); ++c) part[c] += weight * image[c];
          }
        for (std::size_t c = 0; c < part.size(); ++c)
          density[c] += images.weight * (part[c] * part[c]);
      }
  for (double& q : density) q = std::sqrt(q);
}

}  // namespace

CellTables BuildCellTables(const LightField& field, const std::string& name) {
  const auto& g = field.geometry;
  const int n = g.grid.basis.cells;
  const std::vector<WeighedImages> images = ImagesOf(field, name);
  const Matrix factor = CellFactor(g.grid.basis);
  CellTables tables;
  tables.width = g.lattice.width;
  tables.height = g.lattice.height;
  tables.grid_width = g.grid.width + n - 1;
  tables.grid_height = g.grid.height + n - 1;
  tables.exponent.assign(tables.count(), 0);
  tables.sat.resize(tables.sat_size() * tables.count());
  core::ParallelFor(tables.exponent.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<double> density(g.plane_size()), part(tables.width);
    for (std::size_t cell = begin; cell < end; ++cell) {
      const int a = static_cast<int>(cell) % tables.grid_width,
                b = static_cast<int>(cell) / tables.grid_width;
      double sum = 0;
      for (int r = 0; r < tables.height; ++r) {
        const std::size_t first = static_cast<std::size_t>(r) * tables.width;
        const auto row = std::span(density).subspan(first, tables.width);
        CellRow(g.grid, factor, images, a, b, first, part, row);
        for (const double q : row) sum += q;
      }
      if (sum > std::numeric_limits<float>::max())
        throw InputError(
            name,
            fmt::format("the sum of the images of cell {}, {} exceeds the range of float32", a, b),
            "scale the light field down");
      // Half a quantum at least: it rounds to one.
      for (double& q : density)
        if (q > 0) q = std::max(q, sum * 0x1p-61);
      tables.exponent[cell] =
          BuildSummedArea(std::span<const double>(density), sum, tables.width, tables.height,
                          tables.sat.data() + tables.sat_size() * cell);
    }
  });
  return tables;
}

}  // namespace luxfield::preprocess
