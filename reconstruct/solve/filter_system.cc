#include "luxfield/reconstruct/solve/filter_system.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/merge/filter_profile.h"
#include "luxfield/reconstruct/solve/texel_weights.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::BasisGrid;
using lightfield::MeasuredFilter;
using lightfield::Vec2;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Sparse = Eigen::SparseMatrix<double>;
using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;

constexpr double kNothing = 1e-15;  // of h^2: entries below are rounding, not overlap

// What texels see of the 1-D functions of an axis: functions first .. first + n - 1 of texel t are
// weights[t * n + k].
struct AxisWeights {
  int first = 0, count = 0;  // functions that any texel meets
  std::vector<double> weights;
};

// edges_h: texel edges in units of h from the support corner of function 0, rising or falling.
AxisWeights WeightsAlong(const lightfield::Basis& basis, int functions,
                         const std::vector<double>& edges_h, double blur_h) {
  const auto [low, high] = std::minmax(edges_h.front(), edges_h.back());
  AxisWeights result;
  result.first = std::clamp(static_cast<int>(std::floor(low)) - basis.cells, 0, functions);
  result.count =
      std::max(0, std::min(functions, static_cast<int>(std::floor(high)) + 1) - result.first);
  result.weights.resize((edges_h.size() - 1) * static_cast<std::size_t>(result.count));
  for (int k = 0; k < result.count; ++k) {
    const std::vector<double> of_texels = TexelWeights(basis, result.first + k, edges_h, blur_h);
    for (std::size_t t = 0; t < of_texels.size(); ++t)
      result.weights[t * static_cast<std::size_t>(result.count) + static_cast<std::size_t>(k)] =
          of_texels[t];
  }
  return result;
}

// Integrals of Phi* over squares of side 1 / per_cell spacings, `samples` the grid of them.
std::vector<std::pair<int, double>> IdealSamples(const BasisGrid& grid, const BasisGrid& samples,
                                                 Vec2 centre) {
  const auto along = [&](int points, double first_point, double from_centre) {
    std::vector<double> values;
    const double step = samples.spacing_m / grid.spacing_m,
                 x0 = (first_point - from_centre) / grid.spacing_m + 0.5 * grid.basis.cells;
    for (int k = 0; k < points; ++k)
      values.push_back(grid.basis.Integral(x0 + k * step, x0 + (k + 1) * step) / step);
    return values;
  };
  const auto u = along(samples.width, samples.u0_m, centre.x),
             v = along(samples.height, samples.v0_m, centre.y);
  std::vector<std::pair<int, double>> result;
  for (int y = 0; y < samples.height; ++y)
    for (int x = 0; x < samples.width; ++x)
      if (u[x] * v[y] != 0) result.emplace_back(samples.index(x, y), u[x] * v[y]);
  return result;
}

// Phi* and its variance per texel.
struct Transmittance {
  std::vector<double> value, variance;
};

Transmittance Combine(const MeasuredFilter& filter) {
  const std::vector<double> factors = filter.factors();
  Transmittance result;
  result.value.assign(filter.prints.front().transmittance.size(), 0);
  result.variance.assign(result.value.size(), 0);
  for (std::size_t k = 0; k < factors.size(); ++k)
    for (std::size_t t = 0; t < result.value.size(); ++t) {
      const double sigma = factors[k] * filter.prints[k].sigma[t];
      result.value[t] += factors[k] * filter.prints[k].transmittance[t];
      result.variance[t] += sigma * sigma;
    }
  return result;
}

struct Row {
  std::vector<std::pair<int, double>> entries;
  double variance = 0;  // summed over the entries
};

Row MeasuredRow(const BasisGrid& grid, const MeasuredFilter& filter,
                const Transmittance& transmittance, Vec2 centre) {
  const double h = grid.spacing_m;
  const auto& lattice = filter.lattice;
  std::vector<double> u_edges, v_edges;
  for (int c = 0; c <= lattice.width; ++c)
    u_edges.push_back((centre.x + lattice.s_of_column(c) - grid.u0_m) / h);
  for (int r = 0; r <= lattice.height; ++r)
    v_edges.push_back((centre.y + lattice.t_of_row(r) - grid.v0_m) / h);
  const double blur = filter.blur_m / h;
  const AxisWeights u = WeightsAlong(grid.basis, grid.width, u_edges, blur),
                    v = WeightsAlong(grid.basis, grid.height, v_edges, blur);
  Row row;
  if (u.count == 0 || v.count == 0) return row;
  const Eigen::Map<const RowMatrix> x(u.weights.data(), lattice.width, u.count),
      y(v.weights.data(), lattice.height, v.count),
      t(transmittance.value.data(), lattice.height, lattice.width),
      variance(transmittance.variance.data(), lattice.height, lattice.width);
  const RowMatrix products = h * h * (y.transpose() * (t * x).eval());
  const RowMatrix x2 = x.cwiseAbs2(), y2 = y.cwiseAbs2();
  row.variance = h * h * h * h * (y2.transpose() * (variance * x2).eval()).sum();
  for (int j = 0; j < v.count; ++j)
    for (int i = 0; i < u.count; ++i)
      if (std::abs(products(j, i)) > kNothing * h * h)
        row.entries.emplace_back(grid.index(u.first + i, v.first + j), products(j, i));
  return row;
}

