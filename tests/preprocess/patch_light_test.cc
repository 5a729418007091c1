// The light of the filter plane's patches against the light-vector volume's moments, and against
// quadrature that stays within a patch.
#include "luxfield/preprocess/patch_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "luxfield/core/random.h"
#include "tests/render/brute_force.h"
#include "tests/seed.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Vec2;
using lightfield::Vec3;

// Off the axis and with no two lengths alike; `cells` of the basis from 1 to 3.
lightfield::LightField Grain(lightfield::BasisKind kind, int channels, std::uint64_t seed) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind), 4, 3, 0.0165);
  g.grid.u0_m += 0.011;
  g.grid.v0_m -= 0.007;
  g.lattice = {20, 18, -0.14, 0.13, 0.014, 0.013};
  g.channels = channels;
  lightfield::LightField field(g);
  core::Random random(seed, 1);
  for (float& c : field.data) c = static_cast<float>(0.1 + random.Uniform());
  return field;
}

std::vector<double> Nodes(const VolumeAxis& axis) {
  std::vector<double> nodes;
  for (int k = 0; k < axis.nodes; ++k) nodes.push_back(axis.first + k * axis.spacing);
  return nodes;
}

float LightAt(const PatchLight& light, int tau, int y, int x, int patch) {
  return light.light[((static_cast<std::size_t>(tau) * light.a_y.nodes + y) * light.a_x.nodes + x) *
                         kPatches +
                     patch];
}

TEST(PatchLight, PatchesTogetherAreTheZerothMoment) {
  const std::uint64_t seed = TestSeed(72);
  for (const auto kind : {lightfield::BasisKind::kBox, lightfield::BasisKind::kBilinear,
                          lightfield::BasisKind::kBspline2}) {
    const auto field = Grain(kind, 1, seed);
    const PatchLight light = TabulatePatchLight(field);
    const auto a_x = Nodes(light.a_x), a_y = Nodes(light.a_y);
    double largest = 0;
    for (const float b : light.light) largest = std::max(largest, std::abs(double{b}));
    for (int k = 0; k < light.tau.nodes; ++k) {
      const auto moments =
          TabulateMoments(field, a_x, a_y, light.tau.first + k * light.tau.spacing);
      for (std::size_t y = 0; y < a_y.size(); ++y)
        for (std::size_t x = 0; x < a_x.size(); ++x) {
          double sum = 0;
          for (int patch = 0; patch < kPatches; ++patch)
            sum += LightAt(light, k, static_cast<int>(y), static_cast<int>(x), patch);
          // Float32 sums of some hundred texels.
          ASSERT_NEAR(sum, moments[((y + 1) * (a_x.size() + 2) + x + 1) * 4], 3e-5 * largest)
              << "seed " << seed << ", tau node " << k;
        }
    }
  }
}

TEST(PatchLight, EachPatchHasTheLightThatLeavesIt) {
  const std::uint64_t seed = TestSeed(72);
  const auto field = Grain(lightfield::BasisKind::kBspline2, 1, seed);
  const auto& g = field.geometry;
  const PatchLight light = TabulatePatchLight(field);
  const auto patches = PatchesOf(g);
  const Vec2 centre = SupportCentre(g);
  for (const int k : {1, 4, 6})  // tau of nodes: a finite distance in front of I
    for (const int y : {20, 35})
      for (const int x : {25, 33, 40}) {
        const double tau = light.tau.first + k * light.tau.spacing, z = g.delta_m / tau;
        const Vec3 p{centre.x + (light.a_x.first + x * light.a_x.spacing) / tau,
                     centre.y + (light.a_y.first + y * light.a_y.spacing) / tau, z};
        std::array<double, kPatches> expected{};
        // A piece that a border cuts counts by its nodes, of which one in eight may be on the wrong
        // side: of 4 mm pieces and patches of 25 mm that is a fiftieth of a patch for each border.
        render::VisitLight(field, p, 4, [&](double flux, Vec3 to_lamp) {
          const double u = p.x + to_lamp.x, v = p.y + to_lamp.y;
          for (int patch = 0; patch < kPatches; ++patch)
            if (u >= patches[patch].low.x && u < patches[patch].high.x &&
                v >= patches[patch].low.y && v < patches[patch].high.y)
              expected[patch] += flux * z * z * z / (g.delta_m * g.delta_m);
        });
        double sum = 0;
        for (const double e : expected) sum += e;
        for (int patch = 0; patch < kPatches; ++patch)
          EXPECT_NEAR(LightAt(light, k, y, x, patch), expected[patch], 6e-3 * sum)
              << "seed " << seed << ", patch " << patch << " at " << k << ", " << y << ", " << x;
      }
}

TEST(PatchLight, ThreeChannelsCountByTheirLuminance) {
  const std::uint64_t seed = TestSeed(72);
  auto grey = Grain(lightfield::BasisKind::kBspline2, 1, seed);
  lightfield::LightField colour = Grain(lightfield::BasisKind::kBspline2, 3, seed);
  for (int m = 0; m < grey.geometry.grid.count(); ++m)
    for (int c = 0; c < 3; ++c) std::ranges::copy(grey.image(m, 0), colour.image(m, c).begin());
  const auto a = TabulatePatchLight(grey), b = TabulatePatchLight(colour);
  for (std::size_t k = 0; k < a.light.size(); ++k)
    ASSERT_NEAR(a.light[k], b.light[k], 1e-5 * std::abs(a.light[k]) + 1e-9);
}

TEST(PatchLight, PointsLieInTheirPatchesAndDifferInBothCoordinates) {
  const auto field = Grain(lightfield::BasisKind::kBspline2, 1, 1);
  std::set<double> x, y;
  for (const Patch& patch : PatchesOf(field.geometry)) {
    EXPECT_GT(patch.point.x, patch.low.x);
    EXPECT_LT(patch.point.x, patch.high.x);
    EXPECT_GT(patch.point.y, patch.low.y);
    EXPECT_LT(patch.point.y, patch.high.y);
    x.insert(patch.point.x);
    y.insert(patch.point.y);
  }
  EXPECT_EQ(x.size(), std::size_t{kPatches});
  EXPECT_EQ(y.size(), std::size_t{kPatches});
}

TEST(PatchLight, KnowsDarkPatches) {
  auto field = Grain(lightfield::BasisKind::kBox, 1, 1);
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    if (m % field.geometry.grid.width > 0) std::ranges::fill(field.image(m, 0), 0.0f);
  const PatchLight light = TabulatePatchLight(field);
  // Four columns of box functions are the four columns of patches.
  for (int patch = 0; patch < kPatches; ++patch)
    EXPECT_EQ(light.IsLit(patch), patch % kPatchesPerSide == 0) << patch;
}

}  // namespace
}  // namespace luxfield::preprocess
