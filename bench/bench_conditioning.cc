#include "luxfield/bench/bench_conditioning.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <Eigen/SVD>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/filter_system.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/missing_data.h"

namespace luxfield::bench {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::Vec2;
using reconstruct::FilterSystem;
using reconstruct::GramAxis;
using reconstruct::GramSolver;
using Matrix = Eigen::MatrixXd;

constexpr double kSpacing_m = 0.0165;

// Quadratic B-spline about its centre, x in spacings.
double Spline(double x) {
  x = std::abs(x);
  if (x < 0.5) return 0.75 - x * x;
  return x < 1.5 ? 0.5 * (1.5 - x) * (1.5 - x) : 0;
}

double Tent(double x) { return std::max(0.0, 1 - std::abs(x)); }

// Inner products of filters centred on `filters` with functions centred on `functions`, over [low,
// high]; all in spacings.
Matrix InnerProducts(double (*shape)(double), const std::vector<double>& filters,
                     const std::vector<double>& functions, double low = -1e9, double high = 1e9) {
  constexpr double kReach = 1.5;
  constexpr int kPoints = 12000;
  const double step = 2 * kReach / kPoints;
  Matrix products(filters.size(), functions.size());
  for (std::size_t i = 0; i < filters.size(); ++i)
    for (std::size_t m = 0; m < functions.size(); ++m) {
      double sum = 0;
      if (std::abs(filters[i] - functions[m]) < 2 * kReach)
        for (int k = 0; k < kPoints; ++k) {
          const double x = filters[i] - kReach + (k + 0.5) * step;
          if (x >= low && x <= high) sum += shape(x - filters[i]) * shape(x - functions[m]);
        }
      products(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(m)) = sum * step;
    }
  return products;
}

// Equally spaced filters have a Toeplitz matrix: one row of inner products is all.
Matrix Toeplitz(double (*shape)(double), int count) {
  const Matrix row = InnerProducts(shape, {0}, {0, 1, 2});
  Matrix products = Matrix::Zero(count, count);
  for (int i = 0; i < count; ++i)
    for (int m = std::max(0, i - 2); m <= std::min(count - 1, i + 2); ++m)
      products(i, m) = row(0, std::abs(m - i));
  return products;
}

double Condition(const Matrix& matrix) {
  const Eigen::JacobiSVD<Matrix> svd(matrix);
  return svd.singularValues()(0) / svd.singularValues()(svd.singularValues().size() - 1);
}

std::vector<double> Places(int count, double spacing = 1) {
  std::vector<double> places;
  for (int i = 0; i < count; ++i) places.push_back(i * spacing);
  return places;
}

Matrix Product(const Matrix& u, const Matrix& v) {  // index j * W + i
  Matrix product(u.rows() * v.rows(), u.cols() * v.cols());
  for (Eigen::Index j = 0; j < v.rows(); ++j)
    for (Eigen::Index n = 0; n < v.cols(); ++n)
      product.block(j * u.rows(), n * u.cols(), u.rows(), u.cols()) = v(j, n) * u;
  return product;
}

std::vector<double> Coefficients(int count) {
  core::Random random(1, 0);
  std::vector<double> c;
  for (int m = 0; m < count; ++m) c.push_back(random.Uniform());
  return c;
}

double LargestError(const std::vector<double>& a, const std::vector<double>& b) {
  double error = 0, largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    error = std::max(error, std::abs(a[k] - b[k]));
    largest = std::max(largest, std::abs(b[k]));
  }
  return error / largest;
}

struct Table {
  // Adds a row; `solve` fills in condition, noise_gain and c_error, or refuses.
  void Add(const std::string& name, int width, int height, std::optional<double> predicted,
           const std::function<void(nlohmann::json& row)>& solve) {
    nlohmann::json row{{"case", name}, {"filters", fmt::format("{} x {}", width, height)}};
    try {
      solve(row);
      row["answer"] = "solved";
    } catch (const InputError& refusal) {
      row["answer"] = std::string("refused: ") + refusal.what();
    }
    if (predicted) row["predicted"] = *predicted;
    rows.push_back(std::move(row));
  }
  nlohmann::json rows = nlohmann::json::array();
};

