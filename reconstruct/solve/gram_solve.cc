#include "luxfield/reconstruct/solve/gram_solve.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/reconstruct/bracket/simd.h"
#include "luxfield/reconstruct/solve/separable_product.h"

namespace luxfield::reconstruct {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

static_assert(lightfield::Basis::kMaxCells <= 3, "the sweeps below hold two bands");

// Pixels that travel together. 345 images x 128 floats are 177 kB: both sweeps stay in the
// second-level cache, and every image is read in pieces of 8 cache lines.
constexpr std::size_t kLanes = 128;

[[noreturn]] void FailSingular(const RowMatrix& gram, const std::string& axis, double condition) {
  const int count = static_cast<int>(gram.rows());
  for (int i = 0; i < count; ++i)
    for (int m = i + 1; m < count; ++m)
      if (gram(i, m) * gram(i, m) >= (1 - 1e-9) * gram(i, i) * gram(m, m))
        throw InputError(
            fmt::format("filters {} and {} along {} sit in one place: the Gram matrix is singular; "
                        "move or drop one of them",
                        i, m, axis));
  throw InputError(
      fmt::format("the Gram matrix along {} is singular (condition number {:.3g}, at most {:.0e} "
                  "can be solved); "
                  "space the filters by their basis' spacing",
                  axis, condition, kLargestCondition));
}

// The factor of one axis in the arithmetic of the sweep.
template <typename T>
struct Bands {
  int count;
  std::vector<T> d, e, f;  // reciprocal diagonal, first band, second band; two zeros behind e and f
                           // end the backward sweep
  int moments;
  std::vector<T> integrals, correction;

  explicit Bands(const GramAxis& axis)
      : count(axis.count),
        d(axis.reciprocal_diagonal.begin(), axis.reciprocal_diagonal.end()),
        e(axis.first_band.begin(), axis.first_band.end()),
        f(axis.second_band.begin(), axis.second_band.end()),
        moments(axis.moments),
        integrals(axis.integrals.begin(), axis.integrals.end()),
        correction(axis.correction.begin(), axis.correction.end()) {
    e.resize(count + 2);
    f.resize(count + 2);
  }
};

template <typename In, typename Out, typename T>
LUXFIELD_INLINE void Eliminate(const In* in, T d, T e, const T* y, T f, const T* z, Out* out) {
  LUXFIELD_INDEPENDENT
  for (std::size_t k = 0; k < kLanes; ++k)
    out[k] = static_cast<Out>((static_cast<T>(in[k]) - e * y[k] - f * z[k]) * d);
}

// x_i += sum_k A_ik sum_n Z_nk x_n along an axis, x_i at x + i * stride.
template <typename T>
LUXFIELD_INLINE void CorrectMoments(const Bands<T>& axis, T* x, std::size_t stride) {
  alignas(64) T moment[kMostMoments][kLanes] = {};
  for (int n = 0; n < axis.count; ++n)
    for (int k = 0; k < axis.moments; ++k) {
      const T z = axis.correction[n * axis.moments + k];
      const T* from = x + n * stride;
      for (std::size_t lane = 0; lane < kLanes; ++lane) moment[k][lane] += z * from[lane];
    }
  for (int i = 0; i < axis.count; ++i)
    for (int k = 0; k < axis.moments; ++k) {
      const T a = axis.integrals[i * axis.moments + k];
      T* to = x + i * stride;
      for (std::size_t lane = 0; lane < kLanes; ++lane) to[lane] += a * moment[k][lane];
    }
}

// One block of kLanes pixels: in[m] -> out[m], through `work` (count x kLanes). Loads ride on the
// forward sweep along u, stores on the backward sweep along v.
template <typename Storage, typename T>
LUXFIELD_INLINE void SolveBlock(const Bands<T>& u, const Bands<T>& v, const Storage* const* in,
                                std::size_t offset, T* __restrict work, Storage* const* out) {
  alignas(64) const T zero[kLanes] = {};
  const int width = u.count, height = v.count;
  for (int j = 0; j < height; ++j) {
    T* row = work + static_cast<std::size_t>(j) * width * kLanes;
    if (u.moments > 0) {
      for (int i = 0; i < width; ++i)
        std::copy_n(in[j * width + i] + offset, kLanes, row + i * kLanes);
      CorrectMoments(u, row, kLanes);
    }
    for (int i = 0; i < width; ++i) {
      T* x = row + i * kLanes;
      const T* before = i > 0 ? x - kLanes : zero;
      const T* second = i > 1 ? x - 2 * kLanes : zero;
      if (u.moments > 0)
        Eliminate(x, u.d[i], u.e[i], before, u.f[i], second, x);
      else
        Eliminate(in[j * width + i] + offset, u.d[i], u.e[i], before, u.f[i], second, x);
    }
    for (int i = width - 1; i >= 0; --i) {
      T* x = row + i * kLanes;
      Eliminate(x, u.d[i], u.e[i + 1], i + 1 < width ? x + kLanes : zero, u.f[i + 2],
                i + 2 < width ? x + 2 * kLanes : zero, x);
    }
  }
  const std::size_t stride = static_cast<std::size_t>(width) * kLanes;
  for (int i = 0; i < width; ++i) {
    T* column = work + i * kLanes;
    if (v.moments > 0) CorrectMoments(v, column, stride);
    for (int j = 0; j < height; ++j) {
      T* x = column + j * stride;
      Eliminate(x, v.d[j], v.e[j], j > 0 ? x - stride : zero, v.f[j], j > 1 ? x - 2 * stride : zero,
                x);
    }
    for (int j = height - 1; j >= 0; --j) {
      T* x = column + j * stride;
      Eliminate(x, v.d[j], v.e[j + 1], j + 1 < height ? x + stride : zero, v.f[j + 2],
                j + 2 < height ? x + 2 * stride : zero, x);
      std::copy_n(x, kLanes, out[j * width + i] + offset);
      // The next block: 345 streams are too many for the hardware's prefetcher.
      for (std::size_t k = 0; k < kLanes; k += 64 / sizeof(Storage))
        __builtin_prefetch(in[j * width + i] + offset + kLanes + k);
    }
  }
}

// Multiversioned entry points; templates cannot be.
#define LUXFIELD_SOLVE_ENTRY(Storage, Work)                                                 \
  LUXFIELD_SIMD_CLONES void Sweep(const Bands<Work>& u, const Bands<Work>& v,               \
                                  const Storage* const* in, std::size_t offset, Work* work, \
                                  Storage* const* out) {                                    \
    SolveBlock(u, v, in, offset, work, out);                                                \
  }
LUXFIELD_SOLVE_ENTRY(float, float)
LUXFIELD_SOLVE_ENTRY(float, double)
LUXFIELD_SOLVE_ENTRY(double, double)
#undef LUXFIELD_SOLVE_ENTRY

}  // namespace

