// Directions, interpolation and flux of a far field, against the definitions and quadrature.
#include "luxfield/formats/photometric.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "luxfield/core/error.h"
#include "tests/formats/lamps.h"
#include "tests/seed.h"

namespace luxfield::formats {
namespace {

using lightfield::Vec3;
constexpr double kPi = std::numbers::pi, kDegree = kPi / 180;
constexpr PhotometryType kTypes[] = {PhotometryType::kC, PhotometryType::kB, PhotometryType::kA};

void ExpectDirection(PhotometryType type, double plane, double angle, Vec3 wanted) {
  EXPECT_NEAR(lightfield::Length(Direction(type, plane, angle) - wanted), 0, 1e-15)
      << plane << " " << angle;
}

// docs/axes.md: +u is C0, -v is C90 (counted counterclockwise from above), +z is nadir.
TEST(PhotometricDirections, FollowTheStandardsDefinitions) {
  ExpectDirection(PhotometryType::kC, 0, 0, {0, 0, 1});
  ExpectDirection(PhotometryType::kC, 0, 90, {1, 0, 0});
  ExpectDirection(PhotometryType::kC, 90, 90, {0, -1, 0});
  ExpectDirection(PhotometryType::kC, 33, 180, {0, 0, -1});
  // LM-63-2002, section 3: photometric horizontal is H = 0, V = 0 of type A and H = 0, V = 90 of
  // types B and C; nadir is V = -90 of type A and V = 0 of B; H of A and B goes clockwise.
  ExpectDirection(PhotometryType::kA, 0, 0, {1, 0, 0});
  ExpectDirection(PhotometryType::kA, 0, -90, {0, 0, 1});
  ExpectDirection(PhotometryType::kA, 90, 0, Direction(PhotometryType::kC, 270, 90));
  ExpectDirection(PhotometryType::kB, 0, 0, {0, 0, 1});
  ExpectDirection(PhotometryType::kB, 0, 90, {1, 0, 0});
  ExpectDirection(PhotometryType::kB, 90, 0, Direction(PhotometryType::kC, 270, 90));
}

TEST(PhotometricIntensity, IsTheTablesAtItsAngles) {
  for (const PhotometryType type : kTypes) {
    const Photometry p = RandomLamp(type, 3);
    for (std::size_t k = 0; k < p.planes_deg.size(); ++k)
      for (std::size_t j = 0; j < p.angles_deg.size(); ++j) {
        const double other = type == PhotometryType::kB ? p.planes_deg[k] : p.angles_deg[j];
        // At a pole all planes meet.
        if (std::abs(std::abs(other) - 90) < 1e-9 && type != PhotometryType::kC) continue;
        EXPECT_NEAR(Intensity(p, 2.5 * Direction(type, p.planes_deg[k], p.angles_deg[j])),
                    p.at(k, j), 1e-8 * p.at(k, j));
      }
  }
}

TEST(PhotometricIntensity, IsZeroBeyondTheTableAndSeamlessAtC0) {
  Photometry p = RandomLamp(PhotometryType::kC, 5);
  const auto between = Intensity(p, Direction(p.type, 352.5, 20));
  EXPECT_NEAR(between, (p.at(23, 4) + p.at(0, 4)) / 2, 1e-9);
  p.angles_deg = Steps(0, 90, 5);
  p.intensity_cd.resize(p.planes_deg.size() * p.angles_deg.size());
  EXPECT_EQ(Intensity(p, {0, 0.1, -1}), 0);
  p = RandomLamp(PhotometryType::kB, 5);
  EXPECT_EQ(Intensity(p, {0.1, 0.1, -1}), 0);
}

// Five-point Gauss-Legendre in every cell of the table, where intensity is bilinear.
double Quadrature(const Photometry& p) {
  constexpr double x[] = {0, 0.5384693101056831, 0.9061798459386640};
  constexpr double w[] = {0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
  auto planes = p.planes_deg;
  if (p.type == PhotometryType::kC) planes.push_back(planes.front() + 360);
  double sum = 0;
  for (std::size_t k = 0; k + 1 < planes.size(); ++k)
    for (std::size_t j = 0; j + 1 < p.angles_deg.size(); ++j)
      for (int a = -2; a <= 2; ++a)
        for (int b = -2; b <= 2; ++b) {
          const auto at = [&](double low, double high, int node) {
            const double sign = node < 0 ? -1 : 1;
            return (low + high) / 2 + (high - low) / 2 * sign * x[std::abs(node)];
          };
          const double plane = at(planes[k], planes[k + 1], a);
          const double angle = at(p.angles_deg[j], p.angles_deg[j + 1], b);
          const double area = (planes[k + 1] - planes[k]) * kDegree *
                              (p.angles_deg[j + 1] - p.angles_deg[j]) * kDegree / 4;
          const double jacobian = p.type == PhotometryType::kC   ? std::sin(kDegree * angle)
                                  : p.type == PhotometryType::kA ? std::cos(kDegree * angle)
                                                                 : std::cos(kDegree * plane);
          sum += w[std::abs(a)] * w[std::abs(b)] * area * jacobian *
                 Intensity(p, Direction(p.type, plane, angle));
        }
  return sum;
}

TEST(PhotometricFlux, IsTheIntegralOfTheInterpolatedTable) {
  const auto seed = static_cast<unsigned>(TestSeed(11));
  // Five nodes integrate a line times a sine over 10 degrees to 1e-15; what is left is rounding.
  for (const PhotometryType type : kTypes) {
    const Photometry p = RandomLamp(type, seed);
    EXPECT_NEAR(Flux(p) / Quadrature(p), 1, 1e-9);
  }
}

TEST(PhotometricFlux, OfEvenLightIsTheSolidAngle) {
  for (const PhotometryType type : kTypes) {
    Photometry p = RandomLamp(type, 1);
    for (double& value : p.intensity_cd) value = 3;
    const double solid_angle = type == PhotometryType::kC ? 4 * kPi : 2 * kPi;
    EXPECT_NEAR(Flux(p), 3 * solid_angle, 1e-11);
  }
  Photometry one;
  one.planes_deg = {0};
  one.angles_deg = Steps(0, 90, 1);
  for (const double gamma : one.angles_deg)
    one.intensity_cd.push_back(std::cos(kDegree * gamma) / kPi);
  // A Lambertian lamp of 1 lm; a line between samples h apart lies below a cosine by h^2 / 12 of
  // it in the mean.
  EXPECT_NEAR(Flux(one), 1 - kDegree * kDegree / 12, 1e-8);
}

TEST(PhotometricSymmetry, IsFoundAndCompletes) {
  Photometry p = RandomLamp(PhotometryType::kC, 9);
  EXPECT_EQ(Describe(FindSymmetry(p)), "none");
  const auto keep = [&](double from, double to) {
    Photometry part = p;
    part.planes_deg.clear();
    part.intensity_cd.clear();
    for (std::size_t k = 0; k < p.planes_deg.size(); ++k) {
      if (p.planes_deg[k] < from || p.planes_deg[k] > to) continue;
      part.planes_deg.push_back(p.planes_deg[k]);
      for (std::size_t j = 0; j < p.angles_deg.size(); ++j) part.intensity_cd.push_back(p.at(k, j));
    }
    return part;
  };
  Photometry half = keep(0, 180);
  MirrorPlanes(half, 0, "x");
  EXPECT_EQ(half.planes_deg, p.planes_deg);
  EXPECT_EQ(Describe(FindSymmetry(half)), "to the plane C0-C180");
  EXPECT_EQ(Intensity(half, {1, 0.3, 1}), Intensity(half, {1, -0.3, 1}));
  EXPECT_EQ(Intensity(half, Direction(p.type, 45, 30)), Intensity(p, Direction(p.type, 45, 30)));
  Photometry other = keep(90, 270);
  MirrorPlanes(other, 90, "x");
  EXPECT_EQ(Describe(FindSymmetry(other)), "to the plane C90-C270");
  Photometry quarter = keep(0, 90);
  MirrorPlanes(quarter, 90, "x");
  MirrorPlanes(quarter, 0, "x");
  EXPECT_EQ(Describe(FindSymmetry(quarter)), "to the planes C0-C180 and C90-C270");
  EXPECT_THROW(MirrorPlanes(p, 0, "x"), InputError);
}

TEST(PhotometricResampling, TurnsTypesAAndBIntoC) {
  for (const PhotometryType type : {PhotometryType::kA, PhotometryType::kB}) {
    Photometry p = RandomLamp(type, 7);
    // Smooth, so that the two interpolations differ by their steps' squares alone.
    for (std::size_t k = 0; k < p.planes_deg.size(); ++k)
      for (std::size_t j = 0; j < p.angles_deg.size(); ++j) {
        const Vec3 d = Direction(type, p.planes_deg[k], p.angles_deg[j]);
        p.intensity_cd[k * p.angles_deg.size() + j] = 100 * (1.2 + 0.5 * d.y + 0.3 * d.x * d.z);
      }
    const Photometry c = ResampledToTypeC(p, Steps(0, 358, 2), Steps(0, 180, 2));
    for (const Vec3 d : {Vec3{1, 0.2, 0.3}, Vec3{0.5, -0.4, 0.1}, Vec3{0.1, 0.8, 0.9}})
      EXPECT_NEAR(Intensity(c, d),
                  100 * (1.2 + (0.5 * d.y) / lightfield::Length(d) +
                         0.3 * d.x * d.z / lightfield::Dot(d, d)),
                  100 * 0.8 * std::pow(10 * kDegree, 2) / 4);
  }
}

}  // namespace
}  // namespace luxfield::formats
