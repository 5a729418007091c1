// Rays drawn from light fields: their density against flux and first moments in closed form.
#include "luxfield/preprocess/ray_sampler.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "tests/seed.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LightField;
using lightfield::PosedLightField;

constexpr int kRays = 200000;

PosedLightField Field(lightfield::BasisKind kind) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.2;
  g.unit = lightfield::FluxUnit::kLumen;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind), 3, 2, 0.01);
  g.lattice = {5, 4, -0.05, 0.03, 0.02, 0.015};
  LightField field(g);
  core::Random random(5, 1);
  for (float& c : field.data) c = static_cast<float>(random.Uniform());
  return {"", {}, field};
}

// Mean of u, v, s, t over E / flux: sum of C times the products' first moments.
struct Moments {
  double u = 0, v = 0, s = 0, t = 0;
};
Moments Exact(const LightField& field) {
  const auto& g = field.geometry;
  Moments sum;
  double flux = 0;
  for (int m = 0; m < g.grid.count(); ++m) {
    const auto centre = g.grid.centre(m % g.grid.width, m / g.grid.width);
    for (int row = 0; row < g.lattice.height; ++row)
      for (int column = 0; column < g.lattice.width; ++column) {
        const double c = field.image(m, 0)[row * g.lattice.width + column];
        const auto texel = g.lattice.centre(row, column);
        flux += c;
        sum.u += c * centre.x, sum.v += c * centre.y, sum.s += c * texel.x, sum.t += c * texel.y;
      }
  }
  return {sum.u / flux, sum.v / flux, sum.s / flux, sum.t / flux};
}

void ExpectMean(double sum, double sum_of_squares, double exact) {
  const double mean = sum / kRays, variance = sum_of_squares / kRays - mean * mean;
  EXPECT_LT(std::abs(mean - exact), 5 * std::sqrt(variance / kRays)) << mean << " " << exact;
}

TEST(RaySampler, HasTheMomentsOfTheFluxDensity) {
  const auto seed = TestSeed(17);
  for (const auto kind : {lightfield::BasisKind::kBox, lightfield::BasisKind::kBilinear,
                          lightfield::BasisKind::kQuadratic, lightfield::BasisKind::kBspline2}) {
    const PosedLightField field = Field(kind);
    const RaySampler sampler(std::span(&field, 1), "x");
    EXPECT_NEAR(sampler.flux() / lightfield::TotalFlux(field.field)[0], 1, 1e-12);
    core::Random random(seed, 1);
    double sums[4] = {}, squares[4] = {};
    for (int k = 0; k < kRays; ++k) {
      const DrawnRay ray = sampler.Draw(random);
      const double to_i = 0.2 / ray.direction.z;
      const double values[4] = {ray.position_m.x, ray.position_m.y,
                                ray.position_m.x + to_i * ray.direction.x,
                                ray.position_m.y + to_i * ray.direction.y};
      for (int q = 0; q < 4; ++q) sums[q] += values[q], squares[q] += values[q] * values[q];
    }
    const Moments exact = Exact(field.field);
    ExpectMean(sums[0], squares[0], exact.u);
    ExpectMean(sums[1], squares[1], exact.v);
    ExpectMean(sums[2], squares[2], exact.s);
    ExpectMean(sums[3], squares[3], exact.t);
  }
}

// Of bspline2, second moments too: the variance of the sum of three uniforms is 1/4 h^2.
TEST(RaySampler, SpreadsAsTheBasisDoes) {
  PosedLightField one = Field(lightfield::BasisKind::kBspline2);
  std::fill(one.field.data.begin(), one.field.data.end(), 0.0f);
  one.field.image(2, 0)[7] = 1;
  const RaySampler sampler(std::span(&one, 1), "x");
  core::Random random(TestSeed(3), 1);
  const double centre = one.field.geometry.grid.centre(2, 0).x;
  double square = 0;
  for (int k = 0; k < kRays; ++k) {
    const double x = (sampler.Draw(random).position_m.x - centre) / 0.01;
    EXPECT_LT(std::abs(x), 1.5);
    square += x * x;
  }
  // Fourth moment of the sum of three uniforms: 13/80.
  EXPECT_NEAR(square / kRays, 0.25, 5 * std::sqrt((13.0 / 80 - 1.0 / 16) / kRays));
}

// Two functions that overlap, C = (1, -c): rays follow max(B0 - c B1, 0) along u.
TEST(RaySampler, LeavesNegativeLightOut) {
  PosedLightField field = Field(lightfield::BasisKind::kBilinear);
  std::fill(field.field.data.begin(), field.field.data.end(), 0.0f);
  field.field.image(0, 0)[7] = 1;
  field.field.image(1, 0)[7] = -0.5f;
  const RaySampler sampler(std::span(&field, 1), "x");
  EXPECT_DOUBLE_EQ(sampler.negative_share(), 0.5);
  core::Random random(TestSeed(9), 1);
  const double u0 = field.field.geometry.grid.u0_m;
  int beyond = 0, first = 0;
  for (int k = 0; k < kRays; ++k) {
    const double x = (sampler.Draw(random).position_m.x - u0) / 0.01;
    first += x < 1;
    // On the second cell B0 - B1/2 = 1 - 3 f / 2, positive up to f = 2/3.
    beyond += x > 1 + 2.0 / 3;
  }
  EXPECT_EQ(beyond, 0);
  // First cell: 1/2; second: integral of 1 - 3 f / 2 up to 2/3 = 1/3.
  const double share = 0.5 / (0.5 + 1.0 / 3);
  EXPECT_NEAR(double(first) / kRays, share, 5 * std::sqrt(share * (1 - share) / kRays));
}

TEST(RaySampler, DarkFieldsAreRefused) {
  PosedLightField field = Field(lightfield::BasisKind::kBox);
  std::fill(field.field.data.begin(), field.field.data.end(), 0.0f);
  EXPECT_THROW(RaySampler(std::span(&field, 1), "x"), InputError);
}

}  // namespace
}  // namespace luxfield::preprocess