// C from E = (h^2 of) products * C by the separable solve.
void SolveSeparably(const GramSolver& solver, const Matrix& u, const Matrix& v,
                    nlohmann::json& row) {
  const auto c = Coefficients(solver.count());
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
      image(c.data(), v.cols(), u.cols());
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> e =
      kSpacing_m * kSpacing_m * v * image * u.transpose();
  std::vector<double> found(c.size());
  std::vector<const double*> in;
  std::vector<double*> out;
  for (std::size_t m = 0; m < c.size(); ++m) {
    in.push_back(e.data() + m);
    out.push_back(found.data() + m);
  }
  solver.Solve<double, double>(in.data(), out.data(), 1);
  row["condition"] = solver.condition();
  row["noise_gain"] = solver.noise_gain() * kSpacing_m * kSpacing_m;
  row["c_error"] = LargestError(found, c);
}

void SolveForward(const FilterSystem& system, const Matrix& products, nlohmann::json& row) {
  const auto c = Coefficients(system.columns());
  const Eigen::VectorXd e = kSpacing_m * kSpacing_m * products *
                            Eigen::Map<const Eigen::VectorXd>(c.data(), products.cols());
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
      inverse(system.PseudoInverse().data(), system.columns(), system.rows());
  const Eigen::VectorXd found = inverse * e;
  row["condition"] = system.condition();
  row["noise_gain"] = system.noise_gain() * kSpacing_m * kSpacing_m;
  row["c_error"] = LargestError({found.data(), found.data() + found.size()}, c);
}

BasisGrid Grid(BasisKind kind, int width, int height) {
  return BasisGrid::Centred(Basis::Make(kind), width, height, kSpacing_m);
}

std::vector<Vec2> Centres(const BasisGrid& grid, double stretch = 1) {
  std::vector<Vec2> centres;
  const Vec2 origin = grid.centre(0, 0);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      centres.push_back(origin + stretch * (grid.centre(i, j) - origin));
  return centres;
}

void AddCounts(const std::vector<int>& counts, Table& table) {
  for (const int n : counts) {
    const Matrix spline = Toeplitz(Spline, n), tent = Toeplitz(Tent, n);
    const double one = Condition(spline);
    table.Add("bspline2", n, n, one * one, [&](auto& row) {
      SolveSeparably(GramSolver(Grid(BasisKind::kBspline2, n, n)), spline, spline, row);
    });
    const double angle = std::numbers::pi / (n + 1);
    const double closed = (2 + std::cos(angle)) / (2 + std::cos(n * angle));
    table.Add("tent, closed form", n, n, closed * closed, [&](auto& row) {
      SolveSeparably(GramSolver(Grid(BasisKind::kBilinear, n, n)), tent, tent, row);
    });
  }
}

// F is lit only from `cut` spacings inside the outer filters' supports.
void AddClipped(Table& table) {
  constexpr int kWidth = 11, kHeight = 9;
  for (const double cut : {0.5, 1.0, 1.9, 2.9}) {
    const auto clipped = [&](int n) {
      return InnerProducts(Spline, Places(n), Places(n), -1.5 + cut, n + 0.5 - cut);
    };
    const Matrix u = clipped(kWidth), v = clipped(kHeight);
    table.Add(fmt::format("border clips {} spacings of the outer supports", cut), kWidth, kHeight,
              Condition(u) * Condition(v), [&](auto& row) {
                const auto axis = [&](int n, const char* name) {
                  return GramAxis::Factor(lightfield::GramMatrixClipped(
                                              Basis::Make(BasisKind::kBspline2), n, kSpacing_m,
                                              cut * kSpacing_m, (n + 2 - cut) * kSpacing_m),
                                          n, name);
                };
                SolveSeparably(GramSolver(axis(kWidth, "u"), axis(kHeight, "v")), u, v, row);
              });
  }
}

