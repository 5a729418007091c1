#include "luxfield/reconstruct/solve/kept_moments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/reconstruct/solve/adjoint_solve.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Measurements;

constexpr std::uint64_t kSeed = 20262;

lightfield::LuminaireGeometry Geometry(BasisKind kind, int width, int height, int texels = 3) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.6;
  geometry.grid = BasisGrid::Centred(Basis::Make(kind), width, height, 0.033);
  geometry.lattice = {texels, 2, -0.3, 0.2, 0.6 / texels, 0.2};
  return geometry;
}

// Light of rectangles on F, [x0, x1] x [y0, y1] in metres, each of a constant E(u->s) per texel.
struct Patch {
  double x0, x1, y0, y1, strength;
};

double Overlap(const BasisGrid& grid, double first, int k, double x0, double x1) {
  const double h = grid.spacing_m;
  return h * grid.basis.Integral((x0 - first) / h - k, (x1 - first) / h - k);
}

// Exactly what ideal filters measure; texel p sees the patches (1 + p / 10) times as bright.
Measurements Measure(const lightfield::LuminaireGeometry& geometry,
                     const std::vector<Patch>& patches, float sigma = 0) {
  const BasisGrid& grid = geometry.grid;
  Measurements result;
  result.geometry = geometry;
  for (int m = 0; m < grid.count(); ++m) {
    double e = 0;
    for (const Patch& patch : patches)
      e += patch.strength * Overlap(grid, grid.u0_m, m % grid.width, patch.x0, patch.x1) *
           Overlap(grid, grid.v0_m, m / grid.width, patch.y0, patch.y1);
    lightfield::Measurement& position = result.positions.emplace_back();
    for (std::size_t p = 0; p < geometry.plane_size(); ++p)
      position.irradiance.push_back(static_cast<float>(e * (1 + 0.1 * static_cast<double>(p))));
    position.sigma.assign(geometry.plane_size(), sigma);
    position.count.assign(geometry.plane_size(), 1);
    position.mask.assign(geometry.plane_size(), 0);
  }
  return result;
}

struct Moments {
  double flux = 0, u = 0, v = 0;  // integral over F of E, u E, v E
};

// Of the coefficients of a texel: symmetric functions have their first moment about their centre 0.
Moments MomentsOf(const LightField& field, std::size_t texel) {
  const BasisGrid& grid = field.geometry.grid;
  Moments result;
  for (int m = 0; m < grid.count(); ++m) {
    const double flux = grid.PhiIntegral() * field.image(m, 0)[texel];
    const auto centre = grid.centre(m % grid.width, m / grid.width);
    result.flux += flux;
    result.u += centre.x * flux;
    result.v += centre.y * flux;
  }
  return result;
}

Moments MomentsOf(const std::vector<Patch>& patches) {
  Moments result;
  for (const Patch& p : patches) {
    const double flux = p.strength * (p.x1 - p.x0) * (p.y1 - p.y0);
    result.flux += flux;
    result.u += 0.5 * (p.x0 + p.x1) * flux;
    result.v += 0.5 * (p.y0 + p.y1) * flux;
  }
  return result;
}

Reconstruction Solve(const Measurements& measurements, Keep keep) {
  ReconstructOptions options;
  options.precision = Precision::kDouble;
  options.keep = keep;
  return Reconstruct(measurements, options);
}

// A square of two cells: least squares alone gain and lose what a 1-D projection says (squared: two
// axes), moments that are kept are those of the square.
TEST(KeptMoments, FluxOfASquareOfTwoCells) {
  struct Case {
    BasisKind kind;
    int count;
    double of_least_squares;
  };
  for (const Case& c :
       {Case{BasisKind::kBspline2, 4, 0.9471}, Case{BasisKind::kBspline2, 6, 1.0222},
        Case{BasisKind::kBspline2, 8, 0.9906}, Case{BasisKind::kBilinear, 3, 1.148},
        Case{BasisKind::kBilinear, 5, 0.9619}, Case{BasisKind::kBilinear, 7, 1.0104}}) {
    const auto geometry = Geometry(c.kind, c.count, c.count);
    const std::vector<Patch> square{{-0.033, 0.033, -0.033, 0.033, 1e4}};
    const Measurements measured = Measure(geometry, square);
    const double flux = MomentsOf(square).flux;
    EXPECT_NEAR(MomentsOf(Solve(measured, Keep::kNone).coefficients, 0).flux / flux,
                c.of_least_squares, 6e-4)
        << c.count;
    for (const Keep keep : {Keep::kFlux, Keep::kMoments})
      EXPECT_NEAR(MomentsOf(Solve(measured, keep).coefficients, 0).flux, flux, 2e-6 * flux)
          << c.count << " " << KeepName(keep);
  }
}