GramAxis GramAxis::Factor(std::vector<double> gram, int count, const std::string& axis) {
  if (count < 1 || gram.size() != static_cast<std::size_t>(count) * count)
    throw InputError(fmt::format("the Gram matrix along {} has {} entries for {} filters", axis,
                                 gram.size(), count));
  const Eigen::Map<const RowMatrix> g(gram.data(), count, count);
  if (!g.allFinite())
    throw InputError(
        fmt::format("the Gram matrix along {} holds a value that is not finite", axis));
  const double largest = g.cwiseAbs().maxCoeff();
  if (!(g - g.transpose()).isZero(1e-12 * largest))
    throw InputError(fmt::format("the Gram matrix along {} is not symmetric", axis));
  GramAxis result;
  result.count = count;
  const Eigen::SelfAdjointEigenSolver<RowMatrix> eigen(g);
  result.smallest_eigenvalue = eigen.eigenvalues()(0);
  result.largest_eigenvalue = eigen.eigenvalues()(count - 1);
  if (!(result.smallest_eigenvalue * kLargestCondition > result.largest_eigenvalue))
    FailSingular(g, axis, std::abs(result.largest_eigenvalue / result.smallest_eigenvalue));
  for (int i = 0; i < count; ++i)
    for (int m = i + 3; m < count; ++m)
      if (std::abs(g(i, m)) > 1e-12 * largest)
        throw InputError(
            fmt::format("filters {} and {} along {} overlap, which spacing and basis do not allow",
                        i, m, axis));

  const Eigen::LLT<RowMatrix> cholesky(g);
  const RowMatrix l = cholesky.matrixL();
  const RowMatrix inverse = cholesky.solve(RowMatrix::Identity(count, count));
  result.inverse.assign(inverse.data(), inverse.data() + inverse.size());
  result.map = result.inverse;
  for (int i = 0; i < count; ++i) {
    result.reciprocal_diagonal.push_back(1 / l(i, i));
    result.first_band.push_back(i > 0 ? l(i, i - 1) : 0);
    result.second_band.push_back(i > 1 ? l(i, i - 2) : 0);
  }
  result.gram = std::move(gram);
  return result;
}

void GramAxis::KeepMoments(const AxisMoments& kept) {
  moments = kept.moments;
  integrals = kept.integrals;
  correction.clear();
  map = inverse;
  if (moments == 0) return;
  if (moments > std::min(count, kMostMoments) || kept.count != count)
    throw InputError(fmt::format("{} filters along an axis cannot keep {} moments of {} filters",
                                 count, moments, kept.count));
  const Eigen::Map<const RowMatrix> g_inverse(inverse.data(), count, count),
      a(integrals.data(), count, moments), measured(kept.measured.data(), count, moments);
  const RowMatrix x = g_inverse * a, s = a.transpose() * x;
  const RowMatrix z = s.ldlt().solve((measured - x).transpose()).transpose();
  correction.assign(z.data(), z.data() + z.size());
  Eigen::Map<RowMatrix>(map.data(), count, count) += x * z.transpose();
}

double GramAxis::noise_gain() const {
  double sum = 0;
  for (const double x : map) sum += x * x;
  return std::sqrt(sum / count);
}

