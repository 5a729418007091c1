#include "reconstruct/non_negative.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <vector>

#include "core/parallel.h"
#include "reconstruct/simd.h"

namespace luxfield::reconstruct {
namespace {

constexpr std::size_t kLanes =
    32;  // pixels iterated together; a block ends when all of them have converged

template <typename T>
using Lanes = std::array<T, kLanes>;

// The band of one Gram matrix: entry at offset -2 .. 2 of every row, zero outside.
template <typename T>
struct Band {
  int count;
  std::vector<std::array<T, 5>> row;

  explicit Band(const GramAxis& axis) : count(axis.count), row(axis.count) {
    for (int i = 0; i < count; ++i)
      for (int d = -2; d <= 2; ++d)
        row[i][d + 2] =
            i + d >= 0 && i + d < count ? static_cast<T>(axis.gram[i * count + i + d]) : T{0};
  }
};

// The problem in z = C - C_0: minimise z^T G z / 2 over z >= -C_0 and, if keep_flux, sum z = 0.
template <typename T>
struct Workspace {
  std::vector<Lanes<T>> start;    // C_0
  std::vector<Lanes<T>> z, y;     // the iterate and the point of its next gradient
  std::vector<Lanes<T>> along_u;  // G_u times one of them
  std::vector<Lanes<T>> moved;    // one of them after a gradient step
  Lanes<T> threshold{};           // of the last projection
  explicit Workspace(int count) : start(count), z(count), y(count), along_u(count), moved(count) {}
};

// Elements n - 2 .. n + 2 of an axis of `count`, `stride` blocks apart. Beyond the ends the band
// holds zeros, so that any block will do.
template <typename T>
LUXFIELD_INLINE std::array<const T*, 5> Neighbours(const Lanes<T>* middle, int n, int count,
                                                   std::ptrdiff_t stride) {
  std::array<const T*, 5> result;
  for (int d = -2; d <= 2; ++d)
    result[d + 2] = middle[n + d >= 0 && n + d < count ? d * stride : 0].data();
  return result;
}

// moved = from - step G from, and what the projection with the threshold at hand would leave of C:
// its sum and the number of entries above 0.
template <typename T>
LUXFIELD_INLINE void Move(const Band<T>& u, const Band<T>& v, T step,
                          const std::vector<Lanes<T>>& from, Workspace<T>& w, Lanes<T>& sum,
                          Lanes<T>& count) {
  for (int j = 0; j < v.count; ++j)
    for (int i = 0; i < u.count; ++i) {
      const int m = j * u.count + i;
      const auto x = Neighbours(&from[m], i, u.count, 1);
      const std::array<T, 5> g = u.row[i];
      T* const out = w.along_u[m].data();
      LUXFIELD_INDEPENDENT
      for (std::size_t k = 0; k < kLanes; ++k)
        out[k] = g[0] * x[0][k] + g[1] * x[1][k] + g[2] * x[2][k] + g[3] * x[3][k] + g[4] * x[4][k];
    }
  sum.fill(0);
  count.fill(0);
  for (int j = 0; j < v.count; ++j)
    for (int i = 0; i < u.count; ++i) {
      const int m = j * u.count + i;
      const auto x = Neighbours(&w.along_u[m], j, v.count, u.count);
      const std::array<T, 5> g = v.row[j];
      const T *const origin = from[m].data(), *const start = w.start[m].data();
      T* const out = w.moved[m].data();
      LUXFIELD_INDEPENDENT
      for (std::size_t k = 0; k < kLanes; ++k) {
        const T gradient =
            g[0] * x[0][k] + g[1] * x[1][k] + g[2] * x[2][k] + g[3] * x[3][k] + g[4] * x[4][k];
        const T moved = origin[k] - step * gradient;
        const T above = moved + start[k] - w.threshold[k];
        out[k] = moved;
        sum[k] += above > 0 ? above : 0;
        count[k] += above > 0 ? T{1} : T{0};
      }
    }
}

// One step of Newton's method on the convex piecewise linear sum_m max(moved + C_0 - t, 0) =
// target, whose root t is the threshold of the projection on {C >= 0, sum C = target}. Where
// nothing is above t it falls to where one entry could hold all.
template <typename T>
LUXFIELD_INLINE void StepThreshold(const Lanes<T>& target, const Lanes<T>& sum,
                                   const Lanes<T>& count, Workspace<T>& w) {
  Lanes<T> largest;
  largest.fill(-std::numeric_limits<T>::infinity());
  std::uint32_t empty = 0;
  for (std::size_t k = 0; k < kLanes; ++k) empty |= count[k] > 0 ? 0u : 1u;
  if (empty)
    for (std::size_t m = 0; m < w.moved.size(); ++m)
      for (std::size_t k = 0; k < kLanes; ++k) {
        const T c = w.moved[m][k] + w.start[m][k];
        largest[k] = c > largest[k] ? c : largest[k];
      }
  for (std::size_t k = 0; k < kLanes; ++k) {
    const T newton = w.threshold[k] + (sum[k] - target[k]) / count[k];
    const T fall = largest[k] - target[k];
    w.threshold[k] = count[k] > 0 ? newton : fall;
  }
}

// Newton steps until the sum is within `tolerance` of its target before a step, which leaves the
// square of that or nothing.
template <typename T>
LUXFIELD_INLINE void FindThreshold(const Lanes<T>& target, T tolerance, Lanes<T>& sum,
                                   Lanes<T>& count, Workspace<T>& w) {
  constexpr int kMaxSteps = 50;
  constexpr T kRounding = 64 * std::numeric_limits<T>::epsilon();  // of sums of values up to 1
  for (int n = 0; n < kMaxSteps; ++n) {
    std::uint32_t far = 0;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const T off = sum[k] - target[k], size = off < 0 ? -off : off;
      far |= size <= tolerance * target[k] + kRounding ? 0u : 1u;
    }
    StepThreshold(target, sum, count, w);
    if (!far) return;
    sum.fill(0);
    count.fill(0);
    for (std::size_t m = 0; m < w.moved.size(); ++m) {
      LUXFIELD_INDEPENDENT
      for (std::size_t k = 0; k < kLanes; ++k) {
        const T above = w.moved[m][k] + w.start[m][k] - w.threshold[k];
        sum[k] += above > 0 ? above : 0;
        count[k] += above > 0 ? T{1} : T{0};
      }
    }
  }
}

// y -> z' = P(y - step G y), y' = z' + momentum (z' - z). The threshold of P starts from the last
// iteration's, from which one Newton step is nearly always enough.
template <typename T>
LUXFIELD_INLINE void IterateOnce(const Band<T>& u, const Band<T>& v, T step, T momentum,
                                 const Lanes<T>* target, Workspace<T>& w) {
  constexpr T kNear = static_cast<T>(0.01);
  Lanes<T> sum, count;
  Move(u, v, step, w.y, w, sum, count);
  if (target) FindThreshold(*target, kNear, sum, count, w);
  for (std::size_t m = 0; m < w.z.size(); ++m) {
    LUXFIELD_INDEPENDENT
    for (std::size_t k = 0; k < kLanes; ++k) {
      const T start = w.start[m][k];
      const T c = w.moved[m][k] + start - w.threshold[k];
      const T next = c > 0 ? c - start : -start;
      w.y[m][k] = next + momentum * (next - w.z[m][k]);
      w.z[m][k] = next;
    }
  }
}

// Residual of the stopping rule at z, before the division by max |C_0|.
template <typename T>
LUXFIELD_INLINE void ResidualAt(const Band<T>& u, const Band<T>& v, T reciprocal_diagonal,
                                const Lanes<T>* target, Workspace<T>& w, Lanes<T>& residual) {
  const Lanes<T> before = w.threshold;
  Lanes<T> sum, count;
  Move(u, v, reciprocal_diagonal, w.z, w, sum, count);
  if (target) FindThreshold(*target, T{0}, sum, count, w);
  residual.fill(0);
  for (std::size_t m = 0; m < w.z.size(); ++m) {
    LUXFIELD_INDEPENDENT
    for (std::size_t k = 0; k < kLanes; ++k) {
      const T c = w.moved[m][k] + w.start[m][k] - w.threshold[k];
      const T projected = c > 0 ? c - w.start[m][k] : -w.start[m][k];
      const T off = w.z[m][k] - projected, size = off < 0 ? -off : off;
      residual[k] = size > residual[k] ? size : residual[k];
    }
  }
  w.threshold = before;  // of another step length
}

LUXFIELD_SIMD_CLONES void Iterate(const Band<float>& u, const Band<float>& v, float step,
                                  float momentum, const Lanes<float>* target, Workspace<float>& w) {
  IterateOnce(u, v, step, momentum, target, w);
}
LUXFIELD_SIMD_CLONES void Iterate(const Band<double>& u, const Band<double>& v, double step,
                                  double momentum, const Lanes<double>* target,
                                  Workspace<double>& w) {
  IterateOnce(u, v, step, momentum, target, w);
}
LUXFIELD_SIMD_CLONES void Residual(const Band<float>& u, const Band<float>& v,
                                   float reciprocal_diagonal, const Lanes<float>* target,
                                   Workspace<float>& w, Lanes<float>& residual) {
  ResidualAt(u, v, reciprocal_diagonal, target, w, residual);
}
LUXFIELD_SIMD_CLONES void Residual(const Band<double>& u, const Band<double>& v,
                                   double reciprocal_diagonal, const Lanes<double>* target,
                                   Workspace<double>& w, Lanes<double>& residual) {
  ResidualAt(u, v, reciprocal_diagonal, target, w, residual);
}

// The non-negative values nearest to c with exactly their target's sum: what rounding of the
// iteration left is spread over the entries above 0.
void FixSum(double target, std::vector<double>& c) {
  for (int n = 0; n < 50; ++n) {
    double sum = 0, count = 0;
    for (const double x : c) {
      sum += x;
      count += x > 0;
    }
    if (count == 0 || std::abs(sum - target) <= 1e-13 * std::abs(target)) return;
    const double off = (sum - target) / count;
    for (double& x : c) x = x > 0 ? std::max(x - off, 0.0) : 0.0;
  }
}

// Which pixels have a negative coefficient, and the sum of all of theirs.
template <typename T>
void FindNegative(T* const* coefficients, int count, std::size_t pixels, std::vector<char>* flagged,
                  std::vector<double>* sum) {
  core::ParallelFor(pixels, 4096, [&](std::size_t begin, std::size_t end) {
    for (int m = 0; m < count; ++m)
      for (std::size_t p = begin; p < end; ++p) {
        (*flagged)[p] |= coefficients[m][p] < 0;
        (*sum)[p] += coefficients[m][p];
      }
  });
}

template <typename T>
NonNegativeSummary Project(const GramSolver& solver, T* const* coefficients, std::size_t pixels,
                           const NonNegativeOptions& options) {
  const int count = solver.count();
  std::vector<char> flagged(pixels, 0);
  std::vector<double> sum(pixels, 0.0);
  FindNegative(coefficients, count, pixels, &flagged, &sum);
  NonNegativeSummary summary;
  std::vector<std::size_t> negative;
  for (std::size_t p = 0; p < pixels; ++p) {
    if (!flagged[p]) continue;
    ++summary.pixels;
    if (options.keep_flux && !(sum[p] > 0))
      for (int m = 0; m < count; ++m) coefficients[m][p] = 0;
    else
      negative.push_back(p);
  }

  const Band<T> u(solver.u()), v(solver.v());
  const double largest = solver.u().largest_eigenvalue * solver.v().largest_eigenvalue;
  const double root = std::sqrt(solver.condition());
  const T step = static_cast<T>(1 / largest), momentum = static_cast<T>((root - 1) / (root + 1));
  T diagonal_u = 0, diagonal_v = 0;
  for (const auto& row : u.row) diagonal_u = std::max(diagonal_u, row[2]);
  for (const auto& row : v.row) diagonal_v = std::max(diagonal_v, row[2]);
  const T reciprocal_diagonal = 1 / (diagonal_u * diagonal_v);

  std::mutex mutex;
  const std::size_t blocks = (negative.size() + kLanes - 1) / kLanes;
  core::ParallelFor(blocks, 4, [&](std::size_t begin, std::size_t end) {
    Workspace<T> w(count);
    std::vector<double> result(count);
    for (std::size_t block = begin; block < end; ++block) {
      const std::size_t* pixel = negative.data() + block * kLanes;
      const std::size_t lanes = std::min(kLanes, negative.size() - block * kLanes);
      Lanes<T> scale{}, residual{}, target;
      w.threshold.fill(0);
      // In units of the largest coefficient, so that floats neither overflow nor lose small ones.
      for (int m = 0; m < count; ++m)
        for (std::size_t k = 0; k < lanes; ++k)
          scale[k] = std::max(scale[k], std::abs(coefficients[m][pixel[k]]));
      for (std::size_t k = 0; k < kLanes; ++k)
        target[k] = k < lanes ? static_cast<T>(sum[pixel[k]] / scale[k]) : T{1};
      for (int m = 0; m < count; ++m)
        for (std::size_t k = 0; k < kLanes; ++k) {
          const T c = k < lanes ? coefficients[m][pixel[k]] / scale[k] : T{0};
          w.start[m][k] = c;
          w.z[m][k] = w.y[m][k] = c < 0 ? -c : T{0};
        }
      const auto tolerance = static_cast<T>(options.tolerance);
      const auto converged = [&] {
        for (std::size_t k = 0; k < lanes; ++k)
          if (!(residual[k] <= tolerance)) return false;
        return true;
      };
      const Lanes<T>* const kept = options.keep_flux ? &target : nullptr;
      int iteration = 0;
      while (iteration < options.max_iterations) {
        constexpr int kBetweenChecks = 8;
        for (int n = 0; n < kBetweenChecks; ++n) Iterate(u, v, step, momentum, kept, w);
        iteration += kBetweenChecks;
        Residual(u, v, reciprocal_diagonal, kept, w, residual);
        if (converged()) break;
      }
      for (std::size_t k = 0; k < lanes; ++k) {
        for (int m = 0; m < count; ++m)
          result[m] = std::max((double{w.start[m][k]} + w.z[m][k]) * scale[k], 0.0);
        if (options.keep_flux) FixSum(sum[pixel[k]], result);
        for (int m = 0; m < count; ++m) coefficients[m][pixel[k]] = static_cast<T>(result[m]);
      }
      const std::lock_guard lock(mutex);
      summary.iterations = std::max(summary.iterations, iteration);
      for (std::size_t k = 0; k < lanes; ++k) {
        summary.worst_residual = std::max(summary.worst_residual, double{residual[k]});
        summary.unconverged += !(residual[k] <= tolerance);
      }
    }
  });
  return summary;
}

}  // namespace

NonNegativeSummary ProjectNonNegative(const GramSolver& solver, float* const* coefficients,
                                      std::size_t pixels, const NonNegativeOptions& options) {
  return Project(solver, coefficients, pixels, options);
}

NonNegativeSummary ProjectNonNegative(const GramSolver& solver, double* const* coefficients,
                                      std::size_t pixels, const NonNegativeOptions& options) {
  return Project(solver, coefficients, pixels, options);
}

}  // namespace luxfield::reconstruct
