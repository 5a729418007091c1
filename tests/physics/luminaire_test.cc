// Laws that a whole luminaire must obey whatever its coefficients are: conservation of energy, the
// inverse square of the distance, the point source.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::lightfield {
namespace {

constexpr std::uint64_t kSeed = 51;

// Noise of two decades with a bright spot in every image.
LightField Lamp() {
  LuminaireGeometry g;
  g.delta_m = 0.12;
  g.grid = BasisGrid::Centred(Basis::Make(BasisKind::kBspline2), 5, 4, 0.018);
  g.lattice = {24, 20, -0.12, 0.1, 0.01, 0.01};
  g.unit = FluxUnit::kLumen;
  LightField field(g);
  core::Random random(kSeed, 0);
  for (int m = 0; m < g.grid.count(); ++m) {
    auto image = field.image(m, 0);
    for (float& value : image) value = static_cast<float>(std::pow(10, -2 * random.Uniform()));
    image[random() % image.size()] = 40;
  }
  return field;
}

TEST(Luminaire, FluxIntensityAndIrradianceTellTheSameEnergy) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  const LightField field = Lamp();
  const double flux = TotalFlux(field)[0];

  // Intensity over the hemisphere, on the tangent plane t = dir_xy / dir_z: d omega = cos^3 dt.
  // Light fills |t| < (0.12 + 0.063) / 0.12.
  const int n = 120;
  const double t_max = 1.6, dt = 2 * t_max / n;
  double from_intensity = 0;
  for (int b = 0; b < n; ++b)
    for (int a = 0; a < n; ++a) {
      const Vec3 direction{-t_max + (a + 0.5) * dt, -t_max + (b + 0.5) * dt, 1};
      from_intensity +=
          FarFieldIntensity(field, direction)[0] * std::pow(Length(direction), -3) * dt * dt;
    }
  EXPECT_NEAR(from_intensity / flux, 1, 1e-3);

  // Irradiance over a plane 7 cm in front of I, as wide as the light spreads there.
  const double x_max = 0.25, dx = 2 * x_max / n;
  double from_irradiance = 0;
  for (int b = 0; b < n; ++b)
    for (int a = 0; a < n; ++a) {
      const Vec3 p{-x_max + (a + 0.5) * dx, -x_max + (b + 0.5) * dx, field.geometry.delta_m + 0.07};
      from_irradiance += ExactIrradiance(field, p, {0, 0, -1})[0] * dx * dx;
    }
  EXPECT_NEAR(from_irradiance / flux, 1, 1e-3);
  std::cout << "flux " << flux << ": from far-field intensity off by " << from_intensity / flux - 1
            << ", from irradiance on a plane off by " << from_irradiance / flux - 1 << "\n";
}

TEST(Luminaire, AFarReceiverObeysTheInverseSquareOfTheDistance) {
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  const LightField field = Lamp();
  for (const Vec3 direction : {Vec3{0, 0, 1}, Vec3{0.2, -0.1, 1}, Vec3{-0.5, 0.4, 1}}) {
    const Vec3 w = Normalized(direction);
    const double intensity = FarFieldIntensity(field, w)[0];
    ASSERT_GT(intensity, 0);
    double previous_error = INFINITY;
    for (const double r : {1e2, 1e4, 1e6}) {
      const double error =
          std::abs(ExactIrradiance(field, r * w, -1 * w)[0] * r * r / intensity - 1);
      // Deviations are of the order of texel shifts: size delta / (texel r) = 0.5 m / r, times the
      // contrast.
      EXPECT_LT(error, 5 / r + 1e-9) << r;
      EXPECT_LT(error, previous_error);
      previous_error = error;
    }
  }
}

// All light leaves a 2 um square on F through a wide I with constant C. I(dir) = delta^2 / cos^3 C
// h^2, hence on a plane across the axis E = I cos / r^2 = C h^2 delta^2 / z^2 everywhere.
TEST(Luminaire, APointLikeLampIsAPointSource) {
  LuminaireGeometry g;
  const double h = 2e-6, c = 3;
  g.delta_m = 0.05;
  g.grid = BasisGrid::Centred(Basis::Make(BasisKind::kBox), 1, 1, h);
  g.lattice = {9, 9, -0.2, 0.2, 0.4 / 9, 0.4 / 9};
  LightField field(g);
  for (float& value : field.data) value = static_cast<float>(c);
  for (const double z : {0.1, 1.0, 30.0})
    for (const Vec2 lateral : {Vec2{0, 0}, Vec2{0.5, 0.3}, Vec2{-2, 1}}) {
      const Vec3 p{lateral.x * z, lateral.y * z, z};
      const double expected = c * h * h * g.delta_m * g.delta_m / (z * z);
      // The next term of the expansion is (h / z)^2; the odd one vanishes by symmetry.
      EXPECT_NEAR(ExactIrradiance(field, p, {0, 0, -1})[0] / expected, 1, 1e-8) << z;
      const Vec3 w = Normalized(p);
      EXPECT_NEAR(ExactIrradiance(field, p, -1 * w)[0], FarFieldIntensity(field, w)[0] / Dot(p, p),
                  1e-8 * expected);
    }
}

}  // namespace
}  // namespace luxfield::lightfield
