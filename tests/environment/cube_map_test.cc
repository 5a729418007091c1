// The cube map: its frame, its solid angles and irradiance in closed form.
#include "luxfield/environment/cube_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/core/random.h"

namespace luxfield::environment {
namespace {

constexpr double kPi = std::numbers::pi;

lightfield::Vec3 RandomDirection(core::Random& random) {
  const double z = 2 * random.Uniform() - 1, phi = 2 * kPi * random.Uniform();
  const double s = std::sqrt(1 - z * z);
  return {s * std::cos(phi), s * std::sin(phi), z};
}

TEST(CubeMap, FacesAreSeenFromInside) {
  for (const CubeFace& face : kCubeFaces) {
    const lightfield::Vec3 right = lightfield::Cross(face.axis, face.up);
    EXPECT_EQ(lightfield::Length(right - face.right), 0);
    EXPECT_EQ(lightfield::Dot(face.axis, face.up), 0);
  }
  // What the header says in words.
  for (int face = 0; face < 4; ++face) EXPECT_EQ(kCubeFaces[face].up.z, 1);
  EXPECT_EQ(kCubeFaces[4].up.y, -1);
  EXPECT_EQ(kCubeFaces[5].up.y, 1);
}

TEST(CubeMap, DirectionsFindTheirTexel) {
  core::Random random(1, 0);
  const CubeMap cube(7);
  for (int k = 0; k < 2000; ++k) {
    const lightfield::Vec3 w = RandomDirection(random);
    const CubePoint p = CubePointFromDirection(w);
    EXPECT_NEAR(lightfield::Length(lightfield::Normalized(CubeVector(p)) - w), 0, 1e-15);
    EXPECT_LE(std::max(std::abs(p.x), std::abs(p.y)), 1);
  }
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < 7; ++row)
      for (int column = 0; column < 7; ++column) {
        const CubePoint centre = {face, -1 + 2 * (column + 0.5) / 7, 1 - 2 * (row + 0.5) / 7};
        EXPECT_EQ(cube.texel_of(CubeVector(centre)), cube.texel(face, row, column));
      }
}

TEST(CubeMap, SolidAnglesAreTheClosedFormAndFillTheSphere) {
  const auto s = [](long double x, long double y) {
    return std::atan2(x * y, std::sqrt(x * x + y * y + 1));
  };
  for (const int size : {1, 2, 7, 64, 301}) {
    const auto angles = TexelSolidAngles(size);
    ASSERT_EQ(angles.size(), std::size_t(size) * size);
    double sum = 0;
    for (int row = 0; row < size; ++row)
      for (int column = 0; column < size; ++column) {
        const double angle = angles[std::size_t(row) * size + column];
        sum += angle;
        const long double x0 = -1 + 2.0L * column / size, x1 = -1 + 2.0L * (column + 1) / size;
        const long double y1 = 1 - 2.0L * row / size, y0 = 1 - 2.0L * (row + 1) / size;
        const double closed = double(s(x1, y1) - s(x0, y1) - s(x1, y0) + s(x0, y0));
        ASSERT_NEAR(angle / closed, 1, 1e-12) << size << ' ' << row << ' ' << column;
        // The density at the centre is the leading term.
        const double area = 4.0 / size / size;
        if (size == 301) {
          ASSERT_NEAR(
              angle / (area * CubeSolidAnglePerArea(double(x0 + x1) / 2, double(y0 + y1) / 2)), 1,
              1e-4);
        }
      }
    EXPECT_NEAR(6 * sum, 4 * kPi, 1e-12) << size;
  }
}

TEST(CubeMap, AConstantAndAHemisphereHaveTheirClosedForms) {
  CubeMap sky(8);
  CubeMap constant(5);
  for (float& value : constant.data) value = 2.5f;
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < 8; ++row)
      for (int column = 0; column < 8; ++column)
        if (face == 4 || (face < 4 && row < 4)) sky.at(face, row, column, 1) = 3;
  EXPECT_NEAR(MeanRadiance(constant)[0], 2.5, 1e-14);
  EXPECT_NEAR(MeanRadiance(sky)[1], 1.5, 1e-14);
  EXPECT_EQ(MeanRadiance(sky)[0], 0);
  core::Random random(2, 0);
  for (int k = 0; k < 24; ++k) {
    const lightfield::Vec3 n = RandomDirection(random);
    for (const double e : Irradiance(constant, n)) EXPECT_NEAR(e, 2.5 * kPi, 1e-12);
    // A surface tilted by beta under a uniform sky: pi (1 + cos beta) / 2.
    EXPECT_NEAR(Irradiance(sky, n)[1], 3 * kPi * (1 + n.z) / 2, 1e-12);
  }
}

