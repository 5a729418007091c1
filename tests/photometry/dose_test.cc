// Doses along paths against closed forms and sums over the path.
#include "luxfield/photometry/dose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/photometry/lamps.h"

namespace luxfield::photometry {
namespace {

using lightfield::PosedLightField;
using lightfield::Vec3;

PathAsked Path(ReceiverShape shape, std::vector<double> times, std::vector<Vec3> positions) {
  PathAsked path;
  path.receiver.shape = shape;
  path.times_s = std::move(times);
  path.positions_m = std::move(positions);
  return path;
}

// Past a small lamp that is as bright from everywhere on its line (a cosine lamp, I = I_0 cos): at
// distance h, from x_0 to x_1 with speed v, a plane that faces the lamp takes in
//
//   H = I_0 h / v integral (h^2 + x^2)^-3/2 dx = I_0 / (h v) [x / sqrt(h^2 + x^2)]
//
// and a plane held frontal I_0 h^2 (h^2 + x^2)^-2, which integrates to
//
//   H = I_0 h^2 / v [x / (2 h^2 (h^2 + x^2)) + atan(x / h) / (2 h^3)]
//
// The lamp's side of 10 mm makes up to (a / h)^2 of it; cells and texels 1e-3 (lamps.h).
TEST(Dose, PastALambertianSquareIsTheClosedForm) {
  const Lamp lamp = LampOfField(LambertianSquare::Wide());
  const double i0 = LambertianSquare::Intensity(1), h = 0.8, x0 = -0.3, x1 = 0.5, speed = 0.4;
  PathAsked path =
      Path(ReceiverShape::kPlane, {3, 3 + (x1 - x0) / speed}, {{x0, 0, h}, {x1, 0, h}});
  const auto facing = [&](double x) { return x / std::hypot(h, x); };
  const double expected = i0 / (h * speed) * (facing(x1) - facing(x0));
  EXPECT_NEAR(DoseAlong(lamp, path).dose.value, expected, 1e-3 * expected);
  path.normals = {{0, 0, -1}, {0, 0, -1}};
  const auto frontal = [&](double x) {
    return x / (2 * (h * h + x * x)) + std::atan(x / h) / (2 * h);
  };
  const double held = i0 / speed * (frontal(x1) - frontal(x0));
  EXPECT_NEAR(DoseAlong(lamp, path).dose.value, held, 1e-3 * held);
  // A sphere on the way straight away: a quarter of I_0 / z^2.
  const DoseAnswer away =
      DoseAlong(lamp, Path(ReceiverShape::kSphere, {0, 2}, {{0, 0, 0.5}, {0, 0, 1.5}}));
  const double sphere = 0.25 * i0 * 2 * (1 / 0.5 - 1 / 1.5);
  EXPECT_NEAR(away.dose.value, sphere, 1e-3 * sphere);
  EXPECT_NEAR(away.most.value, 0.25 * i0 / 0.25, 1e-3 * i0);
  EXPECT_NEAR(away.most_at_s, 0, 1e-6);
  EXPECT_NEAR(away.mean.value, away.dose.value / 2, 1e-12 * sphere);
}

// Out of the lamp's plane and back, turning: against a sum over many even steps.
TEST(Dose, IsTheSumOverThePath) {
  const Lamp lamp = LampOfField(SmoothField());
  PathAsked path = Path(ReceiverShape::kPlane, {0, 1, 4},
                        {{0.3, -0.2, -0.1}, {0.1, 0.1, 0.7}, {-0.4, 0.2, 0.9}});
  path.normals = {{0, 0, -1}, {0.6, 0, -0.8}, {1, 0, 0}};
  constexpr int kSteps = 40000;
  double sum = 0, most = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double time = 4 * (k + 0.5) / kSteps;
    const double share = time < 1 ? time : (time - 1) / 3;
    const int key = time < 1 ? 0 : 1;
    const Vec3 n = Normalized((1 - share) * path.normals[key] + share * path.normals[key + 1]);
    const Vec3 p = (1 - share) * path.positions_m[key] + share * path.positions_m[key + 1];
    const double rate = IlluminanceValue(lamp, p, n);
    sum += 4.0 / kSteps * rate;
    most = std::max(most, rate);
  }
  const DoseAnswer found = DoseAlong(lamp, path);
  EXPECT_NEAR(found.dose.value, sum, 1e-4 * sum);  // of the sum's jump where light begins
  EXPECT_NEAR(found.most.value, most, 1e-4 * most);
  EXPECT_TRUE(std::ranges::is_sorted(found.time_s));
}

// A receiver that rests takes in the time times its rate, with the uncertainty of that.
TEST(Dose, OfAReceiverAtRestIsTimeTimesRate) {
  const NoisyField noisy(SmoothField(), PlainMaps(SmoothField().geometry.grid), 0.01);
  Lamp lamp = LampOfField(noisy.field());
  const std::vector<PosedLightField> sigma = {{"", {}, noisy.SigmaOfC()}};
  const std::vector<SolveMaps> maps = {noisy.maps()};
  SetNoise(lamp, sigma, maps, "sigma");
  const Vec3 p{0.1, 0.05, 0.9};
  for (const ReceiverShape shape : {ReceiverShape::kPlane, ReceiverShape::kCylinder}) {
    const DoseAnswer found = DoseAlong(lamp, Path(shape, {-2, 5}, {p, p}));
    const Estimate rate = Evaluate(lamp, ReceivedAt(lamp, found.asked.receiver, p));
    EXPECT_NEAR(found.dose.value, 7 * rate.value, 1e-9 * found.dose.value);
    EXPECT_NEAR(found.dose.u.value(), 7 * rate.u.value(), 1e-9 * found.dose.u.value());
    EXPECT_NEAR(found.mean.u.value(), rate.u.value(), 1e-9 * rate.u.value());
    EXPECT_NEAR(found.most.u.value(), rate.u.value(), 1e-9 * rate.u.value());
  }
}

TEST(Dose, OfADarkLampIsNothing) {
  const Lamp lamp = LampOfField(lightfield::LightField(SmoothField().geometry));
  const DoseAnswer found =
      DoseAlong(lamp, Path(ReceiverShape::kSphere, {0, 1}, {{0, 0, 1}, {0, 1, 1}}));
  EXPECT_EQ(found.dose.value, 0);
  EXPECT_FALSE(found.dose.u);
}

}  // namespace
}  // namespace luxfield::photometry