TEST(KeptMoments, AreThoseOfTheLamp) {
  for (const BasisKind kind : {BasisKind::kBilinear, BasisKind::kBspline2}) {
    const auto geometry = Geometry(kind, 9, 7);
    // Inside the interior cells: 7 x 5 of 9 x 7 bspline2, 8 x 6 of 9 x 7 bilinear.
    const std::vector<Patch> patches{{-0.1, 0.02, -0.07, 0.01, 1e4}, {0.05, 0.055, 0, 0.08, 7e4}};
    const auto kept = Solve(Measure(geometry, patches), Keep::kMoments);
    ASSERT_EQ(kept.report.kept.u, 2);
    ASSERT_EQ(kept.report.kept.v, 2);
    const Moments truth = MomentsOf(patches);
    for (std::size_t p = 0; p < geometry.plane_size(); ++p) {
      const Moments found = MomentsOf(kept.coefficients, p);
      const double times = 1 + 0.1 * static_cast<double>(p), flux = times * truth.flux;
      // E and C are float32: 6e-8 each of sums of 63 terms up to 3 times their result.
      EXPECT_NEAR(found.flux, flux, 1e-6 * flux);
      EXPECT_NEAR(found.u, times * truth.u, 1e-6 * 0.15 * flux);
      EXPECT_NEAR(found.v, times * truth.v, 1e-6 * 0.15 * flux);
    }
    const auto flux_only = Solve(Measure(geometry, patches), Keep::kFlux);
    EXPECT_NEAR(MomentsOf(flux_only.coefficients, 0).flux, truth.flux, 1e-6 * truth.flux);
    EXPECT_GT(std::abs(MomentsOf(flux_only.coefficients, 0).u - truth.u), 1e-5 * 0.15 * truth.flux);
  }
}

// C >= 0 has the lamp's flux and first moments too, where the signed solution has them: a sharp
// square and a filament, whose solutions ring below 0.
TEST(KeptMoments, AreThoseOfTheLampWithoutNegativeLight) {
  const auto geometry = Geometry(BasisKind::kBspline2, 9, 8);
  for (const std::vector<Patch>& patches : {std::vector<Patch>{{-0.05, 0.04, -0.06, 0.03, 1e4}},
                                            std::vector<Patch>{{0.011, 0.014, -0.07, 0.07, 1e6}}}) {
    const Moments truth = MomentsOf(patches);
    const auto off = [&](Keep keep) {
      ReconstructOptions options;
      options.keep = keep;
      options.non_negative = true;
      const auto result = Reconstruct(Measure(geometry, patches), options);
      EXPECT_GE(*std::min_element(result.coefficients.data.begin(), result.coefficients.data.end()),
                0);
      EXPECT_EQ(result.report.non_negative->pixels, geometry.plane_size());
      EXPECT_EQ(result.report.non_negative->moments_lost, 0u);
      const Moments found = MomentsOf(result.coefficients, 0);
      return Moments{found.flux / truth.flux - 1, (found.u - truth.u) / (0.15 * truth.flux),
                     (found.v - truth.v) / (0.15 * truth.flux)};
    };
    const Moments kept = off(Keep::kMoments);
    EXPECT_NEAR(kept.flux, 0, 1e-6);
    EXPECT_NEAR(kept.u, 0, 1e-6);
    EXPECT_NEAR(kept.v, 0, 1e-6);
    const Moments flux = off(Keep::kFlux), none = off(Keep::kNone);
    EXPECT_NEAR(flux.flux, 0, 1e-6);
    EXPECT_GT(std::abs(flux.u) + std::abs(flux.v), 1e-5);
    EXPECT_GT(std::abs(none.flux), 1e-4);
  }
}

// `none` is the Gram solve alone, to the bit; box and quadratic have no moments to keep.
TEST(KeptMoments, NoneIsTheGramSolveAlone) {
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    const auto geometry = Geometry(kind, 7, 6);
    const Measurements measured = Measure(geometry, {{-0.05, 0.03, -0.04, 0.02, 3e3}});
    LightField plain(geometry);
    std::vector<const float*> in;
    std::vector<float*> out;
    for (int m = 0; m < geometry.grid.count(); ++m) {
      in.push_back(measured.positions[m].irradiance.data());
      out.push_back(plain.image(m, 0).data());
    }
    GramSolver(geometry.grid).Solve<float, float>(in.data(), out.data(), geometry.plane_size());
    ReconstructOptions options;
    options.keep = Keep::kNone;
    EXPECT_EQ(Reconstruct(measured, options).coefficients.data, plain.data);
    if (kind == BasisKind::kBox || kind == BasisKind::kQuadratic)
      EXPECT_EQ(Reconstruct(measured).coefficients.data, plain.data);
    else
      EXPECT_NE(Reconstruct(measured).coefficients.data, plain.data);
  }
}

