#include "luxfield/bench/missing_rows.h"

#include <cmath>
#include <tuple>
#include <vector>

#include "luxfield/bench/budget_lab.h"
#include "luxfield/bench/mean_squares.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/budget/budget_quantities.h"
#include "luxfield/reconstruct/budget/missing_positions.h"
#include "luxfield/reconstruct/solve/adjoint_solve.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::bench {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Measurements;
using lightfield::Vec2;

constexpr int kFilters = 7;
constexpr double kSpacing_m = 0.03, kDelta_m = 0.3;

LightField RandomLamp(bool dual, std::uint64_t seed, int number) {
  lightfield::LuminaireGeometry g;
  g.delta_m = kDelta_m;
  g.grid = lightfield::BasisGrid::Centred(
      Basis::Make(dual ? BasisKind::kQuadratic : BasisKind::kBspline2), kFilters, kFilters,
      kSpacing_m);
  g.lattice = {6, 4, -0.15, 0.1, 0.05, 0.05};
  g.unit = lightfield::FluxUnit::kLumen;
  LightField lamp(g);
  core::Random random(seed, 0x6D697373, static_cast<std::uint32_t>(number));
  const Vec2 axis{0.1 * random.Uniform() - 0.05, 0.1 * random.Uniform() - 0.05};
  for (int m = 0; m < g.grid.count(); ++m) {
    const double strength = 2 * random.Uniform();
    for (int row = 0; row < g.lattice.height; ++row)
      for (int column = 0; column < g.lattice.width; ++column) {
        const Vec2 off = g.lattice.centre(row, column) - axis;
        lamp.image(m, 0)[static_cast<std::size_t>(row * g.lattice.width + column)] =
            static_cast<float>(strength * std::exp(-(off.x * off.x + off.y * off.y) / 0.08));
      }
  }
  return lamp;
}

bool Missing(int i, int j, int row, int column) {
  return (i == 0 && column < 2) || (j == kFilters - 1 && row == 3) ||
         (i == 3 && j == 2 && column == 4) || (row == 0 && column == 5);
}

// Without noise, but for as much as keeps sigma from being 0.
Measurements Seen(const LightField& lamp, bool dual) {
  const auto& g = lamp.geometry;
  const std::size_t texels = g.plane_size();
  Measurements measurements;
  measurements.geometry = g;
  measurements.filter = dual ? lightfield::FilterKind::kDual : lightfield::FilterKind::kBasis;
  const auto count = static_cast<std::size_t>(g.grid.count());
  measurements.positions.assign(
      count, {std::vector<float>(texels), std::vector<float>(texels, 1e-12f),
              std::vector<float>(texels, 1.0f), std::vector<std::uint32_t>(texels)});
  const reconstruct::GramSolver gram(g.grid);
  std::vector<double> c(count), e(count);
  for (std::size_t p = 0; p < texels; ++p) {
    for (std::size_t m = 0; m < count; ++m) c[m] = lamp.image(static_cast<int>(m), 0)[p];
    if (dual)
      for (std::size_t m = 0; m < count; ++m) e[m] = c[m] * kSpacing_m * kSpacing_m;
    else
      gram.Forward(c.data(), e.data());
    for (std::size_t m = 0; m < count; ++m) {
      auto& position = measurements.positions[m];
      const int row = static_cast<int>(p) / g.lattice.width,
                column = static_cast<int>(p) % g.lattice.width;
      if (Missing(static_cast<int>(m) % kFilters, static_cast<int>(m) / kFilters, row, column)) {
        position.mask[p] = lightfield::kOffSensor;
        position.sigma[p] = 0;
      } else {
        position.irradiance[p] = static_cast<float>(e[m]);
      }
    }
  }
  return measurements;
}

reconstruct::BudgetSettings Asked(const LightField& lamp) {
  const auto& [grid, lattice] = std::tie(lamp.geometry.grid, lamp.geometry.lattice);
  reconstruct::BudgetSettings settings;
  settings.rays = {{"ray at the edge", grid.centre(0, 4), lattice.centre(1, 0)},
                   {"ray amidst", grid.centre(3, 2) + Vec2{0.004, -0.003}, lattice.centre(2, 4)}};
  settings.receivers = {{"axis, 1 m", {0, 0, kDelta_m + 1}, {0, 0, -1}},
                        {"near, aside", {-0.1, 0.1, kDelta_m + 0.3}, {0, 0, -1}}};
  return settings;
}

}  // namespace

nlohmann::json MissingRows(int lamps, std::uint64_t seed, bool dual) {
  MeanSquares squares(kMissingSource);
  core::Progress progress("lamps", static_cast<std::uint64_t>(lamps));
  for (int n = 0; n < lamps; ++n) {
    core::ThrowIfInterrupted();
    const LightField lamp = RandomLamp(dual, seed, n);
    const Measurements measurements = Seen(lamp, dual);
    const LightField field = reconstruct::Reconstruct(measurements).coefficients;
    const auto settings = Asked(lamp);
    const auto truth = QuantitiesOf(lamp, settings), solved = QuantitiesOf(field, settings);
    const auto quantities = reconstruct::AskQuantities(field, settings);
    std::vector<const lightfield::Weights*> of_coefficients, of_irradiances;
    std::vector<lightfield::Weights> weights;
    for (const auto& q : quantities)
      weights.push_back(reconstruct::AdjointSolve(measurements, q.weights));
    for (std::size_t q = 0; q < quantities.size(); ++q) {
      of_coefficients.push_back(&quantities[q].weights);
      of_irradiances.push_back(&weights[q]);
    }
    const auto sigmas =
        reconstruct::MissingSigmas(measurements, field, of_coefficients, of_irradiances);
    for (std::size_t q = 0; q < quantities.size(); ++q)
      squares.Add(quantities[q].name, truth[q], sigmas[q], solved[q] - truth[q]);
    progress.Advance();
  }
  return squares.Rows();
}

}  // namespace luxfield::bench
