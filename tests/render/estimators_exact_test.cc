// `exact` on the OpenCL device against brute-force quadrature in double and against lightfield's
// closed form.
#include <gtest/gtest.h>

#include <cstdio>

#include "lightfield/light_vector.h"
#include "tests/render/brute_force.h"
#include "tests/render/estimator_fixture.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

using lightfield::BasisKind;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 20140101;

Vec3 RandomDirection(core::Random& random) {
  const double z = 2 * random.Uniform() - 1, angle = 2 * std::numbers::pi * random.Uniform();
  const double radius = std::sqrt(1 - z * z);
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

// A receiver at a distance of 0.05 to 100 m in front of I, seen within 60 degrees of the axis, any
// normal.
SurfacePoint RandomReceiver(core::Random& random, double delta_m) {
  const double distance = 0.05 * std::pow(2000.0, random.Uniform());
  Vec3 direction;
  do direction = RandomDirection(random);
  while (direction.z < 0.5);
  Vec3 p = distance * direction;
  // Windows meet the images for every direction within the field of view; keep most receivers
  // inside it.
  if (random.Uniform() < 0.7) p = {0.3 * p.x, 0.3 * p.y, p.z};
  p.z += delta_m;
  return RoundToFloat({p, RandomDirection(random)});
}

TEST(Exact, MatchesBruteForceAtAThousandReceivers) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const auto exact = MakeEstimator("exact", device);
  double worst = 0, worst_cut = 0, worst_closed = 0;
  int lit = 0, cut = 0;
  for (const char* kind : {"rings", "facets", "filament", "noise"}) {
    LuminaireShape shape;
    shape.width = 37;
    shape.height = 29;
    const auto field = StructuredLuminaire(kind, shape, kSeed);
    const LuminaireOnDevice luminaire(device, field, nullptr);
    core::Random random(kSeed, 1);
    std::vector<SurfacePoint> points(250);
    for (auto& point : points) point = RandomReceiver(random, shape.delta_m);
    // A fifth of the receivers have a horizon through the lamp.
    for (std::size_t k = 0; k < points.size(); k += 5) {
      const Vec3 u{0.02 * (random.Uniform() - 0.5), 0.02 * (random.Uniform() - 0.5), 0};
      const Vec3 ray = Normalized(points[k].p - u);
      points[k] = RoundToFloat({points[k].p, Normalized(Cross(ray, RandomDirection(random)))});
    }
    const Lit result = LightGBuffer(device, *exact, MakeGBuffer(device, points), luminaire);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto [p, n] = points[k];
      const BruteForce judge = BruteForceIrradiance(field, p, n);
      const double size = Length(judge.j);
      const double value = result.irradiance[k].s[0];
      if (size == 0) {
        EXPECT_EQ(value, 0);
        continue;
      }
      ++lit;
      const double closed = lightfield::ExactIrradiance(field, p, n)[0];
      worst_closed = std::max(worst_closed, std::abs(value - closed) / size);
      if (lightfield::HorizonCutsSupport(field.geometry, p, n)) {
        if (closed == 0) continue;
        ++cut;
        // The judge's nodes do not follow the horizon: it is good to about 1e-3 here, the closed
        // form is the judge.
        worst_cut = std::max(worst_cut, std::abs(value - closed) / size);
        EXPECT_NEAR(closed, judge.irradiance, 2e-3 * size);
      } else {
        worst = std::max(worst, std::abs(value - judge.irradiance) / size);
      }
    }
  }
  std::printf(
      "%d lit receivers, %d with a cut horizon; worst error / |J|: %.2e, cut %.2e, to the closed "
      "form %.2e\n",
      lit, cut, worst, worst_cut, worst_closed);
  EXPECT_GT(lit, 600);
  EXPECT_GT(cut, 50);
  EXPECT_LT(worst, 1e-5);
  EXPECT_LT(worst_cut, 1e-5);
}

}  // namespace
}  // namespace luxfield::render
