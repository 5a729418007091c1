// How lamps are aimed by their cut-off or peak, against beams that are known.
#include "luxfield/photometry/aim.h"

#include <gtest/gtest.h>

#include "tests/photometry/beams.h"
#include "tests/photometry/labs.h"
#include "tests/seed.h"

namespace luxfield::photometry {
namespace {

const Receiver kReceiver{25, 0.065}, kSmallReceiver{25, 0.03};

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

// What a light field blurs is aimed by the fall of light itself, wherever darkness ends.
TEST(Aim, OfABlurredCutOffIsSaid) {
  const Lamp lamp = LampOfField(FieldOf(PassingBeam{0, -1.2, 0.3, 20000, 0.03}));
  Aiming aiming = ByThreeLines();
  aiming.sideways.clear();
  const Aim aim = AimOf(lamp, kSmallReceiver, aiming, {});
  EXPECT_NEAR(aim.turned.v_deg, -1.2 + 0.57, 0.03);
  ASSERT_EQ(aim.remarks.size(), 1u);
  EXPECT_NE(aim.remarks[0].find("steepest fall"), std::string::npos);
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

// What labs state of the aim is what it scatters by.
TEST(Aim, LabsStateWhatItScatters) {
  const int labs = LabsOr(25);
  const auto field = FieldOf(PassingBeam{0.3, -0.8, 0.15, 20000, 1000}, 5, -3, 2, kFineTexel);
  const auto sigma = SigmaOf(field, 0.01);
  const auto state = [&](const Lamp& lamp) {
    const Aim aim = AimOf(lamp, kSmallReceiver, ByThreeLines(), {});
    if (!aim.remarks.empty()) return Quantities{};  // the test fails for want of these
    return Quantities{{"aim H", {aim.turned.h_deg, Uncertainty(lamp, aim.of_h)}},
                      {"aim V", {aim.turned.v_deg, Uncertainty(lamp, aim.of_v)}}};
  };
  LabsJudge judge(state(WithSigma(field, sigma)));
  core::Random random(TestSeed(20261127), 1);
  for (int lab = 0; lab < labs; ++lab)
    judge.Add(state(WithSigma(Drawn(field, sigma, random), sigma)));
  judge.ExpectHonest();
}

}  // namespace
}  // namespace luxfield::photometry
