// Beams by H and V, their cut-off and how lamps are aimed by it, against beams that are known.
#include "luxfield/photometry/cut_off.h"

#include <gtest/gtest.h>

#include "tests/photometry/beams.h"
#include "tests/seed.h"

namespace luxfield::photometry {
namespace {

using lightfield::Dot;
using lightfield::Vec3;

const Receiver kReceiver{25, 0.065}, kSmallReceiver{25, 0.03};

TEST(BeamFrame, RightIsTheDriversAndPlacesComeBack) {
  const BeamFrame frame = BeamFrame::Of({0, 0, 2}, {0.3, 1, 0.4});
  // Seen from the receivers u is right; the driver looks the other way.
  EXPECT_LT(BeamFrame{}.Direction({10, 0}).x, 0);
  EXPECT_GT(BeamFrame{}.Direction({0, 10}).y, 0);
  for (const Place place : {Place{0, 0}, Place{-3.43, 0.57}, Place{40, -20}, Place{-120, 70}}) {
    const Place back = frame.PlaceOf(frame.Direction(place));
    EXPECT_NEAR(back.h_deg, place.h_deg, 1e-12);
    EXPECT_NEAR(back.v_deg, place.v_deg, 1e-12);
    const BeamFrame turned = frame.Turned(place);
    EXPECT_NEAR(Dot(turned.forward, frame.Direction(place)), 1, 1e-15);
    EXPECT_NEAR(Dot(turned.right, frame.up), 0, 1e-15);  // the horizon stays level
    EXPECT_NEAR(Dot(Cross(turned.right, turned.forward), turned.up), 1, 1e-15);
  }
}

// A beam that is linear in the angles has no blur.
TEST(Received, IsTheIntensityThere) {
  const Lamp lamp = LampOfField(FieldOf([](double h, double v) { return 1000 + 40 * h + 70 * v; }));
  const BeamMap map(lamp, kReceiver, {}, {-10, -5}, {10, 4});
  for (const Place place : {Place{0, 0}, Place{-3.43, 0.57}, Place{9, -1.72}, Place{-8, 3.9}}) {
    const double expected = 1000 + 40 * place.h_deg + 70 * place.v_deg;
    const double value = ReceivedValue(lamp, kReceiver, {}, place);
    EXPECT_NEAR(value, expected, 2e-3 * expected);
    EXPECT_NEAR(Value(lamp, Received(lamp, kReceiver, {}, place)), value, 1e-9 * value);
    EXPECT_NEAR(map.At(BeamFrame{}.Direction(place)).value(), value, 2e-3 * value);
  }
  EXPECT_FALSE(map.At(BeamFrame{}.Direction({11, 0})));
  EXPECT_FALSE(map.At({0, 0, -1}));
}

// The known beam's largest gradient, on a fine lattice, its logarithm that of the mean over what the
// lamp and the receiver blur: 0.07 (receiver), 0.07 (texel) and 0.11 (filter) degrees.
CutOff KnownCutOff(const PassingBeam& beam, double h) {
  const auto blurred = [&](double v) {
    double sum = 0;
    constexpr int kNodes = 9;
    for (int a = 0; a < kNodes; ++a)
      for (int b = 0; b < kNodes; ++b)
        for (int c = 0; c < kNodes; ++c) {
          const auto at = [](int k, double width) { return width * ((k + 0.5) / kNodes - 0.5); };
          sum += beam(h, v + at(a, 0.0688) + at(b, 0.0688) + at(c, 0.1146));
        }
    return sum;
  };
  CutOff best;
  for (double v = -2; v < 1; v += 0.005) {
    const double g = std::log10(blurred(v) / blurred(v + 0.1));
    if (g > best.gradient) best = {{h, v + 0.05}, g, {h, v}};
  }
  return best;
}

TEST(CutOff, PlaceAndGradientAreThoseOfTheBeam) {
  for (const double width : {0.08, 0.15}) {
    const PassingBeam beam{0, -0.4, width, 20000, 400};
    const Lamp lamp = LampOfField(FieldOf(beam, 4, -3, 3, kFineTexel));
    const CutOff known = KnownCutOff(beam, -2.5);
    const auto found = FindCutOff(lamp, kSmallReceiver, {}, {{-2.5, -2}, {-2.5, 1}});
    ASSERT_TRUE(found);
    // Texels are steps of 0.07 degrees that blur alike on average.
    EXPECT_NEAR(found->place.v_deg, known.place.v_deg, 0.02);
    EXPECT_NEAR(found->gradient, known.gradient, 0.05 * known.gradient);
    EXPECT_EQ(found->place.h_deg, -2.5);
  }
}

TEST(CutOff, DarknessAndEvenLightHaveNone) {
  const CutOffScan scan{{-2.5, -2}, {-2.5, 1}};
  const auto in = [&](const Beam& beam) {
    return FindCutOff(LampOfField(FieldOf(beam)), kSmallReceiver, {}, scan);
  };
  EXPECT_FALSE(in([](double, double) { return 0; }));
  EXPECT_FALSE(in([](double, double) { return -5; }));
  EXPECT_FALSE(in([](double, double v) { return 100 + 10 * v; }));  // gets brighter
}

Aiming ByThreeLines() {
  Aiming aiming;
  aiming.kind = Aiming::Kind::kCutOff;
  aiming.level = {{-2.5, -2}, {-2.5, 1}};
  aiming.level_v_deg = -0.57;
  for (const double h : {1.0, 2.0, 3.0}) aiming.sideways.push_back({{h, -2}, {h, 2}});
  aiming.sideways_gradient = 0.05;
  return aiming;
}
Aiming ByOneLine() {
  Aiming aiming = ByThreeLines();
  aiming.sideways = {{{5, -0.2}, {-5, -0.2}}};
  aiming.sideways_h_deg = 0.5;
  aiming.sideways_gradient = 0.02;
  return aiming;
}

TEST(Aim, BringsTheCutOffWhereItShouldBe) {
  for (const Place at : {Place{0.8, -1.1}, Place{-1.3, 0.2}}) {
    const PassingBeam beam{at.h_deg, at.v_deg, 0.1, 20000, 400};
    const Lamp lamp = LampOfField(FieldOf(beam));
    const Aim aim = AimOf(lamp, kSmallReceiver, ByThreeLines(), {});
    EXPECT_TRUE(aim.remarks.empty());
    // The gradient of a beam with some light in the dark is largest a little above its middle; the
    // rising part's scans cross it at 15 degrees.
    EXPECT_NEAR(aim.turned.h_deg, at.h_deg, 0.1);
    EXPECT_NEAR(aim.turned.v_deg, KnownCutOff(beam, at.h_deg - 2.5).place.v_deg + 0.57, 0.02);
    const auto level = FindCutOff(lamp, kSmallReceiver, aim.frame, {{-2.5, -2}, {-2.5, 1}});
    EXPECT_NEAR(level->place.v_deg, -0.57, 1e-3);
    // By the line at 0.2 degrees down, whose cut-off is that of the rising part there.
    const Aim other = AimOf(lamp, kSmallReceiver, ByOneLine(), {});
    const auto side = FindCutOff(lamp, kSmallReceiver, other.frame, ByOneLine().sideways[0]);
    ASSERT_TRUE(side);
    EXPECT_NEAR(side->place.h_deg, 0.5, 1e-3);
  }
}

TEST(Aim, WhatHasNoCutOffIsLeftAndSaid) {
  const Lamp even = LampOfField(FieldOf([](double, double v) { return 100 + 10 * v; }));
  const Aim aim = AimOf(even, kSmallReceiver, ByThreeLines(), {});
  EXPECT_EQ(aim.turned.h_deg, 0);
  EXPECT_EQ(aim.turned.v_deg, 0);
  EXPECT_EQ(aim.remarks.size(), 2u);
  // A level cut-off has no elbow: aimed upwards alone.
  const Lamp level = LampOfField(
      FieldOf([](double, double v) { return 400 + 20000 / (1 + std::exp((v + 1) / 0.1)); }));
  const Aim upwards = AimOf(level, kSmallReceiver, ByThreeLines(), {});
  EXPECT_EQ(upwards.turned.h_deg, 0);
  // The steepest of 0.02 + 1 / (1 + e^x) lies at x = 1.97: 0.2 degrees above its middle.
  EXPECT_NEAR(upwards.turned.v_deg, -1 + 0.2 + 0.57, 0.04);
  EXPECT_EQ(upwards.remarks.size(), 1u);
}

TEST(Aim, ByThePeak) {
  const Lamp lamp = LampOfField(FieldOf([](double h, double v) {
    return 30000 * std::exp(-0.5 * ((h - 1.5) * (h - 1.5) / 4 + (v + 0.7) * (v + 0.7)));
  }));
  Aiming aiming;
  aiming.kind = Aiming::Kind::kPeak;
  const Aim aim = AimOf(lamp, kReceiver, aiming, {});
  EXPECT_NEAR(aim.turned.h_deg, 1.5, 0.1);
  EXPECT_NEAR(aim.turned.v_deg, -0.7, 0.1);
}

// Over draws of the noise the aim scatters as its weights say: chi-squared.
TEST(Aim, ItsNoiseIsThatOfDraws) {
  constexpr int kDraws = 60;
  const auto field = FieldOf(PassingBeam{0.3, -0.8, 0.15, 20000, 1000}, 5, -3, 2, kFineTexel);
  const auto sigma = SigmaOf(field, 0.01);
  const Lamp lamp = WithSigma(field, sigma);
  const Aim truth = AimOf(lamp, kSmallReceiver, ByThreeLines(), {});
  ASSERT_FALSE(truth.of_h.empty());
  const double u_h = Uncertainty(lamp, truth.of_h).value(),
               u_v = Uncertainty(lamp, truth.of_v).value();
  core::Random random(TestSeed(20261127), 1);
  double hh = 0, vv = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Lamp drawn = LampOfField(Drawn(field, sigma, random));
    const Aim aim = AimOf(drawn, kSmallReceiver, ByThreeLines(), {});
    hh += std::pow((aim.turned.h_deg - truth.turned.h_deg) / u_h, 2);
    vv += std::pow((aim.turned.v_deg - truth.turned.v_deg) / u_v, 2);
  }
  const double within = 4.5 * std::sqrt(2.0 * kDraws);
  EXPECT_NEAR(hh, kDraws, within);
  EXPECT_NEAR(vv, kDraws, within);
}

}  // namespace
}  // namespace luxfield::photometry
