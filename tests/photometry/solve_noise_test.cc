// What follows from sigma(C) against what follows from sigma(E) directly, through the solve run
// backwards.
#include <gtest/gtest.h>

#include <vector>

#include "luxfield/photometry/functional.h"
#include "luxfield/reconstruct/solve/adjoint_solve.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/reconstruct.h"
#include "tests/photometry/lamps.h"

namespace luxfield::photometry {
namespace {

using lightfield::FilterKind;

// Irradiances of a spot inside the grid, sigmas uneven by a factor of five.
lightfield::Measurements MeasurementsOf(FilterKind filter) {
  lightfield::Measurements measurements;
  measurements.filter = filter;
  auto& g = measurements.geometry;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(filter == FilterKind::kDual ? lightfield::BasisKind::kQuadratic
                                                          : lightfield::BasisKind::kBspline2),
      6, 5, 0.02);
  g.lattice = {7, 6, -0.07, 0.06, 0.02, 0.02};
  for (int m = 0; m < g.grid.count(); ++m) {
    auto& position = measurements.positions.emplace_back();
    const int i = m % 6, j = m / 6;
    const float bright = i > 1 && i < 4 && j > 1 && j < 4 ? 1.0f : 0.01f;
    for (std::size_t p = 0; p < g.plane_size(); ++p) {
      position.irradiance.push_back(bright);
      position.sigma.push_back(0.01f * (1 + float((p * 31 + m * 17) % 9) / 2));
    }
    position.count.assign(g.plane_size(), 1);
    position.mask.assign(g.plane_size(), 0);
  }
  return measurements;
}

double FromSigmaOfE(const lightfield::Measurements& measurements, const lightfield::Weights& q) {
  const auto w = reconstruct::AdjointSolve(measurements, q);
  double variance = 0;
  std::size_t k = 0;
  for (const auto& position : measurements.positions)
    for (const float sigma : position.sigma) variance += std::pow(w[k++] * sigma, 2);
  return std::sqrt(variance);
}

// sigma(C) is float32, and propagated in float32: some 1e-6 a coefficient.
TEST(SolveNoise, SigmaOfCSaysWhatSigmaOfESays) {
  for (const FilterKind filter : {FilterKind::kBasis, FilterKind::kDual}) {
    const auto measurements = MeasurementsOf(filter);
    const auto solved = reconstruct::Reconstruct(measurements);
    const auto& g = measurements.geometry;
    if (filter == FilterKind::kBasis) {
      EXPECT_EQ(solved.report.kept.u, 2);
      EXPECT_EQ(solved.report.kept.v, 2);
    }
    Lamp lamp = LampOfField(solved.coefficients);
    SolveMaps maps;
    if (filter == FilterKind::kBasis) {
      const reconstruct::GramSolver solver(g.grid, solved.report.kept);
      maps = {solver.u().map, solver.v().map};
    }
    const std::vector<lightfield::PosedLightField> sigma = {{"", {}, solved.sigma}};
    SetNoise(lamp, sigma, std::vector<SolveMaps>{maps}, "sigma");
    EXPECT_EQ(lamp.noise[0].independent_texels(), 0u);
    const lightfield::Vec3 p{0.03, 0.01, 1.2}, n{0, 0, -1};
    const double flux = FromSigmaOfE(measurements, lightfield::FluxWeights(g)),
                 e = FromSigmaOfE(measurements, lightfield::IrradianceWeights(g, p, n));
    EXPECT_NEAR(Uncertainty(lamp, FluxOf(lamp)).value(), flux, 1e-4 * flux);
    EXPECT_NEAR(Uncertainty(lamp, IlluminanceAt(lamp, p, n)).value(), e, 1e-4 * e);
  }
}

}  // namespace
}  // namespace luxfield::photometry
