// Lamps whose light has closed forms: a Lambertian square, disc and sphere within a thousandth.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "luxfield/core/random.h"
#include "luxfield/photometry/answers.h"
#include "luxfield/photometry/distribution.h"
#include "luxfield/photometry/luminance.h"
#include "tests/photometry/lamps.h"
#include "tests/seed.h"

namespace luxfield::photometry {
namespace {

using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Vec3;

constexpr double kDegree = std::numbers::pi / 180, kThousandth = 1e-3;

// Illuminance by a polygon of even luminance L whose corners run counter-clockwise as seen from p, all
// of it above the horizon (Lambert, Photometria, 1760; the formula of Baum, Rushmeier and Winget,
// SIGGRAPH 1989):
//
//   E = L / 2 sum n . g,   g the angle between neighbouring corners times the normal of their plane
//
// The cases of CIE 171:2006, 5 of an area source above a floor and beside a wall are of this form.
double PolygonIlluminance(const std::vector<Vec3>& corners, Vec3 p, Vec3 n, double luminance) {
  double sum = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 a = Normalized(corners[k] - p),
               b = Normalized(corners[(k + 1) % corners.size()] - p);
    const Vec3 across = Cross(a, b);
    sum += std::atan2(Length(across), Dot(a, b)) * Dot(n, Normalized(across));
  }
  return std::abs(luminance / 2 * sum);
}

TEST(ClosedForms, ASquareAboveAFloorAndBesideAWall) {
  constexpr double kHalf = LambertianSquare::kSide / 2;
  const std::vector<Vec3> square = {
      {-kHalf, -kHalf, 0}, {kHalf, -kHalf, 0}, {kHalf, kHalf, 0}, {-kHalf, kHalf, 0}};
  const Lamp lamp = LampOfField(LambertianSquare::Field(8, 13, 0.1));
  for (const double x : {0.0, 0.01, 0.03})
    for (const double y : {0.0, -0.02})
      for (const Vec3 n : {Vec3{0, 0, -1}, Vec3{-0.6, 0, -0.8}}) {
        const Vec3 p{x, y, 0.03};
        const double expected = PolygonIlluminance(square, p, n, LambertianSquare::kRadiance);
        EXPECT_NEAR(IlluminanceValue(lamp, p, n), expected, kThousandth * expected)
            << x << " " << y;
      }
  // A wall before which all of the lamp lies.
  for (const double x : {0.008, 0.02}) {
    const Vec3 p{x, 0.003, 0.02}, n{-1, 0, 0};
    const double expected = PolygonIlluminance(square, p, n, LambertianSquare::kRadiance);
    EXPECT_NEAR(IlluminanceValue(lamp, p, n), expected, kThousandth * expected) << x;
  }
}

// A lamp of luminance `share`(u) 1e6 cd/m^2 on F, as LambertianSquare's.
template <typename Share>
LightField LambertianShape(int cells, int texels, double half_width, Share&& share) {
  LightField field = LambertianSquare::Field(cells, texels, half_width);
  for (int m = 0; m < field.geometry.grid.count(); ++m) {
    const double factor = share(field.geometry.grid.centre(m % cells, m / cells));
    for (float& c : field.image(m, 0)) c = static_cast<float>(c * factor);
  }
  return field;
}

// A disc of some 4 mm radius: of whole cells, or with those on its border by the share that it covers.
constexpr double kRadius = 0.004;
constexpr int kDiscCells = 24;
constexpr double kDiscCell = LambertianSquare::kSide / kDiscCells;
double CoveredShare(lightfield::Vec2 middle) {
  constexpr int kWithin = 32;
  int inside = 0;
  for (int a = 0; a < kWithin; ++a)
    for (int b = 0; b < kWithin; ++b)
      inside += std::hypot(middle.x + kDiscCell * ((a + 0.5) / kWithin - 0.5),
                           middle.y + kDiscCell * ((b + 0.5) / kWithin - 0.5)) <= kRadius;
  return double(inside) / kWithin / kWithin;
}
double WholeShare(lightfield::Vec2 middle) {
  return std::hypot(middle.x, middle.y) <= kRadius ? 1 : 0;
}

TEST(ClosedForms, ADisc) {
  const Lamp lamp = LampOfField(LambertianShape(kDiscCells, 13, 0.036, CoveredShare));
  constexpr double kL = LambertianSquare::kRadiance, kPi = std::numbers::pi;
  const double area = kPi * kRadius * kRadius;
  for (const double gamma : {0.0, 15.0, 30.0}) {
    const double expected = kL * area * std::cos(gamma * kDegree);
    EXPECT_NEAR(IntensityValue(lamp, VectorOf({70, gamma})), expected, kThousandth * expected);
  }
  // Of a small plane parallel to the disc, rho off its axis (Howell, Menguc and Siegel, B-13):
  //
  //   E = pi L / 2 (1 - (d^2 + rho^2 - R^2) / sqrt((d^2 + rho^2 + R^2)^2 - 4 R^2 rho^2))
  for (const double d : {0.012, 0.02, 1.0})
    for (const double rho : {0.0, 0.002, 0.005}) {
      const double a = d * d + rho * rho, r2 = kRadius * kRadius,
                   expected = kPi * kL / 2 *
                              (1 - (a - r2) / std::sqrt((a + r2) * (a + r2) - 4 * r2 * rho * rho));
      const Vec3 p{rho * 0.6, rho * 0.8, d};
      EXPECT_NEAR(IlluminanceValue(lamp, p, {0, 0, -1}), expected, kThousandth * expected)
          << d << " " << rho;
    }
}

// The rating of a disc of even luminance by its own solid angle, 2 pi (1 - cos alpha).
TEST(ClosedForms, TheGlareOfADisc) {
  const Lamp lamp = LampOfField(LambertianShape(kDiscCells, 7, 0.012, WholeShare));
  int cells = 0;
  for (int m = 0; m < kDiscCells * kDiscCells; ++m)
    cells +=
        WholeShare(lamp.fields[0].field.geometry.grid.centre(m % kDiscCells, m / kDiscCells)) > 0;
  const double radius = std::sqrt(cells * kDiscCell * kDiscCell / std::numbers::pi);
  EyeAsked eye;
  eye.eye_m = {0, 0, 2};
  eye.threshold = 0.5 * LambertianSquare::kRadiance;
  eye.background = 40;
  eye.line_of_sight = Vec3{0, 0, -1};
  eye.up = {0, 1, 0};
  const double alpha = std::atan2(radius, 2), omega = 2 * std::numbers::pi * (1 - std::cos(alpha));
  const double expected = UnifiedGlareRating(LambertianSquare::kRadiance, omega, 1, 40);
  const EyeAnswer found = AnswerFor(lamp, eye);
  EXPECT_NEAR(found.ugr.value().value, expected, kThousandth * expected);
  EXPECT_NEAR(found.area.value().solid_angle.value, omega, kThousandth * omega);
  // All of its light is half as bright over twice the area.
  const double side = std::sqrt(2 * std::numbers::pi) * radius;
  eye.opening_m = {side, side};
  EXPECT_NEAR(AnswerFor(lamp, eye).plain_ugr.value().value, expected - 8 * std::log10(2.0),
              kThousandth * expected);
}

// A sphere of even luminance behind F, each coefficient the mean over its cell and texel of what lines
// from one to the other see: of those that the outline crosses by points at random, one in each of
// kWithin^4 equal parts.
//
// Cells and texels are steps. From one direction to the next, a texel further, the outline moves on F
// by a sixth of a cell: over twelve texels it lies in every way in the cells, and steps
// average out, while a single direction is off by up to a per cent.
constexpr double kSphereRadius = 0.003, kSphereDelta = 0.05, kSphereBehind = kSphereDelta / 6,
                 kSphereTexel = 0.012 / 16;
LightField Sphere() {
  constexpr int kCells = 16, kWithin = 4;
  constexpr double kHalfWidth = 0.012;
  LuminaireGeometry g;
  g.delta_m = kSphereDelta;
  const double cell = 0.012 / kCells, texel = kSphereTexel;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBox),
                                          kCells, kCells, cell);
  const int size = static_cast<int>(std::lround(2 * kHalfWidth / texel));
  g.lattice = {size, size, -kHalfWidth, kHalfWidth, texel, texel};
  g.unit = lightfield::FluxUnit::kLumen;
  LightField field(g);
  core::Random random(TestSeed(20261127), 1);
  const auto within = [&](int k, double width) {
    return width * ((k + random.Uniform()) / kWithin - 0.5);
  };
  // The line's distance from the sphere's middle, (0, 0, -kSphereBehind), and cos(theta)^4.
  const auto line = [&](double ux, double uy, double sx, double sy) {
    const Vec3 d = Normalized(Vec3{sx - ux, sy - uy, g.delta_m});
    return std::pair{Length(Cross(Vec3{ux, uy, kSphereBehind}, d)), d.z * d.z * d.z * d.z};
  };
  const auto seen = [&](lightfield::Vec2 u, lightfield::Vec2 s) {
    const auto [off, cos4] = line(u.x, u.y, s.x, s.y);
    if (std::abs(off - kSphereRadius) > cell) return off < kSphereRadius ? cos4 : 0.0;
    double sum = 0;
    for (int k = 0; k < kWithin * kWithin * kWithin * kWithin; ++k) {
      const auto [at, weight] =
          line(u.x + within(k % kWithin, cell), u.y + within(k / kWithin % kWithin, cell),
               s.x + within(k / (kWithin * kWithin) % kWithin, texel),
               s.y + within(k / (kWithin * kWithin * kWithin), texel));
      if (at <= kSphereRadius) sum += weight;
    }
    return sum / std::pow(kWithin, 4);
  };
  for (int m = 0; m < g.grid.count(); ++m)
    for (int row = 0; row < size; ++row)
      for (int column = 0; column < size; ++column)
        field.image(m, 0)[std::size_t(row) * size + column] = static_cast<float>(
            1e6 / (g.delta_m * g.delta_m) *
            seen(g.grid.centre(m % kCells, m / kCells), g.lattice.centre(row, column)));
  return field;
}