Row IdealRow(const BasisGrid& grid, const FilterProfile& filter, Vec2 centre) {
  const double h = grid.spacing_m;
  const Vec2 origin = grid.centre(0, 0);
  const double x = (centre.x - origin.x) / h, y = (centre.y - origin.y) / h;
  const auto overlap = [&](double offset) {
    return std::abs(offset) < grid.basis.cells ? filter.Overlap(offset) : 0;
  };
  std::vector<double> u, v;
  for (int i = 0; i < grid.width; ++i) u.push_back(overlap(i - x));
  for (int j = 0; j < grid.height; ++j) v.push_back(overlap(j - y));
  Row row;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      if (std::abs(u[i] * v[j]) > kNothing)
        row.entries.emplace_back(grid.index(i, j), h * h * u[i] * v[j]);
  return row;
}

void CheckFilter(const BasisGrid& grid, const MeasuredFilter& filter) {
  filter.Validate("measured filter");
  const auto fail = [](const std::string& what) {
    throw InputError("measured filter", what, "measure the filter that the session was taken with");
  };
  if (std::abs(filter.spacing_m - grid.spacing_m) > 1e-9 * grid.spacing_m)
    fail(fmt::format("has spacing {} m, the measurements {} m", filter.spacing_m, grid.spacing_m));
  if (!(filter.basis == grid.basis))
    fail(fmt::format("is of basis '{}' (a = {}), the measurements of '{}' (a = {})",
                     filter.basis.name(), filter.basis.a, grid.basis.name(), grid.basis.a));
}

// The largest eigenvalue of a symmetric positive operator: Lanczos with full reorthogonalisation.
double LargestEigenvalue(int size, const std::function<Vector(const Vector&)>& apply) {
  constexpr int kMostSteps = 400;
  std::vector<Vector> basis;
  std::vector<double> diagonal, off_diagonal;
  Vector q(size);
  core::Random random(1, 0);
  for (int k = 0; k < size; ++k) q(k) = random.Normal();
  q.normalize();
  double largest = 0;
  int settled = 0;
  for (int step = 0; step < std::min(size, kMostSteps); ++step) {
    basis.push_back(q);
    Vector w = apply(q);
    diagonal.push_back(q.dot(w));
    for (int twice = 0; twice < 2; ++twice)
      for (const Vector& other : basis) w -= other.dot(w) * other;
    const auto n = static_cast<Eigen::Index>(diagonal.size());
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
    ritz.computeFromTridiagonal(Eigen::Map<const Vector>(diagonal.data(), n),
                                Eigen::Map<const Vector>(off_diagonal.data(), n - 1),
                                Eigen::EigenvaluesOnly);
    const double now = ritz.eigenvalues()(n - 1);
    settled = std::abs(now - largest) < 1e-12 * now ? settled + 1 : 0;
    largest = now;
    const double norm = w.norm();
    if (settled == 3 || norm < 1e-14 * now) break;
    off_diagonal.push_back(norm);
    q = w / norm;
  }
  return largest;
}

}  // namespace

struct FilterSystem::Impl {
  BasisGrid grid;
  std::optional<MeasuredFilter> filter;  // none: ideal
  Transmittance transmittance;           // of the measured one
  std::vector<Vec2> centres_m;
  Sparse a;
  double matrix_noise = 0;
  double smallest = 0, largest = 0;
  std::vector<double> pseudo_inverse;  // columns x rows
  Eigen::SparseLU<Sparse> lu;          // of a square A
  Eigen::SimplicialLDLT<Sparse> ldlt;  // of A^T A where there are more rows

  bool square() const { return a.rows() == a.cols(); }

  // Two rows that point the same way, in the order of the measurements; nothing if there are none.
  std::optional<std::pair<int, int>> ParallelRows() const {
    const SparseRows rows = a;
    std::vector<double> norms;
    for (Eigen::Index r = 0; r < rows.rows(); ++r) norms.push_back(rows.row(r).norm());
    for (int r = 0; r < rows.rows(); ++r)
      for (int other = r + 1; other < rows.rows(); ++other)
        if (std::abs(rows.row(r).dot(rows.row(other))) >= (1 - 1e-9) * norms[r] * norms[other])
          return std::pair{r, other};
    return {};
  }

