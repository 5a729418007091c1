#include "luxfield/reconstruct/solve/missing_data.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/reconstruct/solve/separable_product.h"

namespace luxfield::reconstruct {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Map = Eigen::Map<const RowMatrix>;

constexpr double kMostMultiplications = 2e11;  // about two minutes of one core

// Pseudo-inverse A^T (A A^T)^-1 of the given rows A of a square matrix, and (A A^T)^-1.
void InvertRows(const std::vector<double>& matrix, int size, const std::vector<int>& rows,
                std::vector<double>* inverse, std::vector<double>* normal) {
  const RowMatrix a = Map(matrix.data(), size, size)(rows, Eigen::all);
  RowMatrix p, q;
  if (a.rows() == size) {  // without squaring the condition number
    p = a.partialPivLu().inverse();
    q = p.transpose() * p;
  } else {
    q = (a * a.transpose()).llt().solve(RowMatrix::Identity(a.rows(), a.rows()));
    p = a.transpose() * q;
  }
  inverse->assign(p.data(), p.data() + p.size());
  normal->assign(q.data(), q.data() + q.size());
}

std::vector<double> Squares(std::vector<double> values) {
  for (double& x : values) x *= x;
  return values;
}

void SolveProduct(const SeparableSystem& system, const PixelGroup& group,
                  const MinimumNormWeights& weights, const PixelImages& images) {
  using Product = SeparableProduct<double>;
  const int width = system.width, height = system.height;
  const int columns = static_cast<int>(weights.rows_u().size()),
            rows = static_cast<int>(weights.rows_v().size());
  const Product value(weights.inverse_u(), width, columns, weights.inverse_v(), height, rows);
  const Product variance(Squares(weights.inverse_u()), width, columns, Squares(weights.inverse_v()),
                         height, rows);
  const std::vector<double> prior_share = weights.PriorShare();
  const double rank = static_cast<double>(rows) * columns;
  const std::size_t total = group.pixels.size() * images.channels;
  core::ParallelFor(total, 8 * Product::kLanes, [&](std::size_t begin, std::size_t end) {
    std::vector<double> in(value.input_size()), scratch(value.scratch_size()),
        out(value.output_size()), tau2(Product::kLanes);
    for (std::size_t first = begin; first < end; first += Product::kLanes) {
      const std::size_t lanes = std::min(Product::kLanes, end - first);
      const auto address = [&](std::size_t k) {
        const std::size_t item = first + k;
        return item / group.pixels.size() * images.pixels +
               group.pixels[item % group.pixels.size()];
      };
      const auto gather = [&](std::span<const float* const> from, bool square) {
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
      gather(images.irradiance, false);
      value.Apply(in.data(), scratch.data(), out.data());
      std::fill(tau2.begin(), tau2.end(), 0.0);
      for (int m = 0; m < width * height; ++m)
        for (std::size_t k = 0; k < lanes; ++k) {
          const double c = out[m * Product::kLanes + k];
          tau2[k] += c * c / rank;
          images.coefficients[m][address(k)] = static_cast<float>(c);
        }
      gather(images.sigma, true);
      variance.Apply(in.data(), scratch.data(), out.data());
      for (int m = 0; m < width * height; ++m)
        for (std::size_t k = 0; k < lanes; ++k)
          images.coefficient_sigma[m][address(k)] = static_cast<float>(
              std::sqrt(out[m * Product::kLanes + k] + tau2[k] * prior_share[m]));
    }
  });
}

[[noreturn]] void FailTooManySets(std::size_t pixels, std::size_t sets, double multiplications) {
  throw InputError(fmt::format(
      "{} pixels miss filter positions in {} different ways that are not whole rows and "
      "columns, too many to solve densely ({:.1e} multiplications); use a sensor that "
      "covers the lattice, or a smaller lattice",
      pixels, sets, multiplications));
}

}  // namespace

SeparableSystem GramSystem(const GramSolver& solver) {
  return {solver.u().count, solver.v().count, solver.u().gram, solver.v().gram};
}

MinimumNormWeights::MinimumNormWeights(const SeparableSystem& system,
                                       const std::vector<bool>& known)
    : system_(system), width_(system.width), height_(system.height) {
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
  InvertRows(system.u, width_, rows_u_, &inverse_u_, &normal_u_);
  InvertRows(system.v, height_, rows_v_, &inverse_v_, &normal_v_);
}

std::vector<double> MinimumNormWeights::PriorShare() const {
  // Diagonal of the axis' projection on its known rows.
  const auto determined = [](const std::vector<double>& inverse, const std::vector<double>& matrix,
                             const std::vector<int>& rows, int size) {
    std::vector<double> diagonal(size, 0.0);
    for (int i = 0; i < size; ++i)
      for (std::size_t k = 0; k < rows.size(); ++k)
        diagonal[i] += inverse[i * rows.size() + k] * matrix[rows[k] * size + i];
    return diagonal;
  };
  const auto u = determined(inverse_u_, system_.u, rows_u_, width_),
             v = determined(inverse_v_, system_.v, rows_v_, height_);
  std::vector<double> share;
  for (int j = 0; j < height_; ++j)
    for (int i = 0; i < width_; ++i) share.push_back(std::clamp(1 - u[i] * v[j], 0.0, 1.0));
  return share;
}

PixelWeights MinimumNormWeights::Dense() const {
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

  PixelWeights result;
  std::vector<int> kept;  // columns of p that are known
  for (int k = 0; k < known; ++k)
    if (!std::binary_search(gaps_.begin(), gaps_.end(), k)) {
      kept.push_back(k);
      result.known.push_back(rows_v_[k / columns] * width_ + rows_u_[k % columns]);
    }
  result.rank = static_cast<int>(kept.size());
  const RowMatrix weights = p(Eigen::all, kept);
  result.weights.assign(weights.data(), weights.data() + weights.size());
  for (int m = 0; m < width_ * height_; ++m) {
    double determined = 0;
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const int row = result.known[k];
      determined += weights(m, static_cast<Eigen::Index>(k)) *
                    system_.u[row % width_ * width_ + m % width_] *
                    system_.v[row / width_ * height_ + m / width_];
    }
    result.prior_share.push_back(std::clamp(1 - determined, 0.0, 1.0));
  }
  return result;
}

