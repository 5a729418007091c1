#include "reconstruct/non_negative.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "core/parallel.h"
#include "reconstruct/simd.h"

namespace luxfield::reconstruct {
namespace {

constexpr std::size_t kLanes =
    32;  // pixels iterated together; a block ends when all of them have converged

using Lanes = std::array<double, kLanes>;

// The band of one Gram matrix: entry at offset -2 .. 2 of every row, zero outside.
struct Band {
  int count;
  std::vector<std::array<double, 5>> row;

  explicit Band(const GramAxis& axis) : count(axis.count), row(axis.count) {
    for (int i = 0; i < count; ++i)
      for (int d = -2; d <= 2; ++d)
        row[i][d + 2] = i + d >= 0 && i + d < count ? axis.gram[i * count + i + d] : 0;
  }
};

// out = (banded matrix along one axis) in; element n of the axis lies at n * stride blocks.
LUXFIELD_INLINE void MultiplyBand(const Band& band, const Lanes* in, std::size_t stride,
                                  Lanes* out) {
  for (int i = 0; i < band.count; ++i) {
    Lanes sum{};
    for (int d = std::max(-2, -i); d <= std::min(2, band.count - 1 - i); ++d) {
      const double weight = band.row[i][d + 2];
      const Lanes& x = in[(i + d) * stride];
      for (std::size_t k = 0; k < kLanes; ++k) sum[k] += weight * x[k];
    }
    out[i * stride] = sum;
  }
}

struct Workspace {
  std::vector<Lanes> start, x, y, difference, scratch, gradient, moved;
  Lanes sum{};        // of the coefficients, kept if keep_flux
  Lanes threshold{};  // of the last projection
  explicit Workspace(int count)
      : start(count),
        x(count),
        y(count),
        difference(count),
        scratch(count),
        gradient(count),
        moved(count) {}
};

// gradient = G (at - start)
LUXFIELD_INLINE void Gradient(const Band& u, const Band& v, const std::vector<Lanes>& at,
                              Workspace& w) {
  const std::size_t count = at.size();
  for (std::size_t m = 0; m < count; ++m)
    for (std::size_t k = 0; k < kLanes; ++k) w.difference[m][k] = at[m][k] - w.start[m][k];
  for (int j = 0; j < v.count; ++j)
    MultiplyBand(u, w.difference.data() + j * u.count, 1, w.scratch.data() + j * u.count);
  for (int i = 0; i < u.count; ++i)
    MultiplyBand(v, w.scratch.data() + i, u.count, w.gradient.data() + i);
}

// Replaces w.moved by its Euclidean projection on {x >= 0} or, if keep_flux, on
// {x >= 0, sum x = w.sum}: max(moved - threshold, 0), where the threshold is the root of a convex
// piecewise linear function that Newton's method finds in finitely many steps from anywhere.
LUXFIELD_INLINE void ProjectMoved(bool keep_flux, Workspace& w) {
  constexpr int kMaxSteps = 50;
  bool settled = !keep_flux;
  for (int n = 0; n < kMaxSteps && !settled; ++n) {
    Lanes sum{}, count{}, largest;
    largest.fill(-std::numeric_limits<double>::infinity());
    for (const Lanes& moved : w.moved)
      for (std::size_t k = 0; k < kLanes; ++k) {
        const double above = moved[k] - w.threshold[k];
        sum[k] += above > 0 ? above : 0;
        count[k] += above > 0 ? 1 : 0;
        largest[k] = moved[k] > largest[k] ? moved[k] : largest[k];
      }
    settled = true;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double next =
          count[k] > 0 ? w.threshold[k] + (sum[k] - w.sum[k]) / count[k] : largest[k] - w.sum[k];
      settled &= std::abs(next - w.threshold[k]) <= 4e-15 * (std::abs(largest[k]) + std::abs(next));
      w.threshold[k] = next;
    }
  }
  for (Lanes& moved : w.moved)
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double above = moved[k] - w.threshold[k];
      moved[k] = above > 0 ? above : 0;
    }
}

// y -> x' = P(y - step * gradient(y)), y' = x' + momentum (x' - x).
LUXFIELD_SIMD_CLONES void Iterate(const Band& u, const Band& v, double step, double momentum,
                                  bool keep_flux, Workspace& w) {
  Gradient(u, v, w.y, w);
  for (std::size_t m = 0; m < w.x.size(); ++m)
    for (std::size_t k = 0; k < kLanes; ++k) w.moved[m][k] = w.y[m][k] - step * w.gradient[m][k];
  ProjectMoved(keep_flux, w);
  for (std::size_t m = 0; m < w.x.size(); ++m)
    for (std::size_t k = 0; k < kLanes; ++k) {
      w.y[m][k] = w.moved[m][k] + momentum * (w.moved[m][k] - w.x[m][k]);
      w.x[m][k] = w.moved[m][k];
    }
}

