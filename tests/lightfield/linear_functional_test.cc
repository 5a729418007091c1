#include "luxfield/lightfield/linear_functional.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::lightfield {
namespace {

constexpr std::uint64_t kSeed = 20261122;

LightField RandomField(int channels) {
  LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = BasisGrid::Centred(Basis::Make(BasisKind::kBspline2), 4, 3, 0.02);
  g.lattice = {12, 10, -0.13, 0.12, 0.02, 0.021};
  g.channels = channels;
  LightField field(g);
  core::Random random(kSeed, static_cast<std::uint64_t>(channels));
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  for (float& c : field.data) c = static_cast<float>(random.Uniform() - 0.2);
  return field;
}

// The closed forms, which share only the projection of texels with the weights, are the judge; both
// are sums of doubles.
TEST(LinearFunctional, WeightsGiveTheClosedForms) {
  for (const int channels : {1, 3}) {
    const LightField field = RandomField(channels);
    const LuminaireGeometry& g = field.geometry;
    for (const auto& [u, s] : {std::pair{Vec2{0.004, -0.013}, Vec2{0.021, 0.033}},
                               std::pair{Vec2{-0.03, 0.02}, Vec2{-0.129, -0.089}}}) {
      const double expected = core::Luminance(Radiance(field, u, s));
      EXPECT_NEAR(Apply(RadianceWeights(g, u, s), field), expected, 1e-12 * std::abs(expected));
    }
    for (const Vec3 p :
         {Vec3{0.02, -0.03, 0.25}, Vec3{0, 0, 0.3}, Vec3{0.2, 0.1, 1.3}, Vec3{-2, 1, 50}})
      for (const Vec3 n : {Vec3{0, 0, -1}, Normalized(Vec3{0.2, -0.1, -1})}) {
        const double expected = core::Luminance(ExactIrradiance(field, p, n));
        EXPECT_NEAR(Apply(IrradianceWeights(g, p, n), field), expected, 1e-11 * std::abs(expected))
            << p.x << ' ' << p.y << ' ' << p.z;
      }
    for (const Vec3 d : {Vec3{0, 0, 1}, Vec3{0.1, -0.2, 0.7}, Vec3{0.3, 0.1, -1}}) {
      const double expected = core::Luminance(FarFieldIntensity(field, d));
      EXPECT_NEAR(Apply(IntensityWeights(g, d), field), expected, 1e-12 * std::abs(expected));
    }
    const double expected = core::Luminance(TotalFlux(field));
    EXPECT_NEAR(Apply(FluxWeights(g), field), expected, 1e-11 * std::abs(expected));
  }
}

TEST(LinearFunctional, RaysThatMissHaveNoWeight) {
  const LightField field = RandomField(1);
  for (const auto& [u, s] :
       {std::pair{Vec2{0, 0}, Vec2{0.2, 0}}, std::pair{Vec2{1, 0}, Vec2{0, 0}}})
    EXPECT_EQ(Apply(RadianceWeights(field.geometry, u, s), field), 0);
}

TEST(LinearFunctional, ReceiversThatTheHorizonCutsAreRefused) {
  const LuminaireGeometry g = RandomField(1).geometry;
  EXPECT_THROW(IrradianceWeights(g, {0, 0, 1}, {1, 0, 0}), InputError);
  EXPECT_THROW(IrradianceWeights(g, {0, 0, -1}, {0, 0, -1}), InputError);
}

}  // namespace
}  // namespace luxfield::lightfield