  [[noreturn]] void FailSingular(double condition) const {
    const auto name = [this](int row) {
      const int m = row % grid.count();
      return fmt::format("({}, {})", m % grid.width, m / grid.width);
    };
    if (const auto twins = square() ? ParallelRows() : std::nullopt)
      throw InputError(fmt::format(
          "filter positions {} and {} sit in one place: the system is singular; move or drop one "
          "of them",
          name(twins->first), name(twins->second)));
    throw InputError(
        fmt::format("the filters cannot be told apart (condition number {:.3g}, at most {:.0e} "
                    "can be solved); space them by their basis' spacing",
                    condition, kLargestCondition));
  }

  void Factorise() {
    if (square()) {
      lu.compute(a);
      if (lu.info() != Eigen::Success) FailSingular(std::numeric_limits<double>::infinity());
    } else {
      ldlt.compute(Sparse(a.transpose() * a));
      if (ldlt.info() != Eigen::Success) FailSingular(std::numeric_limits<double>::infinity());
    }
  }

  Vector SolveNormal(const Vector& x) {  // (A^T A)^-1 x
    if (!square()) return ldlt.solve(x);
    const Vector y = lu.transpose().solve(x);
    return lu.solve(y);
  }

  void FindSingularValues() {
    const auto size = static_cast<int>(a.cols());
    largest = std::sqrt(LargestEigenvalue(
        size, [this](const Vector& x) { return Vector(a.transpose() * Vector(a * x)); }));
    smallest =
        1 / std::sqrt(LargestEigenvalue(size, [this](const Vector& x) { return SolveNormal(x); }));
    // The normal equations square the condition number.
    const double limit = square() ? kLargestCondition : std::sqrt(kLargestCondition);
    if (!(largest < limit * smallest)) FailSingular(largest / smallest);
  }

  void Invert() {
    const Eigen::Index rows = a.rows(), columns = a.cols();
    pseudo_inverse.resize(static_cast<std::size_t>(rows) * columns);
    Eigen::Map<RowMatrix> inverse(pseudo_inverse.data(), columns, rows);
    const Sparse transposed = a.transpose();
    core::ParallelFor(static_cast<std::size_t>(rows), 16, [&](std::size_t begin, std::size_t end) {
      for (auto r = static_cast<Eigen::Index>(begin); r < static_cast<Eigen::Index>(end); ++r) {
        // Into a vector of its own: SparseLU takes the result to be contiguous.
        const Vector column = square() ? Vector(lu.solve(Vector(Vector::Unit(rows, r))))
                                       : Vector(ldlt.solve(Vector(transposed.col(r))));
        inverse.col(r) = column;
      }
    });
  }
};

FilterSystem::FilterSystem(const BasisGrid& grid, const MeasuredFilter* filter,
                           std::span<const Vec2> centres_m, lightfield::FilterKind kind)
    : impl_(std::make_unique<Impl>()) {
  const auto rows = static_cast<int>(centres_m.size()), columns = grid.count();
  if (columns > kMostCoefficients || rows < columns)
    throw InputError(fmt::format(
        "{} filter positions for {} coefficient images: the general solve takes at most {} images, "
        "and no fewer positions than images",
        rows, columns, kMostCoefficients));
  Transmittance& transmittance = impl_->transmittance;
  impl_->centres_m.assign(centres_m.begin(), centres_m.end());
  if (filter) {
    CheckFilter(grid, *filter);
    transmittance = Combine(*filter);
    impl_->filter = *filter;
  }
  std::optional<FilterProfile> ideal;
  if (!filter) ideal.emplace(kind, grid.basis);
  std::vector<Row> all(centres_m.size());
  core::ParallelFor(all.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r)
      all[r] = filter ? MeasuredRow(grid, *filter, transmittance, centres_m[r])
                      : IdealRow(grid, *ideal, centres_m[r]);
  });
  std::vector<Eigen::Triplet<double>> entries;
  double variance = 0;
  for (int r = 0; r < rows; ++r) {
    for (const auto& [m, value] : all[r].entries) entries.emplace_back(r, m, value);
    variance += all[r].variance;
  }
  impl_->grid = grid;
  impl_->a = Sparse(rows, columns);
  impl_->a.setFromTriplets(entries.begin(), entries.end());
  impl_->a.makeCompressed();
  const double norm = impl_->a.norm();
  if (!(norm > 0))
    throw InputError("measured filter", "is opaque over all functions of the basis",
                     "measure the filter that the session was taken with");
  impl_->matrix_noise = std::sqrt(variance) / norm;
  impl_->Factorise();
  impl_->FindSingularValues();
  impl_->Invert();
}