// Residual of the stopping rule at x, before the division by max |C_0|.
LUXFIELD_SIMD_CLONES void Residual(const Band& u, const Band& v, double reciprocal_diagonal,
                                   bool keep_flux, Workspace& w, Lanes& residual) {
  Gradient(u, v, w.x, w);
  for (std::size_t m = 0; m < w.x.size(); ++m)
    for (std::size_t k = 0; k < kLanes; ++k)
      w.moved[m][k] = w.x[m][k] - reciprocal_diagonal * w.gradient[m][k];
  ProjectMoved(keep_flux, w);
  residual.fill(0);
  for (std::size_t m = 0; m < w.x.size(); ++m)
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double size = std::abs(w.x[m][k] - w.moved[m][k]);
      residual[k] = size > residual[k] ? size : residual[k];
    }
}

template <typename T>
NonNegativeSummary Project(const GramSolver& solver, T* const* coefficients, std::size_t pixels,
                           const NonNegativeOptions& options) {
  const int count = solver.count();
  std::vector<char> flagged(pixels, 0);
  std::vector<double> sum(pixels, 0.0);
  for (int m = 0; m < count; ++m)
    for (std::size_t p = 0; p < pixels; ++p) {
      flagged[p] |= coefficients[m][p] < 0;
      sum[p] += coefficients[m][p];
    }
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

  const Band u(solver.u()), v(solver.v());
  const double largest = solver.u().largest_eigenvalue * solver.v().largest_eigenvalue;
  const double root = std::sqrt(solver.condition());
  const double step = 1 / largest, momentum = (root - 1) / (root + 1);
  double diagonal_u = 0, diagonal_v = 0;
  for (const auto& row : u.row) diagonal_u = std::max(diagonal_u, row[2]);
  for (const auto& row : v.row) diagonal_v = std::max(diagonal_v, row[2]);
  const double reciprocal_diagonal = 1 / (diagonal_u * diagonal_v);

  std::mutex mutex;
  const std::size_t blocks = (negative.size() + kLanes - 1) / kLanes;
  core::ParallelFor(blocks, 4, [&](std::size_t begin, std::size_t end) {
    Workspace w(count);
    for (std::size_t block = begin; block < end; ++block) {
      const std::size_t* pixel = negative.data() + block * kLanes;
      const std::size_t lanes = std::min(kLanes, negative.size() - block * kLanes);
      Lanes scale{}, residual{};
      w.threshold.fill(0);
      for (std::size_t k = 0; k < kLanes; ++k) w.sum[k] = k < lanes ? sum[pixel[k]] : 1.0;
      for (int m = 0; m < count; ++m)
        for (std::size_t k = 0; k < kLanes; ++k) {
          const double c = k < lanes ? static_cast<double>(coefficients[m][pixel[k]]) : 0.0;
          w.start[m][k] = c;
          w.x[m][k] = w.y[m][k] = std::max(c, 0.0);
          scale[k] = std::max(scale[k], std::abs(c));
        }
      const auto converged = [&] {
        for (std::size_t k = 0; k < lanes; ++k)
          if (!(residual[k] <= options.tolerance * scale[k])) return false;
        return true;
      };
      int iteration = 0;
      while (iteration < options.max_iterations) {
        constexpr int kBetweenChecks = 8;
        for (int n = 0; n < kBetweenChecks; ++n)
          Iterate(u, v, step, momentum, options.keep_flux, w);
        iteration += kBetweenChecks;
        Residual(u, v, reciprocal_diagonal, options.keep_flux, w, residual);
        if (converged()) break;
      }
      for (int m = 0; m < count; ++m)
        for (std::size_t k = 0; k < lanes; ++k)
          coefficients[m][pixel[k]] = static_cast<T>(w.x[m][k]);
      const std::lock_guard lock(mutex);
      summary.iterations = std::max(summary.iterations, iteration);
      for (std::size_t k = 0; k < lanes; ++k) {
        summary.worst_residual = std::max(summary.worst_residual, residual[k] / scale[k]);
        summary.unconverged += residual[k] > options.tolerance * scale[k];
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
