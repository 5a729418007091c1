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
#include "luxfield/core/simd.h"
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
  std::vector<const float*> image;  // of m
};

// The images of a light field as Q counts them, and the luminances that are none of them.
struct Light {
  std::vector<WeighedImages> weighed;
  std::vector<float> luminance;
};

// One channel as it is. Colours by their luminance, which is above 0 wherever a channel is as long
// as C >= 0; else channel by channel, so that none has light where Q is 0.
Light LightOf(const LightField& field, const std::string& name) {
  const auto& g = field.geometry;
  const std::size_t count = static_cast<std::size_t>(g.grid.count()), plane = g.plane_size();
  Light light;
  const bool colours = g.channels > 1;
  if (colours) light.luminance.resize(plane * count);
  std::vector<char> negative(count);
  core::ParallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<float> magnitude(colours ? 0 : plane);
    for (std::size_t m = begin; m < end; ++m) {
      MagnitudeSum(field, name, static_cast<int>(m),
                   colours ? std::span(light.luminance).subspan(m * plane, plane) : magnitude);
      for (int channel = 0; colours && channel < g.channels; ++channel)
        negative[m] |= std::ranges::any_of(field.image(static_cast<int>(m), channel),
                                           [](float c) { return c < 0; });
    }
  });
  const auto add = [&](double weight, const auto& image_of) {
    WeighedImages& images = light.weighed.emplace_back(weight);
    for (int m = 0; m < g.grid.count(); ++m) images.image.push_back(image_of(m));
  };
  const auto channel_of = [&](int channel) {
    return [&field, channel](int m) { return field.image(m, channel).data(); };
  };
  const bool any_negative = std::ranges::any_of(negative, [](char yes) { return yes != 0; });
  const core::Rgb& w = core::kLuminanceWeights;
  if (!colours)
    add(1, channel_of(0));
  else if (!any_negative)
    add(1, [&](int m) { return light.luminance.data() + plane * static_cast<std::size_t>(m); });
  else
    for (int channel = 0; channel < g.channels; ++channel) add(w[channel], channel_of(channel));
  return light;
}

// A register of texels: GCC's and Clang's own vectors.
constexpr std::size_t kLanes = 8;
typedef double Texels __attribute__((vector_size(kLanes * sizeof(double))));
typedef double TexelsInMemory
    __attribute__((vector_size(kLanes * sizeof(double)), aligned(alignof(double)), may_alias));
typedef float FloatsInMemory
    __attribute__((vector_size(kLanes * sizeof(float)), aligned(alignof(float)), may_alias));

// The n x n images that shine through a cell, [y][x] (a - x, b - y); null: there is none.
using ActiveImages = std::array<std::array<const float*, Basis::kMaxCells>, Basis::kMaxCells>;

// What image [y][x] counts for in entry [l][k] of L^T C L: L_xk L_yl, where x >= k and y >= l.
template <int n>
struct EntryWeights {
  double of[n][n][n][n] = {};

  explicit EntryWeights(const Matrix& factor) {
    for (int l = 0; l < n; ++l)
      for (int k = 0; k < n; ++k)
        for (int y = l; y < n; ++y)
          for (int x = k; x < n; ++x) of[l][k][y][x] = factor[x][k] * factor[y][l];
  }
};

// squares += weight |L^T C L|^2 (Frobenius) of kLanes texels from `first` on: the integral of E^2 as
// a sum of squares, so that a lit texel is never lost to cancellation. The compiler knows n.
template <int n>
LUXFIELD_INLINE void AddSquares(const ActiveImages& active, const EntryWeights<n>& weights,
                                double weight, std::size_t first, double* squares) {
  alignas(sizeof(Texels)) Texels c[n][n];
#pragma GCC unroll 3
  for (int y = 0; y < n; ++y)
#pragma GCC unroll 3
    for (int x = 0; x < n; ++x)
      c[y][x] = __builtin_convertvector(
          *reinterpret_cast<const FloatsInMemory*>(active[y][x] + first), Texels);
  Texels sum{};
#pragma GCC unroll 3
  for (int l = 0; l < n; ++l)
#pragma GCC unroll 3
    for (int k = 0; k < n; ++k) {
      Texels part{};
#pragma GCC unroll 3
      for (int y = l; y < n; ++y)
#pragma GCC unroll 3
        for (int x = k; x < n; ++x) part += weights.of[l][k][y][x] * c[y][x];
      sum += part * part;
    }
  TexelsInMemory& to = *reinterpret_cast<TexelsInMemory*>(squares);
  to += weight * sum;
}

template <int n>
LUXFIELD_INLINE void AddAllSquares(const ActiveImages& active, const Matrix& factor, double weight,
                                   std::size_t size, double* squares) {
  const EntryWeights<n> weights(factor);
  for (std::size_t first = 0; first < size; first += kLanes)
    AddSquares(active, weights, weight, first, squares + first);
}

