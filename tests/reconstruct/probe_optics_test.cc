// Light probes: what pixels show, and where the rim lies.
#include "luxfield/reconstruct/calibrate/mirror_ball/probe_optics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/environment/environment_layouts.h"
#include "luxfield/environment/spherical_polygon.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_fit.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::Vec2;
using lightfield::Vec3;
using testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

ProbeOptics Ball(double half_angle = 0, Vec2 principal_point = {}) {
  ProbeOptics optics;
  optics.camera = LevelCamera(180, 0);
  optics.half_angle = half_angle;
  optics.principal_point = principal_point;
  return optics;
}

ProbeOptics Fisheye(FisheyeProjection projection, double field_of_view) {
  ProbeOptics optics;
  optics.kind = ProbeOptics::Kind::kFisheye;
  optics.camera = UpwardCamera(0);
  optics.projection = projection;
  optics.field_of_view = field_of_view;
  return optics;
}

// The camera that faces -y and the one that faces up are those of the layouts.
TEST(ProbeOptics, FarAwayIsTheLayouts) {
  const Circle circle = {50, 50, 50};
  const ProbeOptics ball = Ball(), sky = Fisheye(FisheyeProjection::kEquidistant, kPi);
  for (int row = 0; row < 100; row += 3)
    for (int column = 0; column < 100; column += 3) {
      const Vec2 p = {column + 0.5, row + 0.5};
      for (const auto& [optics, layout] :
           {std::pair{ball, environment::EnvironmentLayout::kMirrorBall},
            std::pair{sky, environment::EnvironmentLayout::kFisheyeHemisphere}}) {
        const auto ours = optics.Direction(circle, p);
        const auto theirs = environment::DirectionFromPicture(layout, {p.x / 100, p.y / 100});
        ASSERT_EQ(ours.has_value(), theirs.has_value());
        if (ours) {
          EXPECT_LT(Length(*ours - theirs->direction), 1e-12);
        }
      }
    }
}

TEST(ProbeOptics, PinholeRaysObeyTheLawOfReflection) {
  const double half_angle = std::asin(0.05 / 0.7);
  const ProbeOptics optics = Ball(half_angle, {320, 240});
  const Circle circle = {150, 300, 90};
  const double focal = 90 / std::tan(half_angle);
  const auto ray = [&](Vec2 p) {
    const Vec3 v = Normalized({(p.x - 320) / focal, (240 - p.y) / focal, 1});
    return v.x * optics.camera.right + v.y * optics.camera.up + v.z * optics.camera.forward;
  };
  const Vec3 centre = 0.7 * ray({150, 300});
  int hits = 0;
  for (int row = 200; row < 400; row += 7)
    for (int column = 50; column < 250; column += 7) {
      const Vec2 p = {column + 0.5, row + 0.5};
      const auto w = optics.Direction(circle, p);
      // Metres, by the quadratic formula.
      const Vec3 v = ray(p);
      const double b = Dot(v, centre), discriminant = b * b - Dot(centre, centre) + 0.05 * 0.05;
      ASSERT_EQ(w.has_value(), discriminant >= 0) << row << " " << column;
      if (!w) continue;
      ++hits;
      const Vec3 hit = (b - std::sqrt(discriminant)) * v;
      const Vec3 n = (1 / 0.05) * (hit - centre);
      EXPECT_NEAR(Length(n), 1, 1e-9);
      EXPECT_NEAR(Dot(*w, n), -Dot(v, n), 1e-9);       // equal angles
      EXPECT_NEAR(Dot(*w, Cross(v, n)), 0, 1e-9);      // in one plane
      EXPECT_GT(Length(*w - v), std::abs(Dot(v, n)));  // and not straight on
    }
  EXPECT_GT(hits, 500);
  // Off the axis the image is an ellipse: f = 90 / tan(4.0960 degrees) = 1256.8 pixels, its outer
  // end lies at f tan(8.1637 + 4.0960 degrees) = 273.09 from the principal point, 2.8 beyond the
  // circle.
  const Vec2 outwards = (1 / std::hypot(170.0, 60.0)) * Vec2{-170, 60};
  const Vec2 end = Vec2{150, 300} + (273.09 - std::hypot(170.0, 60.0)) * outwards;
  EXPECT_NEAR(optics.RimDistance(circle, end), 0, 0.1);
  EXPECT_NEAR(optics.RimDistance(circle, Vec2{150, 300} + 90.0 * outwards), -2.7, 0.2);
}

