#include "study/bench_solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/stopwatch.h"
#include "reconstruct/gram_solve.h"

namespace luxfield::study {
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

}  // namespace

nlohmann::json BenchSolve(const BenchSolveOptions& options) {
  if (std::min({options.grid_width, options.grid_height, options.size, options.channels,
                options.repeats}) < 1)
    throw InputError("bench solve: grid, size, channels and repeats must be at least 1");
  lightfield::BasisGrid grid;
  grid.width = options.grid_width;
  grid.height = options.grid_height;
  grid.spacing_m = 1;
  const reconstruct::GramSolver solver(grid);
  return nlohmann::json::array({Row<float, float>(solver, options, "float"),
                                Row<float, double>(solver, options, "float swept in double"),
                                Row<double, double>(solver, options, "double")});
}

}  // namespace luxfield::study