TEST(ClosedForms, ASphere) {
  const Lamp lamp = LampOfField(Sphere());
  const double intensity = std::numbers::pi * kSphereRadius * kSphereRadius * 1e6;
  const Vec3 middle{0, 0, -kSphereBehind};
  constexpr int kTexels = 12, kSide = 3 * kTexels;
  const auto slope = [](int k, double texel) {
    return texel * kTexels * ((k + 0.5) / kSide - 0.5);
  };
  double i = 0;
  for (int k = 0; k < kSide * kSide; ++k) {
    const double texel = kSphereTexel / kSphereDelta;
    i += IntensityValue(lamp, {slope(k % kSide, texel), slope(k / kSide, texel), 1}) /
         (kSide * kSide);
  }
  EXPECT_NEAR(i, intensity, kThousandth * intensity);
  for (const double z : {0.1, 0.5, 3.0}) {
    double e = 0;
    for (int k = 0; k < kSide * kSide; ++k) {
      // A texel seen through a point of F is as wide as this from the sphere's middle.
      const double texel = kSphereTexel / kSphereDelta * z / (z + kSphereBehind);
      const Vec3 d = Normalized(Vec3{slope(k % kSide, texel), slope(k / kSide, texel), 1});
      // E = pi L (R / r)^2, r from its middle.
      const double r = z + kSphereBehind;
      e += IlluminanceValue(lamp, middle + r * d, -1 * d) * r * r / (kSide * kSide);
    }
    EXPECT_NEAR(e, intensity, kThousandth * intensity) << z;
  }
}

}  // namespace
}  // namespace luxfield::photometry