void AddSpacing(Table& table) {
  constexpr int kWidth = 11, kHeight = 9;
  constexpr double kStretch = 1 + 1e-6;
  const BasisGrid grid = Grid(BasisKind::kBspline2, kWidth, kHeight);
  const auto stretched = [&](int n) {
    return InnerProducts(Spline, Places(n, kStretch), Places(n));
  };
  const Matrix u = stretched(kWidth), v = stretched(kHeight);
  const double predicted = Condition(u) * Condition(v);
  table.Add("spacing 1e-6 too wide, assumed right", kWidth, kHeight, predicted,
            [&](auto& row) { SolveSeparably(GramSolver(grid), u, v, row); });
  table.Add("spacing 1e-6 too wide, forward model", kWidth, kHeight, predicted, [&](auto& row) {
    SolveForward(FilterSystem(grid, nullptr, Centres(grid, kStretch)), Product(u, v), row);
  });
}

void AddTwins(Table& table) {
  constexpr int kWidth = 5, kHeight = 4;
  std::vector<double> twice = Places(kWidth);
  twice[2] = twice[1];
  const Matrix u = InnerProducts(Spline, twice, twice);
  table.Add("two columns of filters in one place", kWidth, kHeight, {}, [&](auto&) {
    const Matrix scaled = kSpacing_m * u;
    GramAxis::Factor({scaled.data(), scaled.data() + scaled.size()}, kWidth, "u");
  });
  const BasisGrid grid = Grid(BasisKind::kBspline2, kWidth, kHeight);
  std::vector<Vec2> centres = Centres(grid);
  centres[7] = centres[6];
  table.Add("two filters in one place, forward model", kWidth, kHeight, {},
            [&](auto&) { FilterSystem(grid, nullptr, centres); });
}

void AddMissing(Table& table) {
  constexpr int kWidth = 11, kHeight = 9, kCount = kWidth * kHeight;
  const BasisGrid grid = Grid(BasisKind::kBspline2, kWidth, kHeight);
  const GramSolver solver(grid);
  const Matrix all = Product(Toeplitz(Spline, kWidth), Toeplitz(Spline, kHeight));
  core::Random random(1, 1);
  std::vector<bool> third;
  for (int m = 0; m < kCount; ++m) third.push_back(random.Uniform() < 1.0 / 3);
  const std::vector<std::pair<const char*, std::function<bool(int)>>> cases{
      {"one position missing", [](int m) { return m == 49; }},
      {"a column missing", [](int m) { return m % kWidth == 3; }},
      {"two columns beyond the sensor", [](int m) { return m % kWidth < 2; }},
      {"a third missing at random", [&](int m) { return third[m]; }}};
  for (const auto& [name, missing] : cases) {
    std::vector<bool> known;
    std::vector<Eigen::Index> rows;
    for (int m = 0; m < kCount; ++m) {
      known.push_back(!missing(m));
      if (known.back()) rows.push_back(m);
    }
    const Matrix a = all(rows, Eigen::all);
    table.Add(name, kWidth, kHeight, Condition(a), [&](auto& row) {
      const auto weights = reconstruct::MinimumNormWeights(GramSystem(solver), known).Dense();
      // What is known is met: E of the solution is E of the truth there.
      const auto c = Coefficients(kCount);
      const Eigen::VectorXd e =
          kSpacing_m * kSpacing_m * a * Eigen::Map<const Eigen::VectorXd>(c.data(), kCount);
      const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
          p(weights.weights.data(), kCount, static_cast<Eigen::Index>(rows.size()));
      const Eigen::VectorXd met = kSpacing_m * kSpacing_m * a * (p * e);
      // Singular values of the weights are the inverse of those of the rows.
      row["condition"] = Condition(p);
      row["noise_gain"] = p.norm() / std::sqrt(kCount) * kSpacing_m * kSpacing_m;
      row["c_error"] = (met - e).cwiseAbs().maxCoeff() / e.cwiseAbs().maxCoeff();
      double open = 0;
      for (const double share : weights.prior_share) open += share;
      row["from_prior"] = open / kCount;
    });
  }
}

}  // namespace

nlohmann::json BenchConditioning(const BenchConditioningOptions& options) {
  for (const int n : options.counts)
    if (n < 1 || n > 256)
      throw InputError(fmt::format("--filters = {} must be between 1 and 256", n));
  Table table;
  AddCounts(options.counts, table);
  AddClipped(table);
  AddSpacing(table);
  AddTwins(table);
  AddMissing(table);
  return table.rows;
}

}  // namespace luxfield::bench
