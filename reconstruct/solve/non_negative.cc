#include "luxfield/reconstruct/solve/non_negative.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <span>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/simd.h"
#include "luxfield/reconstruct/solve/non_negative_rows.h"

namespace luxfield::reconstruct {
namespace {

// Numbers that are worked on together; the compiler splits them into what registers hold.
template <typename Number, int count>
struct Pack {
  typedef Number Type __attribute__((vector_size(count * sizeof(Number))));
};

// A pack for each coefficient. (A vector of bare packs would lose their alignment.)
template <typename Number, int count>
class PackVector {
 public:
  using Type = typename Pack<Number, count>::Type;
  explicit PackVector(std::size_t size) : packs_(size) {}
  std::size_t size() const { return packs_.size(); }
  LUXFIELD_INLINE Type& operator[](std::size_t m) { return packs_[m].pack; }
  LUXFIELD_INLINE const Type& operator[](std::size_t m) const { return packs_[m].pack; }

 private:
  struct alignas(count * sizeof(Number)) Aligned {
    Type pack;
  };
  std::vector<Aligned> packs_;
};

// Pixels iterated together, until all of them have converged: a cache line of T.
template <typename T>
constexpr int kLanes = 64 / sizeof(T);
template <typename T>
using Lanes = typename Pack<T, kLanes<T>>::Type;
template <typename T>
using LanesVector = PackVector<T, kLanes<T>>;
template <typename T>
using Doubles = typename Pack<double, kLanes<T>>::Type;
template <typename T>
using DoublesVector = PackVector<double, kLanes<T>>;

#define LUXFIELD_INLINE_LAMBDA __attribute__((always_inline))

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

// The problem per pixel: minimise (C - C_0)^T G (C - C_0) / 2 over C >= 0 and, to keep the flux,
// sum C = sum C_0.
template <typename T>
struct Problem {
  Band<T> u, v;
  T step, momentum, reciprocal_diagonal;

  explicit Problem(const GramSolver& solver) : u(solver.u()), v(solver.v()) {
    const double root = std::sqrt(solver.condition());
    step = static_cast<T>(1 / (solver.u().largest_eigenvalue * solver.v().largest_eigenvalue));
    momentum = static_cast<T>((root - 1) / (root + 1));
    T diagonal_u = 0, diagonal_v = 0;
    for (const auto& row : u.row) diagonal_u = std::max(diagonal_u, row[2]);
    for (const auto& row : v.row) diagonal_v = std::max(diagonal_v, row[2]);
    reciprocal_diagonal = 1 / (diagonal_u * diagonal_v);
  }
};

template <typename T>
struct Workspace {
  LanesVector<T> irradiance;      // G C_0
  LanesVector<T> iterate;         // C before the last step
  LanesVector<T> moved;           // after it, not yet projected
  Lanes<T> threshold{};           // of that projection: C = max(moved - threshold, 0)
  LanesVector<T> trial;           // as `moved`, of the stopping rule
  LanesVector<T> point, along_u;  // the last rows of the sweep at hand: C and G_u C
  static constexpr int kRows = 5;