TEST(CubeMap, OneTexelCutByTheHorizonIsQuadrature) {
  CubeMap cube(3);
  cube.at(2, 0, 2, 0) = 7;
  const double x0 = 1.0 / 3, y0 = 1.0 / 3, step = 2.0 / 3;
  constexpr int kSteps = 800;
  for (const lightfield::Vec3 n :
       {lightfield::Vec3{0, 1, 0}, lightfield::Vec3{0, 0, 1}, lightfield::Normalized({-1, 0.9, 0}),
        lightfield::Normalized({0.3, 1, -1.6}), lightfield::Normalized({-1, -1, -0.2})}) {
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
      for (int j = 0; j < kSteps; ++j) {
        const double x = x0 + step * (i + 0.5) / kSteps, y = y0 + step * (j + 0.5) / kSteps;
        const lightfield::Vec3 w = lightfield::Normalized(CubeVector({2, x, y}));
        sum += std::max(0.0, lightfield::Dot(n, w)) * CubeSolidAnglePerArea(x, y);
      }
    sum *= 7 * step * step / kSteps / kSteps;
    // The midpoint rule's error where the integrand has a kink is second order, too.
    EXPECT_NEAR(Irradiance(cube, n)[0], sum, 7 * 4.0 / kSteps / kSteps);
  }
}

TEST(CubeMap, ARotatedMapRotatesItsIrradiance) {
  core::Random random(3, 0);
  CubeMap cube(6);
  for (float& value : cube.data) value = float(random.Uniform());
  // Quarter turns about x and z take texels to texels.
  const auto about_x = [](lightfield::Vec3 v) { return lightfield::Vec3{v.x, -v.z, v.y}; };
  const auto about_z = [](lightfield::Vec3 v) { return lightfield::Vec3{-v.y, v.x, v.z}; };
  const auto turned = [&](auto turn) {
    CubeMap result(6);
    for (int face = 0; face < 6; ++face)
      for (int row = 0; row < 6; ++row)
        for (int column = 0; column < 6; ++column) {
          const lightfield::Vec3 w =
              CubeVector({face, -1 + (column + 0.5) / 3, 1 - (row + 0.5) / 3});
          for (std::size_t channel = 0; channel < 3; ++channel)
            result.data[3 * result.texel_of(turn(w)) + channel] =
                cube.data[3 * cube.texel(face, row, column) + channel];
        }
    return result;
  };
  const CubeMap turned_x = turned(about_x), turned_z = turned(about_z);
  double changed = 0;
  for (int k = 0; k < 24; ++k) {
    const lightfield::Vec3 n = RandomDirection(random);
    const core::Rgb e = Irradiance(cube, n);
    const core::Rgb ex = Irradiance(turned_x, about_x(n)), ez = Irradiance(turned_z, about_z(n));
    const core::Rgb unturned = Irradiance(turned_z, n);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(ex[c] / e[c], 1, 1e-12);
      EXPECT_NEAR(ez[c] / e[c], 1, 1e-12);
      changed = std::max(changed, std::abs(unturned[c] / e[c] - 1));
    }
  }
  EXPECT_GT(changed, 0.01);
}

}  // namespace
}  // namespace luxfield::environment