// Least squares of what has those moments anyway changes nothing: the map brings back every C of
// functions that lie inside the interior cells.
TEST(KeptMoments, LeaveWhatTheBasisHoldsInside) {
  const auto geometry = Geometry(BasisKind::kBspline2, 8, 9);
  const BasisGrid& grid = geometry.grid;
  core::Random random(kSeed, 1);
  std::vector<double> truth(grid.count()), e(grid.count());
  for (int m = 0; m < grid.count(); ++m) {
    const int i = m % grid.width, j = m / grid.width;
    if (i > 1 && i < grid.width - 2 && j > 1 && j < grid.height - 2) truth[m] = random.Normal();
  }
  GramSolver(grid).Forward(truth.data(), e.data());
  std::vector<const double*> in;
  std::vector<double> c(grid.count());
  std::vector<double*> out;
  for (int m = 0; m < grid.count(); ++m) in.push_back(&e[m]), out.push_back(&c[m]);
  GramSolver(grid, {2, 2}).Solve<double, double>(in.data(), out.data(), 1);
  for (int m = 0; m < grid.count(); ++m) EXPECT_NEAR(c[m], truth[m], 1e-12) << m;
}

// C - C_true over sigma(C) of many noisy captures, noise uneven by a factor of 10 between
// positions: the variance that is stated is the map's.
TEST(KeptMoments, SigmaIsThatOfTheMap) {
  constexpr int kTexels = 6000;
  auto geometry = Geometry(BasisKind::kBspline2, 6, 5, kTexels);
  Measurements noisy =
      Measure(Geometry(BasisKind::kBspline2, 6, 5), {{-0.05, 0.04, -0.03, 0.02, 1e4}});
  noisy.geometry = geometry;
  core::Random random(kSeed, 2);
  double largest = 0;
  std::vector<double> exact;
  for (const auto& position : noisy.positions) {
    exact.push_back(position.irradiance[0]);
    largest = std::max(largest, exact.back());
  }
  for (std::size_t m = 0; m < exact.size(); ++m) {
    auto& position = noisy.positions[m];
    const double sigma = 0.02 * largest * std::pow(10, -random.Uniform());
    position.irradiance.clear();
    for (std::size_t p = 0; p < geometry.plane_size(); ++p)
      position.irradiance.push_back(static_cast<float>(exact[m] + sigma * random.Normal()));
    position.sigma.assign(geometry.plane_size(), static_cast<float>(sigma));
    position.count.assign(geometry.plane_size(), 1);
    position.mask.assign(geometry.plane_size(), 0);
  }
  const auto solved = Solve(noisy, Keep::kMoments);
  ASSERT_EQ(solved.report.kept.u, 2);
  std::vector<const double*> in;
  std::vector<double> c(exact.size());
  std::vector<double*> out;
  for (std::size_t m = 0; m < exact.size(); ++m) in.push_back(&exact[m]), out.push_back(&c[m]);
  GramSolver(geometry.grid, {2, 2}).Solve<double, double>(in.data(), out.data(), 1);
  const auto texels = static_cast<double>(geometry.plane_size());
  double worst = 0;
  for (int m = 0; m < geometry.grid.count(); ++m) {
    double pull2 = 0;
    for (std::size_t p = 0; p < geometry.plane_size(); ++p) {
      const double pull = (solved.coefficients.image(m, 0)[p] - c[m]) / solved.sigma.image(m, 0)[p];
      pull2 += pull * pull;
    }
    const double z = (pull2 - texels) / std::sqrt(2 * texels);
    worst = std::max(worst, std::abs(z));
  }
  std::printf("seed %llu: worst z of %d chi-squared %.2f\n", static_cast<unsigned long long>(kSeed),
              geometry.grid.count(), worst);
  EXPECT_LT(worst, 4.5);
}