  Workspace(int width, int height)
      : irradiance(width * height),
        iterate(width * height),
        moved(width * height),
        trial(width * height),
        point(kRows * width),
        along_u(kRows * width) {}
};

template <typename T>
LUXFIELD_INLINE void AboveZero(Lanes<T>& x) {
  x = x > 0 ? x : Lanes<T>{};
}

// Calls give(m, C_m), which sets C_m, and take(m, C_m, (G C)_m), when (G C)_m is there, for every
// m. One pass down the rows: what they share stays in the nearest cache.
template <typename T, typename Give, typename Take>
LUXFIELD_INLINE void SweepGram(const Band<T>& u, const Band<T>& v, Workspace<T>& w, Give&& give,
                               Take&& take) {
  const int width = u.count, height = v.count;
  const auto ring = [=](int row) { return row % Workspace<T>::kRows * width; };
  for (int below = 0; below < height + 2; ++below) {
    if (below < height) {
      const int here = ring(below);
      for (int i = 0; i < width; ++i) give(below * width + i, w.point[here + i]);
      Lanes<T> x0{}, x1{}, x2 = w.point[here], x3 = width > 1 ? w.point[here + 1] : Lanes<T>{};
      for (int i = 0; i < width; ++i) {
        const Lanes<T> x4 = i + 2 < width ? w.point[here + i + 2] : Lanes<T>{};
        const std::array<T, 5>& g = u.row[i];
        w.along_u[here + i] = g[0] * x0 + g[1] * x1 + g[2] * x2 + g[3] * x3 + g[4] * x4;
        x0 = x1;
        x1 = x2;
        x2 = x3;
        x3 = x4;
      }
    }
    const int j = below - 2;
    if (j < 0) continue;
    const std::array<T, 5>& g = v.row[j];
    // Beyond the ends the band holds zeros, so that any row will do.
    const auto neighbour = [=](int d) { return ring(j + d >= 0 && j + d < height ? j + d : j); };
    const int r0 = neighbour(-2), r1 = neighbour(-1), r2 = ring(j), r3 = neighbour(1),
              r4 = neighbour(2);
    for (int i = 0; i < width; ++i) {
      const Lanes<T> product = g[0] * w.along_u[r0 + i] + g[1] * w.along_u[r1 + i] +
                               g[2] * w.along_u[r2 + i] + g[3] * w.along_u[r3 + i] +
                               g[4] * w.along_u[r4 + i];
      take(j * width + i, w.point[r2 + i], product);
    }
  }
}

// What a projection by a threshold leaves: its sum and the number of entries above 0.
template <typename T>
struct Tally {
  Lanes<T> sum{}, count{};
  LUXFIELD_INLINE void Add(const Lanes<T>& difference) {
    Lanes<T> above = difference;
    count += above > 0 ? Lanes<T>{} + 1 : Lanes<T>{};
    AboveZero<T>(above);
    sum += above;
  }
};

// One step of Newton's method on the convex piecewise linear sum_m max(moved_m - t, 0) = target,
// whose root t is the threshold of the projection on {C >= 0, sum C = target}. Where nothing is
// above t it falls to where one entry could hold all.
template <typename T>
LUXFIELD_INLINE void StepThreshold(const Lanes<T>& target, const Tally<T>& tally,
                                   const LanesVector<T>& moved, Lanes<T>& threshold) {
  Lanes<T> largest = Lanes<T>{} - std::numeric_limits<T>::infinity();
  bool empty = false;
  for (int k = 0; k < kLanes<T>; ++k) empty |= !(tally.count[k] > 0);
  if (empty)
    for (std::size_t m = 0; m < moved.size(); ++m)
      largest = moved[m] > largest ? moved[m] : largest;
  const Lanes<T> newton = threshold + (tally.sum - target) / tally.count;
  threshold = tally.count > 0 ? newton : largest - target;
}

// Newton steps until the sum is within `tolerance` of its target before a step, which leaves the
// square of that or nothing.
template <typename T>
LUXFIELD_INLINE void FindThreshold(const Lanes<T>& target, T tolerance, const Tally<T>& first,
                                   const LanesVector<T>& moved, Lanes<T>& threshold) {
  constexpr int kMaxSteps = 50;
  constexpr T kRounding = 64 * std::numeric_limits<T>::epsilon();  // of sums of values up to 1
  Tally<T> tally = first;
  for (int n = 0; n < kMaxSteps; ++n) {
    bool far = false;
    for (int k = 0; k < kLanes<T>; ++k)
      far |= !(std::abs(tally.sum[k] - target[k]) <= tolerance * target[k] + kRounding);
    StepThreshold(target, tally, moved, threshold);
    if (!far) return;
    tally = {};
    for (std::size_t m = 0; m < moved.size(); ++m) tally.Add(moved[m] - threshold);
  }
}

// irradiance = G C_0 of the C_0 in `moved`.
template <typename T>
LUXFIELD_INLINE void FindIrradiance(const Problem<T>& problem, Workspace<T>& w) {
  SweepGram(
      problem.u, problem.v, w, [&](int m, Lanes<T>& c) LUXFIELD_INLINE_LAMBDA { c = w.moved[m]; },
      [&](int m, const Lanes<T>&, const Lanes<T>& product)
          LUXFIELD_INLINE_LAMBDA { w.irradiance[m] = product; });
}

// C = P(moved), y = C + momentum (C - C before), moved = y - step (G y - G C_0). The threshold of P
// starts from the last iteration's, from which one Newton step is nearly always enough.
template <typename T>
LUXFIELD_INLINE void IterateOnce(const Problem<T>& problem, const Lanes<T>* target,
                                 Workspace<T>& w) {
  constexpr T kNear = static_cast<T>(0.01);
  const Lanes<T> threshold = w.threshold;
  Tally<T> tally;
  SweepGram(
      problem.u, problem.v, w,
      [&](int m, Lanes<T>& y) LUXFIELD_INLINE_LAMBDA {
        Lanes<T> c = w.moved[m] - threshold;
        AboveZero<T>(c);
        y = c + problem.momentum * (c - w.iterate[m]);
        w.iterate[m] = c;
      },
      [&](int m, const Lanes<T>& y, const Lanes<T>& product) LUXFIELD_INLINE_LAMBDA {
        const Lanes<T> moved = y - problem.step * (product - w.irradiance[m]);
        w.moved[m] = moved;
        tally.Add(moved - threshold);
      });
  if (target) FindThreshold(*target, kNear, tally, w.moved, w.threshold);
}

// Residual of the stopping rule at C = P(moved), before the division by max |C_0|.
template <typename T>
LUXFIELD_INLINE void ResidualAt(const Problem<T>& problem, const Lanes<T>* target, Workspace<T>& w,
                                Lanes<T>& residual) {
  const Lanes<T> threshold = w.threshold;
  Lanes<T> of_trial = threshold;
  Tally<T> tally;
  SweepGram(
      problem.u, problem.v, w,
      [&](int m, Lanes<T>& c) LUXFIELD_INLINE_LAMBDA {
        c = w.moved[m] - threshold;
        AboveZero<T>(c);
      },
      [&](int m, const Lanes<T>& c, const Lanes<T>& product) LUXFIELD_INLINE_LAMBDA {
        const Lanes<T> moved = c - problem.reciprocal_diagonal * (product - w.irradiance[m]);
        w.trial[m] = moved;
        tally.Add(moved - of_trial);
      });
  if (target) FindThreshold(*target, T{0}, tally, w.trial, of_trial);
  residual = Lanes<T>{};
  for (std::size_t m = 0; m < w.trial.size(); ++m) {
    Lanes<T> here = w.moved[m] - threshold, there = w.trial[m] - of_trial;
    AboveZero<T>(here);
    AboveZero<T>(there);
    const Lanes<T> off = here > there ? here - there : there - here;
    residual = off > residual ? off : residual;
  }
}

// C = P(moved), times `scale`, in double, and with exactly its target's sum: what rounding of the
// iteration left is spread over the entries above 0.
template <typename T>
LUXFIELD_INLINE void Finish(const Lanes<T>& scale, const Doubles<T>* sum, Workspace<T>& w,
                            DoublesVector<T>& c) {
  const std::size_t count = w.moved.size();
  for (std::size_t m = 0; m < count; ++m) {
    Lanes<T> value = w.moved[m] - w.threshold;
    AboveZero<T>(value);
    c[m] = __builtin_convertvector(value, Doubles<T>) * __builtin_convertvector(scale, Doubles<T>);
  }
  constexpr int kMaxSteps = 50;
  for (int n = 0; sum && n < kMaxSteps; ++n) {
    Doubles<T> total{}, above{};
    for (std::size_t m = 0; m < count; ++m) {
      total += c[m];
      above += c[m] > 0 ? Doubles<T>{} + 1 : Doubles<T>{};
    }
    bool far = false;
    for (int k = 0; k < kLanes<T>; ++k)
      far |= above[k] > 0 && std::abs(total[k] - (*sum)[k]) > 1e-13 * std::abs((*sum)[k]);
    if (!far) return;
    const Doubles<T> off = above > 0 ? (total - *sum) / above : Doubles<T>{};
    for (std::size_t m = 0; m < count; ++m) {
      const Doubles<T> mended = c[m] - off;
      c[m] = c[m] > 0 && mended > 0 ? mended : Doubles<T>{};
    }
  }
}

// From C_0 in `moved` to C in `result`; the number of iterations.
template <typename T>
LUXFIELD_INLINE int SolveBlock(const Problem<T>& problem, const NonNegativeOptions& options,
                               const Doubles<T>& flux, Workspace<T>& w, DoublesVector<T>& result,
                               Lanes<T>& residual) {
  // In units of the largest coefficient, so that floats neither overflow nor lose small ones.
  Lanes<T> scale{};
  for (std::size_t m = 0; m < w.moved.size(); ++m) {
    const Lanes<T> size = w.moved[m] < 0 ? -w.moved[m] : w.moved[m];
    scale = size > scale ? size : scale;
  }
  for (std::size_t m = 0; m < w.moved.size(); ++m) w.moved[m] /= scale;
  const Doubles<T> scaled_flux = flux / __builtin_convertvector(scale, Doubles<T>);
  const Lanes<T> target = __builtin_convertvector(scaled_flux, Lanes<T>);
  const Lanes<T>* const kept = options.keep_flux ? &target : nullptr;
  FindIrradiance(problem, w);
  w.threshold = Lanes<T>{};
  for (std::size_t m = 0; m < w.moved.size(); ++m) {
    w.iterate[m] = w.moved[m];
    AboveZero<T>(w.iterate[m]);
  }

  // A check costs more than an iteration. The first comes after three quarters of those that the
  // momentum's rate says, the next when the rate since the last one says.
  const double tolerance = options.tolerance;
  const int first = static_cast<int>(
      std::clamp(0.75 * std::log(tolerance) / std::log(double{problem.momentum}), 2.0, 1e9));
  const double longest = std::max(2, first / 4);
  int iteration = 0, wait = first;
  double before = 1;
  while (iteration < options.max_iterations) {
    wait = std::min(wait, options.max_iterations - iteration);
    for (int n = 0; n < wait; ++n) IterateOnce(problem, kept, w);
    iteration += wait;
    ResidualAt(problem, kept, w, residual);
    double worst = 0;
    bool converged = true;
    for (int k = 0; k < kLanes<T>; ++k) {
      worst = std::max(worst, double{residual[k]});
      converged &= residual[k] <= static_cast<T>(tolerance);
    }
    if (converged) break;
    const double log_rate = std::log(worst / before) / wait;
    const double left = log_rate < 0 ? std::log(tolerance / worst) / log_rate : longest;
    wait = static_cast<int>(std::clamp(std::ceil(left), 2.0, longest));
    before = worst;
  }
  Finish<T>(scale, options.keep_flux ? &flux : nullptr, w, result);
  return iteration;
}

LUXFIELD_SIMD_CLONES int Solve(const Problem<float>& problem, const NonNegativeOptions& options,
                               const Doubles<float>& flux, Workspace<float>& w,
                               DoublesVector<float>& result, Lanes<float>& residual) {
  return SolveBlock<float>(problem, options, flux, w, result, residual);
}
LUXFIELD_SIMD_CLONES int Solve(const Problem<double>& problem, const NonNegativeOptions& options,
                               const Doubles<double>& flux, Workspace<double>& w,
                               DoublesVector<double>& result, Lanes<double>& residual) {
  return SolveBlock<double>(problem, options, flux, w, result, residual);
}

using Sums = Eigen::Vector3d;  // of C, i C and j C, i and j from the middle of the grid

template <typename Get>
Sums SumsOf(int width, int height, const Get& get) {
  Sums sums = Sums::Zero();
  for (int m = 0; m < width * height; ++m) {
    const double c = get(m), i = m % width - 0.5 * (width - 1), j = m / width - 0.5 * (height - 1);
    sums += c * Sums(1, i, j);
  }
  return sums;
}

// c (1 + a + b i + c j) with the sums `wanted`; false, and nothing is changed, where no such
// factors above 0 have them.
bool Tilt(int width, int height, const Sums& wanted, std::vector<double>* c) {
  const auto phi = [&](int m) {
    return Sums(1, m % width - 0.5 * (width - 1), m / width - 0.5 * (height - 1));
  };
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  Sums have = Sums::Zero();
  for (int m = 0; m < width * height; ++m) {
    have += (*c)[m] * phi(m);
    second += (*c)[m] * phi(m) * phi(m).transpose();
  }
  const Sums tilt = second.completeOrthogonalDecomposition().solve(wanted - have);
  const Sums miss = second * tilt - (wanted - have);
  if (!(miss.norm() <= 1e-9 * have(0) * (width + height))) return false;
  for (int m = 0; m < width * height; ++m)
    if ((*c)[m] > 0 && 1 + tilt.dot(phi(m)) < 0) return false;
  for (int m = 0; m < width * height; ++m)
    if ((*c)[m] > 0) (*c)[m] *= 1 + tilt.dot(phi(m));
  return true;
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

// The pixels, in their order, in blocks of at most `most` of one row.
std::vector<std::span<const std::size_t>> BlocksOf(const std::vector<std::size_t>& pixels,
                                                   std::size_t most, std::size_t row) {
  std::vector<std::span<const std::size_t>> blocks;
  for (std::size_t first = 0, end = 0; first < pixels.size(); first = end) {
    for (end = first; end < pixels.size() && end - first < most; ++end)
      if (pixels[end] / row != pixels[first] / row) break;
    blocks.push_back(std::span(pixels).subspan(first, end - first));
  }
  return blocks;
}

template <typename T>
NonNegativeSummary Project(const GramSolver& solver, T* const* coefficients, std::size_t pixels,
                           std::size_t row, const NonNegativeOptions& options) {
  constexpr std::size_t kPixels = kLanes<T>;
  const int count = solver.count();
  std::vector<char> flagged(pixels, 0);
  std::vector<double> sum(pixels, 0.0);
  FindNegative(coefficients, count, pixels, &flagged, &sum);
  NonNegativeSummary summary;
  std::vector<std::size_t> negative;
  for (std::size_t p = 0; p < pixels; ++p) {
    if (!flagged[p] || !std::isfinite(sum[p])) continue;
    ++summary.pixels;
    if (options.keep_flux && !(sum[p] > 0))
      for (int m = 0; m < count; ++m) coefficients[m][p] = 0;
    else
      negative.push_back(p);
  }

  const Problem<T> problem(solver);
  const auto tolerance = static_cast<T>(options.tolerance);
  std::mutex mutex;
  const std::vector<std::span<const std::size_t>> blocks = BlocksOf(negative, kPixels, row);
  core::ParallelFor(blocks.size(), 4, [&](std::size_t begin, std::size_t end) {
    Workspace<T> w(problem.u.count, problem.v.count);
    DoublesVector<T> result(count);
    for (std::size_t block = begin; block < end; ++block) {
      const std::size_t lanes = blocks[block].size();
      std::array<std::size_t, kPixels> pixel;  // the last block repeats its first
      for (std::size_t k = 0; k < kPixels; ++k) pixel[k] = blocks[block][k < lanes ? k : 0];
      for (int m = 0; m < count; ++m)
        for (std::size_t k = 0; k < kPixels; ++k) w.moved[m][k] = coefficients[m][pixel[k]];
      Doubles<T> flux{};
      for (std::size_t k = 0; k < kPixels; ++k) flux[k] = sum[pixel[k]];

      Lanes<T> residual{};
      const int iterations = Solve(problem, options, flux, w, result, residual);
      std::size_t lost = 0;
      std::vector<double> one(static_cast<std::size_t>(count));
      for (std::size_t k = 0; k < lanes; ++k) {
        for (int m = 0; m < count; ++m) one[m] = result[m][k];
        if (options.keep_flux && options.keep_first_moments) {
          const Sums wanted = SumsOf(problem.u.count, problem.v.count,
                                     [&](int m) { return coefficients[m][pixel[k]]; });
          lost += !Tilt(problem.u.count, problem.v.count, wanted, &one);
        }
        for (int m = 0; m < count; ++m) coefficients[m][pixel[k]] = static_cast<T>(one[m]);
      }
      const std::lock_guard lock(mutex);
      summary.moments_lost += lost;
      summary.iterations = std::max(summary.iterations, iterations);
      for (std::size_t k = 0; k < lanes; ++k) {
        summary.worst_residual = std::max(summary.worst_residual, double{residual[k]});
        summary.unconverged += !(residual[k] <= tolerance);
      }
    }
  });
  return summary;
}

}  // namespace

NonNegativeMetric NonNegativeMetricFromName(const std::string& name) {
  for (const auto metric : {NonNegativeMetric::kCoefficients, NonNegativeMetric::kIrradiance})
    if (NonNegativeMetricName(metric) == name) return metric;
  throw InputError(fmt::format(
      "--non-negative-metric '{}' is not known; give coefficients or irradiance", name));
}

std::string NonNegativeMetricName(NonNegativeMetric metric) {
  return metric == NonNegativeMetric::kIrradiance ? "irradiance" : "coefficients";
}

NonNegativeSummary ProjectNonNegative(const GramSolver& solver, float* const* coefficients,
                                      std::size_t pixels, const NonNegativeOptions& options) {
  return Project(solver, coefficients, pixels, pixels, options);
}

NonNegativeSummary ProjectNonNegative(const GramSolver& solver, double* const* coefficients,
                                      std::size_t pixels, const NonNegativeOptions& options) {
  return Project(solver, coefficients, pixels, pixels, options);
}

NonNegativeSummary ProjectNonNegativeRows(const GramSolver& solver, float* const* coefficients,
                                          std::size_t pixels, std::size_t width,
                                          const NonNegativeOptions& options) {
  return Project(solver, coefficients, pixels, width, options);
}

}  // namespace luxfield::reconstruct
