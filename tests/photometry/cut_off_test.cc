// Beams by H and V and their cut-off, against beams that are known.
#include "luxfield/photometry/cut_off.h"

#include <gtest/gtest.h>

#include "tests/photometry/beams.h"

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
    EXPECT_TRUE(found->has_gradient_peak);
  }
}

// Without light in the dark G grows, here up to the plateau of the logistic function's tail, until the
// light is gone: the cut-off is where the light itself falls most steeply, in the middle.
TEST(CutOff, OfABlurredOneIsWhereLightFallsMost) {
  for (const double dark : {0.0, 0.03, 1.0}) {
    const Lamp lamp = LampOfField(FieldOf(PassingBeam{0, -0.8, 0.3, 20000, dark}));
    const auto found = FindCutOff(lamp, kSmallReceiver, {}, {{-2.5, -4}, {-2.5, 4}});
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->has_gradient_peak);
    EXPECT_NEAR(found->place.v_deg, -0.8, 0.02);
    // A scan of what is left in the dark is judged by the light of the beam.
    EXPECT_FALSE(FindCutOff(lamp, kSmallReceiver, {}, {{-2.5, 2.5}, {-2.5, 4}}, found->brightest));
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

}  // namespace
}  // namespace luxfield::photometry
