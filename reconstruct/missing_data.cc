#include "reconstruct/missing_data.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>

#include "core/error.h"
#include "core/parallel.h"
#include "reconstruct/separable_product.h"

namespace luxfield::reconstruct {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Map = Eigen::Map<const RowMatrix>;

constexpr double kMostMultiplications = 2e11;  // about two minutes of one core

// Pseudo-inverse A^T (A A^T)^-1 of the given rows of the Gram matrix, and (A A^T)^-1.
void InvertRows(const GramAxis& axis, const std::vector<int>& rows, std::vector<double>* inverse,
                std::vector<double>* normal) {
  const Map gram(axis.gram.data(), axis.count, axis.count);
  const RowMatrix a = gram(rows, Eigen::all);
  const RowMatrix q = (a * a.transpose()).llt().solve(RowMatrix::Identity(a.rows(), a.rows()));
  const RowMatrix p = a.transpose() * q;
  inverse->assign(p.data(), p.data() + p.size());
  normal->assign(q.data(), q.data() + q.size());
}

struct Group {  // pixels with the same known set
  std::vector<bool> known;
  std::vector<std::uint32_t> pixels;
};

std::vector<Group> GroupPixels(const std::uint32_t* const* unknown, std::size_t pixels,
                               int images) {
  std::unordered_map<std::string, std::size_t> index;
  std::vector<Group> groups;
  std::string key(static_cast<std::size_t>(images), '0');
  for (std::size_t p = 0; p < pixels; ++p) {
    bool complete = true;
    for (int m = 0; m < images; ++m) {
      key[m] = unknown[m][p] != 0 ? '0' : '1';
      complete &= unknown[m][p] == 0;
    }
    if (complete) continue;
    const auto [entry, inserted] = index.try_emplace(key, groups.size());
    if (inserted) {
      Group& group = groups.emplace_back();
      for (const char c : key) group.known.push_back(c == '1');
    }
    groups[entry->second].pixels.push_back(static_cast<std::uint32_t>(p));
  }
  return groups;
}

struct Images {
  std::size_t pixels;
  int channels;
  const float* const* irradiance;
  const float* const* sigma;
  float* const* coefficients;
  float* const* coefficient_sigma;
};

std::vector<double> Squares(std::vector<double> values) {
  for (double& x : values) x *= x;
  return values;
}

void SolveProduct(const GramSolver& solver, const Group& group, const MinimumNormWeights& weights,
                  const Images& images) {
  using Product = SeparableProduct<double>;
  const int width = solver.u().count, height = solver.v().count;
  const int columns = static_cast<int>(weights.rows_u().size()),
            rows = static_cast<int>(weights.rows_v().size());
  const Product value(weights.inverse_u(), width, columns, weights.inverse_v(), height, rows);
  const Product variance(Squares(weights.inverse_u()), width, columns, Squares(weights.inverse_v()),
                         height, rows);
  const std::size_t total = group.pixels.size() * images.channels;
  core::ParallelFor(total, 8 * Product::kLanes, [&](std::size_t begin, std::size_t end) {
    std::vector<double> in(value.input_size()), scratch(value.scratch_size()),
        out(value.output_size());
    for (std::size_t first = begin; first < end; first += Product::kLanes) {
      const std::size_t lanes = std::min(Product::kLanes, end - first);
      const auto address = [&](std::size_t k) {
        const std::size_t item = first + k;
        return item / group.pixels.size() * images.pixels +
               group.pixels[item % group.pixels.size()];
      };
      const auto gather = [&](const float* const* from, bool square) {
        for (int j = 0; j < rows; ++j)
          for (int i = 0; i < columns; ++i) {
            const float* image = from[weights.rows_v()[j] * width + weights.rows_u()[i]];
            double* to = in.data() + static_cast<std::size_t>(j * columns + i) * Product::kLanes;
            for (std::size_t k = 0; k < lanes; ++k) {
              const double x = image[address(k)];
              to[k] = square ? x * x : x;
            }
          }
      };
      const auto scatter = [&](float* const* to, bool root) {
        for (int m = 0; m < width * height; ++m)
          for (std::size_t k = 0; k < lanes; ++k) {
            const double x = out[m * Product::kLanes + k];
            to[m][address(k)] = static_cast<float>(root ? std::sqrt(x) : x);
          }
      };
      gather(images.irradiance, false);
      value.Apply(in.data(), scratch.data(), out.data());
      scatter(images.coefficients, false);
      gather(images.sigma, true);
      variance.Apply(in.data(), scratch.data(), out.data());
      scatter(images.coefficient_sigma, true);
    }
  });
}

void SolveWithGaps(const GramSolver& solver, const Group& group, const MinimumNormWeights& weights,
                   const Images& images) {
  const int width = solver.u().count, count = solver.count();
  const std::vector<double> dense = weights.Dense();
  const std::size_t columns = weights.rows_u().size(), known = columns * weights.rows_v().size();
  std::vector<bool> gap(known, false);
  for (const int d : weights.gaps()) gap[d] = true;
  std::vector<int> image;  // of each column of the weights
  for (const int j : weights.rows_v())
    for (const int i : weights.rows_u()) image.push_back(j * width + i);
  std::vector<double> e(known), variance(known);
  for (const std::uint32_t pixel : group.pixels)
    for (int channel = 0; channel < images.channels; ++channel) {
      const std::size_t address = channel * images.pixels + pixel;
      for (std::size_t k = 0; k < known; ++k) {
        e[k] = gap[k] ? 0 : images.irradiance[image[k]][address];
        const double sigma = gap[k] ? 0 : images.sigma[image[k]][address];
        variance[k] = sigma * sigma;
      }
      for (int m = 0; m < count; ++m) {
        double sum = 0, squares = 0;
        for (std::size_t k = 0; k < known; ++k) {
          const double weight = dense[m * known + k];
          sum += weight * e[k];
          squares += weight * weight * variance[k];
        }
        images.coefficients[m][address] = static_cast<float>(sum);
        images.coefficient_sigma[m][address] = static_cast<float>(std::sqrt(squares));
      }
    }
}

}  // namespace

