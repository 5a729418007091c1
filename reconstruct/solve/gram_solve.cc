#include "luxfield/reconstruct/solve/gram_solve.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/simd.h"
#include "luxfield/reconstruct/solve/separable_product.h"

namespace luxfield::reconstruct {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

static_assert(lightfield::Basis::kMaxCells <= 3, "the sweeps below hold two bands");

// A register of pixels, swept together: all images of one, 345 x 64 bytes, stay in the first-level
// cache from sweep to sweep.
constexpr std::size_t kRegisterBytes = 64;
template <typename T>
struct alignas(kRegisterBytes) Register {  // vectors alone are aligned as the baseline asks
  typedef T Lanes __attribute__((vector_size(kRegisterBytes)));
  Lanes lanes;
};
template <typename T>
using Lanes = typename Register<T>::Lanes;
template <typename T>
constexpr std::size_t kLanes = kRegisterBytes / sizeof(T);

// A block of pixels, some registers of all images, stays in the second-level cache. It is gathered
// from the images and stored to them in runs that the memory streams; images a power of 2 apart
// would not stay in the cache where they lie.
constexpr std::size_t kBlockBytes = std::size_t{768} << 10;
constexpr std::size_t kMostRegisters = 64;
std::size_t RegistersOfBlock(std::size_t images) {
  return std::clamp(kBlockBytes / (images * kRegisterBytes), std::size_t{1}, kMostRegisters);
}

// Lines of images swept side by side: as many recurrences as hide the latency of each.
constexpr int kLines = 4;

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

// The factor of one axis in the arithmetic of the sweeps, a row of L divided by its diagonal:
//
//   forward    x_i = d_i b_i - e_i x_(i-1) - f_i x_(i-2)
//   backward   x_i = d_i b_i - g_i x_(i+1) - h_i x_(i+2)
template <typename T>
struct Bands {
  int count;
  std::vector<T> d, e, f, g, h;
  int moments;
  std::vector<T> integrals, correction;

