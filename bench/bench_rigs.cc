#include "luxfield/bench/bench_rigs.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::bench {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::FilterKind;

constexpr double kBsplineScale = 16.0 / 9;  // to full transmittance

// Standard deviation of one position's E in units of h^2, both captures in it.
double SingleSigma(bool shot) {
  // Light of radiance 1 behind the print: scale, since the spline's integral is 1.
  const double capture = shot ? std::sqrt(kBsplineScale) : 1;
  return capture / kBsplineScale / std::sqrt(2.0);
}

double DualSigma(const Basis& basis, bool shot) {
  // Integrals of the dual function's positive and negative part, and hence of the two prints.
  double positive = 0, negative = 0;
  constexpr int kSteps = 20000;  // piecewise quadratic: the midpoint rule is good to 1e-8
  for (int n = 0; n < kSteps; ++n) {
    const double value = basis.DualValue((n + 0.5) / kSteps);
    (value > 0 ? positive : negative) += 2 * std::abs(value) / kSteps;  // it is even
  }
  const auto peaks = basis.DualPeaks();
  const double light_plus = positive * positive + negative * negative,
               light_minus = 2 * positive * negative;
  // E = peak(+) E(+) - peak(-) E(-), E(+-) = light(+-) / peak(+-).
  return shot ? std::sqrt(peaks[0] * light_plus + peaks[1] * light_minus)
              : std::hypot(peaks[0], peaks[1]);
}

struct Noise {
  double sigma_c = 0, spread_c = 0, spread_l = 0;
};

// Noise alone through the solve, which is linear.
Noise Measure(const Basis& basis, FilterKind filter, double sigma,
              const BenchRigsOptions& options) {
  lightfield::Measurements measurements;
  auto& geometry = measurements.geometry;
  geometry.delta_m = 1;
  geometry.grid = {basis, options.grid_width, options.grid_height, 0, 0, 1};
  geometry.lattice = {options.size, options.size, 0, 0, 1, 1};
  measurements.filter = filter;
  const std::size_t texels = geometry.plane_size();
  for (int m = 0; m < geometry.grid.count(); ++m) {
    core::Random random(options.seed, static_cast<std::uint64_t>(m));
    auto& position = measurements.positions.emplace_back();
    for (std::size_t p = 0; p < texels; ++p)
      position.irradiance.push_back(static_cast<float>(sigma * random.Normal()));
    position.sigma.assign(texels, static_cast<float>(sigma));
    position.count.assign(texels, 1);
    position.mask.assign(texels, 0);
  }
  const auto result = reconstruct::Reconstruct(measurements);
  const auto rms = [](std::span<const float> values) {
    double squares = 0;
    for (const float x : values) squares += double{x} * x;
    return std::sqrt(squares / static_cast<double>(values.size()));
  };

  std::vector<float> radiance;
  const int n = basis.cells;
  for (std::size_t p = 0; p < texels; ++p) {
    core::Random random(options.seed, 1000000 + p);
    // A cell that n functions cover on each axis, and a place in it.
    const int i = static_cast<int>(random.Uniform() * (options.grid_width - n + 1)),
              j = static_cast<int>(random.Uniform() * (options.grid_height - n + 1));
    const double u = random.Uniform(), v = random.Uniform();
    double sum = 0;
    for (int dj = 0; dj < n; ++dj)
      for (int di = 0; di < n; ++di)
        sum += result.coefficients.image(geometry.grid.index(i + di, j + dj), 0)[p] *
               basis.Value(n - 1 - di + u) * basis.Value(n - 1 - dj + v);
    radiance.push_back(static_cast<float>(sum));
  }
  return {rms(result.sigma.data), rms(result.coefficients.data), rms(radiance)};
}

}  // namespace

nlohmann::json BenchRigs(const BenchRigsOptions& options) {
  if (options.size < 1 || std::min(options.grid_width, options.grid_height) < 3)
    throw InputError("bench rigs: the grid must be at least 3 x 3 and the size at least 1");
  const Basis spline = Basis::Make(BasisKind::kBspline2);
  const Basis quadratic = Basis::Make(BasisKind::kQuadratic, 0.5);
  nlohmann::json rows = nlohmann::json::array();
  for (const bool shot : {false, true}) {
    const Noise dual = Measure(quadratic, FilterKind::kDual, DualSigma(quadratic, shot), options);
    const Noise single = Measure(spline, FilterKind::kBasis, SingleSigma(shot), options);
    const auto row = [&](const char* rig, const Noise& noise) {
      rows.push_back({{"noise", shot ? "shot" : "read"},
                      {"rig", rig},
                      {"sigma_c", noise.sigma_c},
                      {"spread_c", noise.spread_c},
                      {"spread_l", noise.spread_l}});
    };
    row("dual", dual);
    row("single", single);
    rows.back()["c_ratio"] = single.spread_c / dual.spread_c;
    rows.back()["l_ratio"] = single.spread_l / dual.spread_l;
  }
  return rows;
}

}  // namespace luxfield::bench