// The weights of E are the transpose of the map that the solve takes, moments included.
TEST(KeptMoments, AdjointIsTheTransposeOfTheSolve) {
  const auto geometry = Geometry(BasisKind::kBilinear, 7, 6);
  const Measurements measured = Measure(geometry, {{-0.05, 0.03, -0.04, 0.02, 3e3}});
  core::Random random(kSeed, 3);
  for (const Keep keep : {Keep::kNone, Keep::kFlux, Keep::kMoments}) {
    const auto solved = Solve(measured, keep);
    lightfield::Weights q(geometry.value_count());
    for (double& x : q) x = random.Normal();
    const lightfield::Weights w = AdjointSolve(measured, q, nullptr, keep);
    double of_c = 0, of_e = 0, size = 0;
    for (std::size_t k = 0; k < q.size(); ++k) {
      of_c += q[k] * solved.coefficients.data[k];
      const double term =
          w[k] *
          measured.positions[k / geometry.plane_size()].irradiance[k % geometry.plane_size()];
      of_e += term;
      size += std::abs(term);
    }
    EXPECT_NEAR(of_c, of_e, 1e-6 * size) << KeepName(keep);
  }
}

// A lamp that fills the interior cells is inside; one that reaches half a cell further on one side
// is not, and only moments across that side are given up.
TEST(EdgeLight, SeesTheSideThatTheLampReaches) {
  for (const BasisKind kind : {BasisKind::kBilinear, BasisKind::kBspline2}) {
    const auto geometry = Geometry(kind, 8, 9);
    const double h = geometry.grid.spacing_m, cells = geometry.grid.basis.cells;
    const double u = 0.5 * (8 - cells + 1) * h, v = 0.5 * (9 - cells + 1) * h;
    const auto inside = Solve(Measure(geometry, {{-u, u, -v, v, 1e4}}), Keep::kMoments);
    EXPECT_FALSE(inside.report.edges->reached());
    EXPECT_TRUE(inside.report.warnings.empty());
    EXPECT_NEAR(inside.report.edges->sides[0].ratio, kind == BasisKind::kBspline2 ? 0.2 : 0.5,
                1e-6);
    const std::vector<Patch> beyond{{-u, u + 0.5 * h, -v, v, 1e4}};
    const auto reaching = Solve(Measure(geometry, beyond), Keep::kMoments);
    const auto& sides = reaching.report.edges->sides;
    EXPECT_FALSE(sides[0].reached);
    EXPECT_TRUE(sides[1].reached) << sides[1].ratio;
    EXPECT_FALSE(sides[2].reached || sides[3].reached);
    EXPECT_EQ(reaching.report.kept.u, 0);
    EXPECT_EQ(reaching.report.kept.v, 2);
    ASSERT_EQ(reaching.report.warnings.size(), 1u);
    EXPECT_NE(reaching.report.warnings[0].find("side +u"), std::string::npos);
    // sum E is less than the lamp's flux, by what the ramp keeps from it.
    double truth = 0;
    for (std::size_t p = 0; p < geometry.plane_size(); ++p)
      truth += MomentsOf(beyond).flux * (1 + 0.1 * static_cast<double>(p)) *
               geometry.lattice.texel_area_m2();
    EXPECT_LT(reaching.report.edges->measured_flux, truth * (1 - 1e-4));
    EXPECT_GT(reaching.report.edges->measured_flux, 0.95 * truth);
  }
}

// Noise alone, and the little light of a dim halo, are no light in the ramps; three times out of
// four thousand noise may say so.
TEST(EdgeLight, IsAboveNoise) {
  const auto geometry = Geometry(BasisKind::kBspline2, 7, 6);
  core::Random random(kSeed, 4);
  constexpr int kDraws = 1000;
  int reached = 0;
  for (int n = 0; n < kDraws; ++n) {
    std::vector<double> light, variance;
    for (int m = 0; m < geometry.grid.count(); ++m) {
      const bool middle = m % 7 == 3 && m / 7 == 3;
      light.push_back((middle ? 50 : 0) + random.Normal());
      variance.push_back(1);
    }
    for (const auto& side : FindEdgeLight(geometry.grid, light, variance).sides)
      reached += side.reached;
  }
  // Four sides, one tail of 3 sigma: 1.35e-3; six of their Poisson deviations above.
  EXPECT_LT(reached, 4 * kDraws * 1.35e-3 + 6 * std::sqrt(4 * kDraws * 1.35e-3));
  std::vector<double> light(geometry.grid.count(), 0.02), variance(light.size(), 1e-12);
  light[3 * 7 + 3] = 1000;
  EXPECT_FALSE(FindEdgeLight(geometry.grid, light, variance).reached());
  EXPECT_EQ(MomentsToKeep(geometry.grid, Keep::kFlux, {}).u, 1);
}

TEST(KeptMoments, NamesAreRefusedByName) {
  EXPECT_EQ(KeepFromName("flux"), Keep::kFlux);
  try {
    KeepFromName("energy");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'energy'"), std::string::npos);
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
