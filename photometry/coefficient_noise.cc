#include "luxfield/photometry/coefficient_noise.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "luxfield/core/error.h"

namespace luxfield::photometry {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Matrix SquaredInverse(const std::vector<double>& map, int count) {
  Matrix squared = Eigen::Map<const Matrix>(map.data(), count, count);
  // Scaled, so that metres and micrometres are alike to the factorisation.
  squared /= squared.cwiseAbs().maxCoeff();
  return squared.cwiseProduct(squared).inverse();
}

double LargestSquare(const std::vector<double>& map) {
  double largest = 0;
  for (const double x : map) largest = std::max(largest, std::abs(x));
  return largest * largest;
}

// R^T x, x[i * size + k]; x itself without a map.
std::vector<double> Mapped(const std::vector<double>& map, int count, const std::vector<double>& x,
                           std::size_t size) {
  if (map.empty()) return x;
  std::vector<double> mapped(x.size(), 0.0);
  for (int from = 0; from < count; ++from)
    for (int to = 0; to < count; ++to) {
      const double factor = map[std::size_t(from) * count + to];
      for (std::size_t k = 0; k < size; ++k) mapped[to * size + k] += factor * x[from * size + k];
    }
  return mapped;
}

// Where values are not 0.
struct Stretch {
  std::size_t begin = 0, end = 0;
};
Stretch NotZeroOf(const double* values, std::size_t count) {
  Stretch stretch{0, count};
  while (stretch.end > 0 && values[stretch.end - 1] == 0) --stretch.end;
  while (stretch.begin < stretch.end && values[stretch.begin] == 0) ++stretch.begin;
  return stretch;
}

// How far below zero, of the largest in its texel, rounding of sigma to float may bring a variance.
constexpr double kRounding = 1e-4;

}  // namespace

CoefficientNoise::CoefficientNoise(const lightfield::LightField& sigma, SolveMaps maps)
    : geometry_(sigma.geometry), maps_(std::move(maps)), sigma_(sigma.data) {
  const auto& grid = geometry_.grid;
  const auto square = [](int n) { return static_cast<std::size_t>(n) * n; };
  if (geometry_.channels != 1 || (!maps_.independent() && (maps_.u.size() != square(grid.width) ||
                                                           maps_.v.size() != square(grid.height))))
    throw std::invalid_argument("CoefficientNoise: one channel, and maps of the grid's size");
  for (const float value : sigma_)
    if (!(value >= 0))
      throw InputError(fmt::format(
          "sigma(C) holds {}, which is no standard deviation; name the file that `luxfield "
          "reconstruct --sigma` wrote",
          value));
  independent_.assign(geometry_.plane_size(), 0);
  if (!maps_.independent()) FindIrradianceSigma();
}

void CoefficientNoise::FindIrradianceSigma() {
  const int width = geometry_.grid.width, height = geometry_.grid.height;
  const Matrix inverse_u = SquaredInverse(maps_.u, width),
               inverse_v = SquaredInverse(maps_.v, height);
  const double scale = LargestSquare(maps_.u) * LargestSquare(maps_.v);
  const std::size_t texels = geometry_.plane_size();
  Matrix variance(height, width);
  for (std::size_t texel = 0; texel < texels; ++texel) {
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i) {
        const double s = sigma_[geometry_.grid.index(i, j) * texels + texel];
        variance(j, i) = s * s;
      }
    const Matrix found = inverse_v * variance * inverse_u.transpose();
    if (found.minCoeff() < -kRounding * found.cwiseAbs().maxCoeff()) {
      independent_[texel] = true;
      ++independent_texels_;
      continue;
    }
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i)
        sigma_[geometry_.grid.index(i, j) * texels + texel] =
            static_cast<float>(std::sqrt(std::max(0.0, found(j, i)) / scale));
  }
}

double CoefficientNoise::Variance(const TexelWindow& window,
                                  std::span<const double> weights) const {
  double variance = 0;
  for (int row = 0; row < window.rows; ++row)
    for (const double x : WhitenedRow(window, weights, row)) variance += x * x;
  return variance;
}