  explicit Bands(const GramAxis& axis)
      : count(axis.count),
        d(axis.reciprocal_diagonal.begin(), axis.reciprocal_diagonal.end()),
        e(axis.count),
        f(axis.count),
        g(axis.count),
        h(axis.count),
        moments(axis.moments),
        integrals(axis.integrals.begin(), axis.integrals.end()),
        correction(axis.correction.begin(), axis.correction.end()) {
    const auto& own = axis.reciprocal_diagonal;
    for (int i = 0; i < count; ++i) {
      e[i] = static_cast<T>(own[i] * axis.first_band[i]);
      f[i] = static_cast<T>(own[i] * axis.second_band[i]);
      if (i + 1 < count) g[i] = static_cast<T>(own[i] * axis.first_band[i + 1]);
      if (i + 2 < count) h[i] = static_cast<T>(own[i] * axis.second_band[i + 2]);
    }
  }
};

// As many values as a register of T takes, anywhere in an array.
template <typename T, typename Storage>
struct StoredOf {
  typedef Storage Type __attribute__((vector_size(kLanes<T> * sizeof(Storage)),
                                      aligned(alignof(Storage)), may_alias));
};

template <typename T, typename Storage>
LUXFIELD_INLINE void Load(const Storage* from, Register<T>* to) {
  using Stored = typename StoredOf<T, Storage>::Type;
  to->lanes = __builtin_convertvector(*reinterpret_cast<const Stored*>(from), Lanes<T>);
}

template <typename T, typename Storage>
LUXFIELD_INLINE void Store(const Register<T>& from, Storage* to) {
  using Stored = typename StoredOf<T, Storage>::Type;
  *reinterpret_cast<Stored*>(to) = __builtin_convertvector(from.lanes, Stored);
}

// Solves along kCount lines of an axis in place: entry i of line l at x[i * stride + l * between].
template <int kCount, typename T>
LUXFIELD_INLINE void SolveSomeLines(const Bands<T>& axis, Register<T>* x, std::size_t stride,
                                    std::size_t between) {
  alignas(kRegisterBytes) Lanes<T> next[kCount] = {}, second[kCount] = {};
  const auto step = [&](int i, T d, T first, T far) __attribute__((always_inline)) {
#pragma GCC unroll 8
    for (int l = 0; l < kCount; ++l) {
      Lanes<T>& entry = x[i * stride + l * between].lanes;
      const Lanes<T> solved = (d * entry - far * second[l]) - first * next[l];
      second[l] = next[l];
      next[l] = entry = solved;
    }
  };
  for (int i = 0; i < axis.count; ++i) step(i, axis.d[i], axis.e[i], axis.f[i]);
#pragma GCC unroll 8
  for (int l = 0; l < kCount; ++l) next[l] = second[l] = Lanes<T>{};
  for (int i = axis.count - 1; i >= 0; --i) step(i, axis.d[i], axis.g[i], axis.h[i]);
}

// The same along `lines` lines.
template <typename T>
LUXFIELD_INLINE void SolveLines(const Bands<T>& axis, int lines, Register<T>* x, std::size_t stride,
                                std::size_t between) {
  int first = 0;
  for (; first + kLines <= lines; first += kLines)
    SolveSomeLines<kLines>(axis, x + first * between, stride, between);
  for (; first < lines; ++first) SolveSomeLines<1>(axis, x + first * between, stride, between);
}

// x_i += sum_k A_ik sum_n Z_nk x_n along a line of an axis.
template <typename T>
LUXFIELD_INLINE void CorrectMoments(const Bands<T>& axis, Register<T>* x, std::size_t stride) {
  alignas(kRegisterBytes) Lanes<T> moment[kMostMoments] = {};
  for (int n = 0; n < axis.count; ++n)
    for (int k = 0; k < axis.moments; ++k)
      moment[k] += axis.correction[n * axis.moments + k] * x[n * stride].lanes;
  for (int i = 0; i < axis.count; ++i)
    for (int k = 0; k < axis.moments; ++k)
      x[i * stride].lanes += axis.integrals[i * axis.moments + k] * moment[k];
}

// Solves a register of pixels in place: entry j * W + i is that of image (i, j).
template <typename T>
LUXFIELD_INLINE void SolveRegister(const Bands<T>& u, const Bands<T>& v, Register<T>* x) {
  const int width = u.count, height = v.count;
  if (u.moments > 0)
    for (int j = 0; j < height; ++j) CorrectMoments(u, x + j * width, 1);
  SolveLines(u, height, x, 1, width);
  if (v.moments > 0)
    for (int i = 0; i < width; ++i) CorrectMoments(v, x + i, width);
  SolveLines(v, width, x, width, 1);
}

// A block of `registers`: in[m] -> out[m] from `offset` on, through `work`.
template <typename Storage, typename T>
LUXFIELD_INLINE void SolveBlock(const Bands<T>& u, const Bands<T>& v, const Storage* const* in,
                                std::size_t offset, std::size_t registers, Register<T>* work,
                                Storage* const* out) {
  const std::size_t images = static_cast<std::size_t>(u.count) * v.count;
  for (std::size_t m = 0; m < images; ++m) {
    const Storage* const next = in[m + 2 < images ? m + 2 : m] + offset;
    for (std::size_t r = 0; r < registers; ++r) {
      __builtin_prefetch(next + r * kLanes<T>);
      Load(in[m] + offset + r * kLanes<T>, &work[r * images + m]);
    }
  }
  for (std::size_t r = 0; r < registers; ++r) SolveRegister(u, v, work + r * images);
  for (std::size_t m = 0; m < images; ++m)
    for (std::size_t r = 0; r < registers; ++r)
      Store(work[r * images + m], out[m] + offset + r * kLanes<T>);
}

// Multiversioned entry points; templates cannot be.
#define LUXFIELD_SOLVE_ENTRY(Storage, Work)                                                     \
  LUXFIELD_SIMD_CLONES void Sweep(                                                              \
      const Bands<Work>& u, const Bands<Work>& v, const Storage* const* in, std::size_t offset, \
      std::size_t registers, Register<Work>* work, Storage* const* out) {                       \
    SolveBlock(u, v, in, offset, registers, work, out);                                         \
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
  const std::size_t registers = RegistersOfBlock(images), block_pixels = registers * kLanes<Work>,
                    blocks = (pixels + block_pixels - 1) / block_pixels;
  core::ParallelFor(blocks, 4, [&](std::size_t begin, std::size_t end) {
    std::vector<Register<Work>> work(images * registers);
    for (std::size_t block = begin; block < end; ++block) {
      const std::size_t first = block * block_pixels;
      if (first + block_pixels <= pixels) {
        Sweep(u, v, irradiance, first, registers, work.data(), coefficients);
        continue;
      }
      // The last pixels: padded with zeros to whole registers.
      const std::size_t rest = pixels - first,
                        rest_registers = (rest + kLanes<Work> - 1) / kLanes<Work>,
                        padded_pixels = rest_registers * kLanes<Work>;
      std::vector<Storage> padded(images * padded_pixels);
      std::vector<Storage*> rows(images);
      for (std::size_t m = 0; m < images; ++m) {
        rows[m] = padded.data() + m * padded_pixels;
        std::copy_n(irradiance[m] + first, rest, rows[m]);
      }
      Sweep(u, v, rows.data(), 0, rest_registers, work.data(), rows.data());
      for (std::size_t m = 0; m < images; ++m) std::copy_n(rows[m], rest, coefficients[m] + first);
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