// Of `size` texels, a multiple of kLanes.
LUXFIELD_SIMD_CLONES void AddSquares(const ActiveImages& active, const Matrix& factor, int n,
                                     double weight, std::size_t size, double* squares) {
  if (n == 1) AddAllSquares<1>(active, factor, weight, size, squares);
  if (n == 2) AddAllSquares<2>(active, factor, weight, size, squares);
  if (n == 3) AddAllSquares<3>(active, factor, weight, size, squares);
}

LUXFIELD_SIMD_CLONES void TakeRoots(std::size_t size, double* values) {
  for (std::size_t k = 0; k < size; ++k) values[k] = std::sqrt(values[k]);
}

LUXFIELD_SIMD_CLONES void RaiseLit(std::size_t size, double least, double* values) {
  for (std::size_t k = 0; k < size; ++k) {
    const double raised = values[k] < least ? least : values[k];
    values[k] = values[k] > 0 ? raised : values[k];
  }
}

// Q of all texels of a cell, cell after cell in the same memory.
class CellDensity {
 public:
  CellDensity(const lightfield::LuminaireGeometry& geometry, const Matrix& factor)
      : grid_(geometry.grid), factor_(factor), q_(geometry.plane_size()), dark_(q_.size()) {}

  // Writes it to q() and returns its sum.
  double Fill(const Light& light, int a, int b) {
    constexpr std::size_t kPiece = 2048;  // texels, which stay in the first-level cache
    std::fill(q_.begin(), q_.end(), 0.0);
    std::vector<ActiveImages> active;
    for (const WeighedImages& images : light.weighed) active.push_back(ActiveIn(images, a, b));
    double sum = 0;
    for (std::size_t first = 0; first < q_.size(); first += kPiece) {
      const auto piece = std::span(q_).subspan(first, std::min(kPiece, q_.size() - first));
      for (std::size_t k = 0; k < active.size(); ++k)
        Add(active[k], light.weighed[k].weight, first, piece);
      TakeRoots(piece.size(), piece.data());
      sum += Sum(piece.data(), piece.size());
    }
    return sum;
  }
  std::span<double> q() { return q_; }

 private:
  ActiveImages ActiveIn(const WeighedImages& images, int a, int b) const {
    ActiveImages active{};
    for (int y = 0; y < grid_.basis.cells; ++y)
      for (int x = 0; x < grid_.basis.cells; ++x) {
        const int i = a - x, j = b - y;
        const bool is_there = i >= 0 && i < grid_.width && j >= 0 && j < grid_.height;
        active[y][x] = is_there ? images.image[grid_.index(i, j)] : dark_.data();
      }
    return active;
  }

  // To the squares of the texels from `first` on.
  void Add(ActiveImages active, double weight, std::size_t first, std::span<double> squares) const {
    const int n = grid_.basis.cells;
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) active[y][x] += first;
    const std::size_t whole = squares.size() / kLanes * kLanes, rest = squares.size() - whole;
    AddSquares(active, factor_, n, weight, whole, squares.data());
    if (rest == 0) return;
    // The last texels: padded with dark ones.
    std::array<std::array<float, kLanes>, Basis::kMaxCells * Basis::kMaxCells> padded{};
    std::array<double, kLanes> of_rest{};
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        auto& texels = padded[y * n + x];
        std::copy_n(active[y][x] + whole, rest, texels.begin());
        active[y][x] = texels.data();
      }
    AddSquares(active, factor_, n, weight, kLanes, of_rest.data());
    for (std::size_t k = 0; k < rest; ++k) squares[whole + k] += of_rest[k];
  }

  const lightfield::BasisGrid& grid_;
  const Matrix& factor_;
  std::vector<double> q_;
  std::vector<float> dark_;
};

}  // namespace

CellTables BuildCellTables(const LightField& field, const std::string& name) {
  const auto& g = field.geometry;
  const int n = g.grid.basis.cells;
  const Light light = LightOf(field, name);
  const Matrix factor = CellFactor(g.grid.basis);
  CellTables tables;
  tables.width = g.lattice.width;
  tables.height = g.lattice.height;
  tables.grid_width = g.grid.width + n - 1;
  tables.grid_height = g.grid.height + n - 1;
  tables.exponent.assign(tables.count(), 0);
  tables.sat.resize(tables.sat_size() * tables.count());
  core::ParallelFor(tables.exponent.size(), 1, [&](std::size_t begin, std::size_t end) {
    CellDensity density(g, factor);
    for (std::size_t cell = begin; cell < end; ++cell) {
      const int a = static_cast<int>(cell) % tables.grid_width,
                b = static_cast<int>(cell) / tables.grid_width;
      const double sum = density.Fill(light, a, b);
      const std::span<double> q = density.q();
      if (sum > std::numeric_limits<float>::max())
        throw InputError(
            name,
            fmt::format("the sum of the images of cell {}, {} exceeds the range of float32", a, b),
            "scale the light field down");
      // Half a quantum at least: it rounds to one.
      RaiseLit(q.size(), sum * 0x1p-61, q.data());
      tables.exponent[cell] =
          BuildSummedArea(std::span<const double>(q), sum, tables.width, tables.height,
                          tables.sat.data() + tables.sat_size() * cell);
    }
  });
  return tables;
}

}  // namespace luxfield::preprocess