MinimumNormWeights::MinimumNormWeights(const GramSolver& solver, const std::vector<bool>& known)
    : width_(solver.u().count), height_(solver.v().count) {
  std::vector<bool> in_u(width_, false), in_v(height_, false);
  for (int m = 0; m < width_ * height_; ++m)
    if (known[m]) in_u[m % width_] = in_v[m / width_] = true;
  for (int i = 0; i < width_; ++i)
    if (in_u[i]) rows_u_.push_back(i);
  for (int j = 0; j < height_; ++j)
    if (in_v[j]) rows_v_.push_back(j);
  if (rows_u_.empty()) return;
  const int columns = static_cast<int>(rows_u_.size()), rows = static_cast<int>(rows_v_.size());
  for (int k = 0; k < columns * rows; ++k)
    if (!known[rows_v_[k / columns] * width_ + rows_u_[k % columns]]) gaps_.push_back(k);
  InvertRows(solver.u(), rows_u_, &inverse_u_, &normal_u_);
  InvertRows(solver.v(), rows_v_, &inverse_v_, &normal_v_);
}

std::vector<double> MinimumNormWeights::Dense() const {
  const int columns = static_cast<int>(rows_u_.size()), rows = static_cast<int>(rows_v_.size());
  const int known = columns * rows, gap_count = static_cast<int>(gaps_.size());
  RowMatrix p(width_ * height_, known);
  for (int j = 0; j < height_; ++j)
    for (int i = 0; i < width_; ++i)
      for (int b = 0; b < rows; ++b)
        for (int a = 0; a < columns; ++a)
          p(j * width_ + i, b * columns + a) =
              inverse_u_[i * columns + a] * inverse_v_[j * rows + b];
  if (gap_count > 0) {
    RowMatrix q_d(gap_count, known);
    for (int d = 0; d < gap_count; ++d)
      for (int b = 0; b < rows; ++b)
        for (int a = 0; a < columns; ++a)
          q_d(d, b * columns + a) = normal_u_[gaps_[d] % columns * columns + a] *
                                    normal_v_[gaps_[d] / columns * rows + b];
    const RowMatrix q_dd = q_d(Eigen::all, gaps_);
    const RowMatrix p_d = p(Eigen::all, gaps_);
    p.noalias() -= p_d * q_dd.llt().solve(q_d);
  }
  return {p.data(), p.data() + p.size()};
}

IncompletePixels SolveIncomplete(const GramSolver& solver, const std::uint32_t* const* unknown,
                                 std::size_t pixels, int channels, const float* const* irradiance,
                                 const float* const* sigma, float* const* coefficients,
                                 float* const* coefficient_sigma) {
  const Images images{pixels, channels, irradiance, sigma, coefficients, coefficient_sigma};
  const std::vector<Group> groups = GroupPixels(unknown, pixels, solver.count());
  IncompletePixels result;
  std::vector<const Group*> products, gapped;
  double multiplications = 0;
  for (const Group& group : groups) {
    result.incomplete += group.pixels.size();
    const MinimumNormWeights weights(solver, group.known);
    if (weights.rows_u().empty()) {
      result.unknown += group.pixels.size();
      for (int m = 0; m < solver.count(); ++m)
        for (const std::uint32_t pixel : group.pixels)
          for (int channel = 0; channel < channels; ++channel)
            coefficients[m][channel * pixels + pixel] =
                coefficient_sigma[m][channel * pixels + pixel] = 0;
    } else if (weights.is_product()) {
      products.push_back(&group);
    } else {
      result.with_gaps += group.pixels.size();
      gapped.push_back(&group);
      const double known = static_cast<double>(weights.rows_u().size() * weights.rows_v().size());
      const double gap_count = static_cast<double>(weights.gaps().size());
      multiplications +=
          known * (gap_count * gap_count + solver.count() * (gap_count + 1.0)) +
          2.0 * known * solver.count() * static_cast<double>(group.pixels.size() * channels);
    }
  }
  if (multiplications > kMostMultiplications)
    throw InputError(
        fmt::format("{} pixels miss filter positions in {} different ways that are not whole rows "
                    "and columns, too many to solve "
                    "densely ({:.1e} multiplications); use a sensor that covers the lattice, or a "
                    "smaller lattice",
                    result.with_gaps, gapped.size(), multiplications));

  for (const Group* group : products)
    SolveProduct(solver, *group, MinimumNormWeights(solver, group->known), images);
  core::ParallelFor(gapped.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t g = begin; g < end; ++g)
      SolveWithGaps(solver, *gapped[g], MinimumNormWeights(solver, gapped[g]->known), images);
  });
  return result;
}

}  // namespace luxfield::reconstruct
