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
  // R_v^T q, then that times R_u, for all texels of the row at once.
  std::vector<double> along_v(geometry_.grid.count() * n, 0.0), both(n);
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const double* from = q(geometry_.grid.index(i, j));
      if (std::all_of(from, from + n, [](double x) { return x == 0; })) continue;
      for (int to = 0; to < height; ++to) {
        const double factor = maps_.v[j * height + to];
        double* sum = &along_v[geometry_.grid.index(i, to) * n];
        for (std::size_t k = 0; k < n; ++k) sum[k] += factor * from[k];
      }
    }
  for (int j = 0; j < height; ++j)
    for (int to = 0; to < width; ++to) {
      std::fill(both.begin(), both.end(), 0.0);
      for (int i = 0; i < width; ++i) {
        const double factor = maps_.u[i * width + to];
        const double* from = &along_v[geometry_.grid.index(i, j) * n];
        for (std::size_t k = 0; k < n; ++k) both[k] += factor * from[k];
      }
      put(geometry_.grid.index(to, j), both.data(), false);
    }
  return whitened;
}

}  // namespace luxfield::photometry