double GramAxis::worst_gain() const {
  if (moments == 0) return 1 / smallest_eigenvalue;
  const Eigen::Map<const RowMatrix> r(map.data(), count, count);
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<RowMatrix>(r.transpose() * r).eigenvalues()(count - 1));
}

GramSolver::GramSolver(const lightfield::BasisGrid& grid, KeptMoments kept)
    : GramSolver(GramAxis::Factor(lightfield::GramMatrix(grid.basis, grid.width, grid.spacing_m),
                                  grid.width, "u"),
                 GramAxis::Factor(lightfield::GramMatrix(grid.basis, grid.height, grid.spacing_m),
                                  grid.height, "v")) {
  u_.KeepMoments(MomentsAlong(grid.basis, grid.width, grid.spacing_m, kept.u));
  v_.KeepMoments(MomentsAlong(grid.basis, grid.height, grid.spacing_m, kept.v));
}

GramSolver::GramSolver(GramAxis u, GramAxis v) : u_(std::move(u)), v_(std::move(v)) {
  if (!(condition() <= kLargestCondition))
    throw InputError(fmt::format(
        "the filters cannot be told apart (condition number {:.3g}: {:.3g} along u times {:.3g} "
        "along v, at most {:.0e} can be solved); leave out the outer filters if a border clips "
        "most of their supports, else space them by their basis' spacing",
        condition(), u_.condition(), v_.condition(), kLargestCondition));
}

template <typename Storage, typename Work>
void GramSolver::Solve(const Storage* const* irradiance, Storage* const* coefficients,
                       std::size_t pixels) const {
  const Bands<Work> u(u_), v(v_);
  const std::size_t images = static_cast<std::size_t>(count());
  const std::size_t blocks = (pixels + kLanes - 1) / kLanes;
  core::ParallelFor(blocks, 16, [&](std::size_t begin, std::size_t end) {
    std::vector<Work> work(images * kLanes);
    for (std::size_t block = begin; block < end; ++block) {
      const std::size_t first = block * kLanes;
      if (first + kLanes <= pixels) {
        Sweep(u, v, irradiance, first, work.data(), coefficients);
        continue;
      }
      // The last pixels: padded with zeros to a whole block.
      const std::size_t rest = pixels - first;
      std::vector<Storage> padded(images * kLanes);
      std::vector<Storage*> lanes(images);
      for (std::size_t m = 0; m < images; ++m) {
        lanes[m] = padded.data() + m * kLanes;
        std::copy_n(irradiance[m] + first, rest, lanes[m]);
      }
      Sweep(u, v, lanes.data(), 0, work.data(), lanes.data());
      for (std::size_t m = 0; m < images; ++m) std::copy_n(lanes[m], rest, coefficients[m] + first);
    }
  });
}

template void GramSolver::Solve<float, float>(const float* const*, float* const*,
                                              std::size_t) const;
template void GramSolver::Solve<float, double>(const float* const*, float* const*,
                                               std::size_t) const;
template void GramSolver::Solve<double, double>(const double* const*, double* const*,
                                                std::size_t) const;

void GramSolver::SolveTransposed(const double* const* coefficient_weights, double* const* weights,
                                 std::size_t pixels) const {
  using Product = SeparableProduct<double>;
  const auto transposed = [](const GramAxis& axis) {
    std::vector<double> result(axis.map.size());
    for (int i = 0; i < axis.count; ++i)
      for (int m = 0; m < axis.count; ++m)
        result[m * axis.count + i] = axis.map[i * axis.count + m];
    return result;
  };
  const Product product(transposed(u_), u_.count, u_.count, transposed(v_), v_.count, v_.count);
  const std::size_t images = static_cast<std::size_t>(count());
  core::ParallelFor(pixels, 8 * Product::kLanes, [&](std::size_t begin, std::size_t end) {
    std::vector<double> in(product.input_size()), scratch(product.scratch_size()),
        out(product.output_size());
    for (std::size_t first = begin; first < end; first += Product::kLanes) {
      const std::size_t lanes = std::min(Product::kLanes, end - first);
      for (std::size_t m = 0; m < images; ++m)
        std::copy_n(coefficient_weights[m] + first, lanes, in.data() + m * Product::kLanes);
      product.Apply(in.data(), scratch.data(), out.data());
      for (std::size_t m = 0; m < images; ++m)
        std::copy_n(out.data() + m * Product::kLanes, lanes, weights[m] + first);
    }
  });
}

void GramSolver::Forward(const double* coefficients, double* irradiance) const {
  const Eigen::Map<const RowMatrix> gu(u_.gram.data(), u_.count, u_.count),
      gv(v_.gram.data(), v_.count, v_.count);
  // Row j, column i: E^T = G_v C^T G_u.
  const Eigen::Map<const RowMatrix> c(coefficients, v_.count, u_.count);
  Eigen::Map<RowMatrix>(irradiance, v_.count, u_.count).noalias() = gv * c * gu;
}

}  // namespace luxfield::reconstruct