// What the pixels inside of the rim show, added up: all but a cone behind the ball, whose half
// angle is closed: on the rim light comes from alpha off straight on.
TEST(ProbeOptics, OutlinesTileTheSphere) {
  for (const double half_angle : {0.0, 0.05, 0.3}) {
    const ProbeOptics optics = Ball(half_angle, {51, 49});
    const Circle circle = {50.3, 50.7, 40};
    double sum = 0;
    std::vector<Vec3> outline;
    for (int row = 0; row < 100; ++row)
      for (int column = 0; column < 100; ++column) {
        optics.PixelOutline(circle, row, column, 0, outline);
        sum += std::abs(environment::PolygonSolidAngle(outline));
      }
    // Pixels that the rim cuts are left out: bound their annulus by two pixels.
    const auto shown = [&](double q) {
      if (half_angle == 0) return 4 * kPi * q * q;
      const double phi = std::atan(q * std::tan(half_angle));
      const double incidence = std::asin(std::sin(phi) / std::sin(half_angle));
      return 2 * kPi * (1 - std::cos(2 * incidence - phi));
    };
    EXPECT_LT(sum, shown(1));
    EXPECT_GT(sum, shown(1 - 2 / 40.0));
  }
  // A fisheye within its rim, by each projection: the cap of its field of view.
  using enum FisheyeProjection;
  for (const auto projection : {kEquidistant, kEquisolid, kStereographic, kOrthographic}) {
    const ProbeOptics optics = Fisheye(projection, 2.5);
    double sum = 0;
    std::vector<Vec3> outline;
    for (int row = 0; row < 120; ++row)
      for (int column = 0; column < 120; ++column) {
        optics.PixelOutline({60, 60, 55}, row, column, 0, outline);
        sum += std::abs(environment::PolygonSolidAngle(outline));
        for (const Vec3& w : outline) EXPECT_GE(w.z, std::cos(1.25) - 1e-12);
      }
    EXPECT_NEAR(sum / (2 * kPi * (1 - std::cos(1.25))), 0.95, 0.05) << int(projection);
  }
}

// A disc on a background, both with gradients, each pixel the mean over 8 x 8 points, and noise.
core::Image Disc(const Circle& circle, double contrast, double noise, std::uint64_t seed) {
  core::Image image(220, 180, 1);
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      double sum = 0;
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) {
          const double u = column + (x + 0.5) / 8, v = row + (y + 0.5) / 8;
          const bool inside = std::hypot(u - circle.x, v - circle.y) < circle.radius;
          sum += 100 + 0.1 * u - 0.05 * v + (inside ? contrast * (100 + 0.2 * v) : 0);
        }
      core::Random random(seed, 0, static_cast<std::uint32_t>(row * image.width + column));
      image.at(0, row, column) = static_cast<float>(sum / 64 + noise * random.Normal());
    }
  return image;
}

// Standard errors hold: squared z of centre and radius over circles and seeds, pooled.
TEST(RimFit, FindsTheCircleWithinItsStandardErrors) {
  double chi_squared = 0;
  int values = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    core::Random random(seed, 1);
    const Circle truth = {105 + 8 * random.Uniform(), 84 + 8 * random.Uniform(),
                          50 + 15 * random.Uniform()};
    const RimFit fit = FitRim(Disc(truth, -0.4, 2, seed), Ball(), {}, "disc");
    EXPECT_GT(fit.used, fit.rays * 3 / 4);
    EXPECT_LT(fit.sigma.radius, 0.05);
    for (const double z :
         {(fit.circle.x - truth.x) / fit.sigma.x, (fit.circle.y - truth.y) / fit.sigma.y,
          (fit.circle.radius - truth.radius) / fit.sigma.radius}) {
      EXPECT_LT(std::abs(z), 5);
      chi_squared += z * z;
      ++values;
    }
  }
  std::printf("  chi^2 / n = %.2f of %d\n", chi_squared / values, values);
  // 36 degrees of freedom; the residuals' autocorrelation is an estimate: up to twice.
  EXPECT_LT(chi_squared / values, 2);
  EXPECT_GT(chi_squared / values, 0.3);
}

TEST(RimFit, SurvivesLampsAndAHalfHiddenRim) {
  const Circle truth = {108.2, 90.6, 60.4};
  core::Image image = Disc(truth, 0.5, 1, 7);
  for (int row = 60; row < 64; ++row)
    for (int column = 90; column < 94; ++column) image.at(0, row, column) = 1e7f;
  for (int row = 118; row < 180; ++row)  // a stand below the ball
    for (int column = 70; column < 140; ++column) image.at(0, row, column) = 40;
  const RimFit fit = FitRim(image, Ball(), {}, "disc");
  EXPECT_NEAR(fit.circle.x, truth.x, 5 * fit.sigma.x);
  EXPECT_NEAR(fit.circle.y, truth.y, 5 * fit.sigma.y);
  EXPECT_NEAR(fit.circle.radius, truth.radius, 5 * fit.sigma.radius);
  EXPECT_LT(fit.used, fit.rays * 9 / 10);
  const RimFit told = FitRim(image, Ball(), Circle{110, 89, 62}, "disc");
  EXPECT_NEAR(told.circle.radius, fit.circle.radius, fit.sigma.radius);
}

TEST(RimFit, RefusesPicturesWithoutACircle) {
  const auto message = [](const core::Image& image, std::optional<Circle> start) -> std::string {
    try {
      FitRim(image, Ball(), start, "photo.tif");
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  core::Image flat(200, 200, 1);
  std::fill(flat.data.begin(), flat.data.end(), 5.0f);
  EXPECT_THAT(message(flat, {}), HasSubstr("photo.tif"));
  EXPECT_THAT(message(flat, Circle{100, 100, 60}), HasSubstr("0 of"));
  EXPECT_THAT(message(core::Image(20, 20, 1), {}), HasSubstr("too few"));
  EXPECT_THAT(message(core::Image(200, 200, 1), {}), HasSubstr("circle"));
}

}  // namespace
}  // namespace luxfield::reconstruct