IncompletePixels SolveIncomplete(const SeparableSystem& system,
                                 std::span<const std::uint32_t* const> unknown,
                                 const PixelImages& images, bool with_complete) {
  const std::vector<PixelGroup> groups = GroupPixels(unknown, images.pixels, with_complete);
  const double count = static_cast<double>(system.width) * system.height;
  IncompletePixels result;
  std::vector<const PixelGroup*> products, gapped;
  std::span<const std::uint32_t> empty;
  double multiplications = 0;
  for (const PixelGroup& group : groups) {
    if (std::find(group.known.begin(), group.known.end(), false) != group.known.end())
      result.incomplete += group.pixels.size();
    const MinimumNormWeights weights(system, group.known);
    if (weights.rows_u().empty()) {
      result.unknown = group.pixels.size();
      empty = group.pixels;
    } else if (weights.is_product()) {
      products.push_back(&group);
    } else {
      result.with_gaps += group.pixels.size();
      gapped.push_back(&group);
      const double known = static_cast<double>(weights.rows_u().size() * weights.rows_v().size());
      const double gap_count = static_cast<double>(weights.gaps().size());
      multiplications +=
          known * (gap_count * gap_count + count * (gap_count + 1.0)) +
          2.0 * known * count * static_cast<double>(group.pixels.size() * images.channels);
    }
  }
  if (multiplications > kMostMultiplications)
    FailTooManySets(result.with_gaps, gapped.size(), multiplications);

  for (const PixelGroup* group : products)
    SolveProduct(system, *group, MinimumNormWeights(system, group->known), images);
  core::ParallelFor(gapped.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t g = begin; g < end; ++g)
      ApplyWeights(MinimumNormWeights(system, gapped[g]->known).Dense(), gapped[g]->pixels, images);
  });
  FillUnknown(empty, images);
  return result;
}

}  // namespace luxfield::reconstruct