double CoefficientNoise::Variance(const TexelWindow& window,
                                  std::span<const SeparableWeights> terms) const {
  const int width = geometry_.grid.width, height = geometry_.grid.height;
  const auto columns = static_cast<std::size_t>(window.columns),
             rows = static_cast<std::size_t>(window.rows), texels = geometry_.plane_size();
  std::vector<SeparableWeights> mapped;
  for (const SeparableWeights& term : terms)
    mapped.push_back(
        {Mapped(maps_.u, width, term.x, columns), Mapped(maps_.v, height, term.y, rows)});
  std::vector<double> weights(columns), own(columns);
  const auto fill = [&](std::span<const SeparableWeights> from, std::size_t i, std::size_t j,
                        std::size_t row, std::vector<double>* to) {
    std::fill(to->begin(), to->end(), 0.0);
    for (const auto& [x, y] : from) {
      const double factor = y[j * rows + row];
      const double* along = &x[i * columns];
      for (std::size_t k = 0; k < columns; ++k) (*to)[k] += factor * along[k];
    }
  };
  double variance = 0;
  for (std::size_t j = 0; j < std::size_t(height); ++j)
    for (std::size_t i = 0; i < std::size_t(width); ++i)
      for (std::size_t row = 0; row < rows; ++row) {
        const std::size_t first =
            (window.row0 + row) * geometry_.lattice.width + std::size_t(window.column0);
        const float* sigma = &sigma_[(j * width + i) * texels + first];
        fill(mapped, i, j, row, &weights);
        if (independent_texels_ > 0) {
          fill(terms, i, j, row, &own);
          for (std::size_t k = 0; k < columns; ++k)
            if (independent_[first + k]) weights[k] = own[k];
        }
        double sum = 0;
        for (std::size_t k = 0; k < columns; ++k) {
          const double draw = weights[k] * double{sigma[k]};
          sum += draw * draw;
        }
        variance += sum;
      }
  return variance;
}

std::vector<double> CoefficientNoise::Whitened(const TexelWindow& window,
                                               std::span<const double> weights) const {
  std::vector<double> whitened(weights.size());
  for (int row = 0; row < window.rows; ++row) {
    const auto own = WhitenedRow(window, weights, row);
    for (int m = 0; m < geometry_.grid.count(); ++m)
      std::copy_n(&own[std::size_t(m) * window.columns], window.columns,
                  &whitened[(std::size_t(m) * window.rows + row) * window.columns]);
  }
  return whitened;
}

std::vector<double> CoefficientNoise::WhitenedRow(const TexelWindow& window,
                                                  std::span<const double> weights, int row) const {
  const int width = geometry_.grid.width, height = geometry_.grid.height;
  const auto n = static_cast<std::size_t>(window.columns);
  const std::size_t texels = geometry_.plane_size(),
                    first = static_cast<std::size_t>(window.row0 + row) * geometry_.lattice.width +
                            window.column0;
  const auto q = [&](int m) { return &weights[(std::size_t(m) * window.rows + row) * n]; };
  std::vector<double> whitened(geometry_.grid.count() * n);
  const auto put = [&](int m, const double* w, bool independent) {
    for (std::size_t k = 0; k < n; ++k)
      if (maps_.independent() || (independent_[first + k] != 0) == independent)
        whitened[m * n + k] = w[k] * sigma_[m * texels + first + k];
  };
  if (maps_.independent() || independent_texels_ > 0)
    for (int m = 0; m < geometry_.grid.count(); ++m) put(m, q(m), true);
  if (maps_.independent()) return whitened;
  // R_v^T q, then that times R_u, for all texels of the row at once that a column of filters sees.
  std::vector<double> along_v(geometry_.grid.count() * n, 0.0), both(n);
  std::vector<Stretch> seen(width, {n, 0});
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const double* from = q(geometry_.grid.index(i, j));
      const auto [begin, end] = NotZeroOf(from, n);
      if (begin == end) continue;
      seen[i] = {std::min(seen[i].begin, begin), std::max(seen[i].end, end)};
      for (int to = 0; to < height; ++to) {
        const double factor = maps_.v[j * height + to];
        double* sum = &along_v[geometry_.grid.index(i, to) * n];
        for (std::size_t k = begin; k < end; ++k) sum[k] += factor * from[k];
      }
    }
  for (int j = 0; j < height; ++j)
    for (int to = 0; to < width; ++to) {
      std::fill(both.begin(), both.end(), 0.0);
      for (int i = 0; i < width; ++i) {
        const double factor = maps_.u[i * width + to];
        const double* from = &along_v[geometry_.grid.index(i, j) * n];
        for (std::size_t k = seen[i].begin; k < seen[i].end; ++k) both[k] += factor * from[k];
      }
      put(geometry_.grid.index(to, j), both.data(), false);
    }
  return whitened;
}

}  // namespace luxfield::photometry
