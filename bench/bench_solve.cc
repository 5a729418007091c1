#include "luxfield/bench/bench_solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/non_negative.h"

namespace luxfield::bench {
namespace {

template <typename Work>
double Seconds(Work&& work) {
  const core::Stopwatch stopwatch;
  work();
  return stopwatch.WallSeconds();
}

template <typename Storage, typename Work>
nlohmann::json Row(const reconstruct::GramSolver& solver, const BenchSolveOptions& options,
                   const char* precision) {
  const std::size_t pixels =
      static_cast<std::size_t>(options.size) * options.size * options.channels;
  const std::size_t count = static_cast<std::size_t>(solver.count());
  std::vector<Storage> irradiance(count * pixels), coefficients(count * pixels);
  std::vector<const Storage*> in;
  std::vector<Storage*> out;
  for (std::size_t m = 0; m < count; ++m) {
    in.push_back(irradiance.data() + m * pixels);
    out.push_back(coefficients.data() + m * pixels);
  }
  core::ParallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      core::Random random(1, m);
      for (std::size_t p = 0; p < pixels; ++p) irradiance[m * pixels + p] = random.UniformFloat();
    }
  });

  std::vector<double> solve_s, copy_s;
  constexpr std::size_t kCopyPiece = std::size_t{1} << 18;
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    copy_s.push_back(Seconds([&] {
      core::ParallelFor(irradiance.size(), kCopyPiece, [&](std::size_t begin, std::size_t end) {
        std::memcpy(coefficients.data() + begin, irradiance.data() + begin,
                    (end - begin) * sizeof(Storage));
      });
    }));
    solve_s.push_back(Seconds([&] { solver.Solve<Storage, Work>(in.data(), out.data(), pixels); }));
  }
  const double wall_s = core::Median(solve_s);
  const double bytes = 2.0 * static_cast<double>(irradiance.size() * sizeof(Storage));
  return {{"case", fmt::format("{} images {} x {} x {}, {}", count, options.size, options.size,
                               options.channels, precision)},
          {"wall_s", wall_s},
          {"gb_per_s", bytes / wall_s * 1e-9},
          {"copy_ratio", wall_s / core::Median(copy_s)}};
}

// C >= 0 of image m: a spot of its own place and brightness over a dim ground.
class Spot {
 public:
  Spot(int m, const BenchSolveOptions& options) : size_(options.size) {
    core::Random random(2, static_cast<std::uint64_t>(m));
    const double i = m % options.grid_width - 0.5 * (options.grid_width - 1);
    const double j = m / options.grid_width - 0.5 * (options.grid_height - 1);
    x_ = size_ * (0.3 + 0.4 * random.Uniform());
    y_ = size_ * (0.3 + 0.4 * random.Uniform());
    brightness_ = (0.3 + random.Uniform()) *
                  std::exp(-i * i / (0.05 * options.grid_width * options.grid_width) -
                           j * j / (0.07 * options.grid_height * options.grid_height));
  }
  double operator()(int column, int row) const {
    const double x = (column - x_) / size_, y = (row - y_) / size_;
    return brightness_ * (std::exp(-(x * x + y * y) / 0.003) + 1e-3);
  }

 private:
  int size_;
  double x_, y_, brightness_;
};

// RMSE over RMS of the truth.
double Error(const std::vector<float>& values, const std::vector<float>& truth, bool clamp) {
  double square = 0, power = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const double value = clamp ? std::max(values[k], 0.0f) : values[k], off = value - truth[k];
    square += off * off;
    power += double{truth[k]} * truth[k];
  }
  return std::sqrt(square / power);
}

nlohmann::json NonNegativeRow(const reconstruct::GramSolver& solver,
                              const BenchSolveOptions& options) {
  const int count = solver.count(), width = solver.u().count, height = solver.v().count;
  const std::size_t plane = static_cast<std::size_t>(options.size) * options.size,
                    pixels = plane * options.channels;
  std::vector<float> truth(count * pixels), noisy(truth.size());
  std::vector<float*> rows;
  for (int m = 0; m < count; ++m) rows.push_back(noisy.data() + m * pixels);
  for (int m = 0; m < count; ++m) {
    const Spot spot(m, options);
    for (std::size_t p = 0; p < pixels; ++p)
      truth[m * pixels + p] = static_cast<float>(
          spot(static_cast<int>(p % options.size), static_cast<int>(p % plane) / options.size));
  }
  // E = G C, in double.
  double largest = 0;
  std::vector<double> c(count), e(count);
  for (std::size_t p = 0; p < pixels; ++p) {
    for (int m = 0; m < count; ++m) c[m] = truth[m * pixels + p];
    solver.Forward(c.data(), e.data());
    for (int m = 0; m < count; ++m) {
      noisy[m * pixels + p] = static_cast<float>(e[m]);
      largest = std::max(largest, e[m]);
    }
  }
  core::ParallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      core::Random random(3, m);
      for (std::size_t p = 0; p < pixels; ++p)
        noisy[m * pixels + p] += static_cast<float>(options.noise * largest * random.Normal());
    }
  });
  solver.Solve<float, float>(rows.data(), rows.data(), pixels);
  const double signed_error = Error(noisy, truth, false), clamped_error = Error(noisy, truth, true);
  reconstruct::NonNegativeSummary summary;
  const double wall_s =
      Seconds([&] { summary = reconstruct::ProjectNonNegative(solver, rows.data(), pixels); });
  const double bytes = 2.0 * static_cast<double>(noisy.size() * sizeof(float));
  return {{"case", fmt::format("{} images {} x {} x {}, non-negative", width * height, options.size,
                               options.size, options.channels)},
          {"wall_s", wall_s},
          {"gb_per_s", bytes / wall_s * 1e-9},
          {"iterations", summary.iterations},
          {"kkt_residual", summary.worst_residual},
          {"signed_error", signed_error},
          {"clamped_error", clamped_error},
          {"error", Error(noisy, truth, false)}};
}

}  // namespace

nlohmann::json BenchSolve(const BenchSolveOptions& options) {
  if (std::min({options.grid_width, options.grid_height, options.size, options.channels,
                options.repeats}) < 1 ||
      !(options.noise >= 0))
    throw InputError(
        "bench solve: grid, size, channels and repeats must be at least 1, the noise at least 0");
  lightfield::BasisGrid grid;
  grid.width = options.grid_width;
  grid.height = options.grid_height;
  grid.spacing_m = 1;
  const reconstruct::GramSolver solver(grid);
  if (options.float_only)
    return nlohmann::json::array({Row<float, float>(solver, options, "float")});
  return nlohmann::json::array({Row<float, float>(solver, options, "float"),
                                Row<float, double>(solver, options, "float swept in double"),
                                Row<double, double>(solver, options, "double"),
                                NonNegativeRow(solver, options)});
}

}  // namespace luxfield::bench