FilterSystem::~FilterSystem() = default;
FilterSystem::FilterSystem(FilterSystem&&) noexcept = default;

int FilterSystem::rows() const { return static_cast<int>(impl_->a.rows()); }
int FilterSystem::columns() const { return static_cast<int>(impl_->a.cols()); }
std::size_t FilterSystem::entries() const { return static_cast<std::size_t>(impl_->a.nonZeros()); }
double FilterSystem::smallest_singular_value() const { return impl_->smallest; }
double FilterSystem::largest_singular_value() const { return impl_->largest; }
double FilterSystem::matrix_noise() const { return impl_->matrix_noise; }
const std::vector<double>& FilterSystem::PseudoInverse() const { return impl_->pseudo_inverse; }

Vec2 FilterSystem::centre(int row) const { return impl_->centres_m[row]; }

InteriorSamples FilterSystem::SampleInterior(int per_cell) const {
  const BasisGrid& grid = impl_->grid;
  BasisGrid samples;
  samples.basis = lightfield::Basis::Make(lightfield::BasisKind::kBox);
  samples.width = per_cell * (grid.width - grid.basis.cells + 1);
  samples.height = per_cell * (grid.height - grid.basis.cells + 1);
  samples.spacing_m = grid.spacing_m / per_cell;
  samples.u0_m = grid.u0_m + (grid.basis.cells - 1) * grid.spacing_m;
  samples.v0_m = grid.v0_m + (grid.basis.cells - 1) * grid.spacing_m;
  InteriorSamples result{samples.width, samples.height, {}};
  result.filters.resize(impl_->centres_m.size());
  core::ParallelFor(result.filters.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      const Vec2 centre = impl_->centres_m[r];
      if (!impl_->filter) {
        result.filters[r] = IdealSamples(grid, samples, centre);
        continue;
      }
      const double area = samples.spacing_m * samples.spacing_m;
      for (const auto& [point, integral] :
           MeasuredRow(samples, *impl_->filter, impl_->transmittance, centre).entries)
        result.filters[r].emplace_back(point, integral / area);
    }
  });
  return result;
}

std::vector<double> FilterSystem::Dense() const {
  const RowMatrix dense = impl_->a;
  return {dense.data(), dense.data() + dense.size()};
}

double FilterSystem::noise_gain() const {
  double sum = 0;
  for (const double x : impl_->pseudo_inverse) sum += x * x;
  return std::sqrt(sum / columns());
}

std::optional<SeparableSystem> FilterSystem::Separable(double tolerance) const {
  if (!impl_->square()) return {};
  const int width = impl_->grid.width, height = impl_->grid.height;
  const SparseRows a = impl_->a;
  RowMatrix u = RowMatrix::Zero(width, width), v = RowMatrix::Zero(height, height);
  // fn(entry, i, k, j, n) of every entry that is not zero.
  const auto for_each = [&](auto&& fn) {
    for (int r = 0; r < a.rows(); ++r)
      for (SparseRows::InnerIterator it(a, r); it; ++it) {
        const auto m = static_cast<int>(it.col());
        fn(it.value(), r % width, m % width, r / width, m / width);
      }
  };
  const int middle = height / 2;
  for_each([&](double x, int i, int k, int j, int n) {
    if (j == middle && n == middle) u(i, k) = x;
  });
  const double power = impl_->a.squaredNorm();
  double residual = 1;
  for (int iteration = 0; iteration < 20; ++iteration) {
    if (!(u.squaredNorm() > 0)) return {};
    v.setZero();
    for_each([&](double x, int i, int k, int j, int n) { v(j, n) += x * u(i, k); });
    v /= u.squaredNorm();
    u.setZero();
    for_each([&](double x, int i, int k, int j, int n) { u(i, k) += x * v(j, n); });
    u /= v.squaredNorm();
    // At the least-squares u, |A - V (x) U|^2 = |A|^2 - |U|^2 |V|^2.
    const double now = std::max(0.0, 1 - u.squaredNorm() * v.squaredNorm() / power);
    const bool settled = std::abs(now - residual) <= 1e-3 * now;
    residual = now;
    if (settled) break;
  }
  // Cancellation leaves about 1e-8 of the norm unresolved.
  if (!(std::sqrt(residual) <= std::max(tolerance, 3e-8))) return {};
  SeparableSystem result{width, height, {}, {}};
  result.u.assign(u.data(), u.data() + u.size());
  result.v.assign(v.data(), v.data() + v.size());
  return result;
}

}  // namespace luxfield::reconstruct
