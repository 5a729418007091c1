// Headlamps against regulations: beams that are known, and lamps that sit on a limit.
#include "luxfield/photometry/headlamp.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/photometry/beams.h"
#include "tests/photometry/labs.h"
#include "tests/seed.h"

namespace luxfield::photometry {
namespace {

using Kind = Requirement::Kind;

Requirement Asks(std::string name, Kind kind, std::vector<Place> places,
                 std::optional<double> least, std::optional<double> most = {}) {
  Requirement one;
  one.name = std::move(name);
  one.kind = kind;
  one.places = std::move(places);
  if (least) one.least = Limit{least, 0, ""};
  if (most) one.most = Limit{most, 0, ""};
  return one;
}

HeadlampAsked AskedOf(std::vector<Requirement> requirements) {
  HeadlampAsked asked;
  asked.forward = {0, 0, 1};
  asked.up = {0, 1, 0};
  asked.height_m = 0.65;
  asked.regulation.distance_m = 25;
  asked.regulation.receiver_side_m = 0.065;
  asked.regulation.requirements = std::move(requirements);
  return asked;
}

const Finding& Named(const Headlamp& headlamp, const std::string& name, bool is_least = true) {
  return *std::find_if(headlamp.findings.begin(), headlamp.findings.end(), [&](const Finding& one) {
    return one.name == name && one.is_least == is_least;
  });
}

// 5000 cd at (1, -0.5), falling by 300 cd per square degree away from there.
double Hill(double h, double v) { return 5000 - 300 * ((h - 1) * (h - 1) + (v + 0.5) * (v + 0.5)); }

TEST(Headlamp, EveryKindMeasuresWhatIsThere) {
  const Lamp lamp = LampOfField(FieldOf(Hill, 4, -4, 3));
  Requirement half = Asks("half", Kind::kPoint, {{-1, 0}}, {});
  half.most = Limit{{}, 0.5, "top"};
  half.unless = "it rains";
  const Headlamp found = HeadlampOf(
      lamp, AskedOf({Asks("point", Kind::kPoint, {{-1, 0}}, 3000, 3800),
                     Asks("line", Kind::kLine, {{-1, 0}, {2.9, 0}}, 3800, 4900),
                     Asks("zone", Kind::kZone, {{-1, -1}, {2, -1}, {2, 1}, {-1, 1}}, 3200, 4950),
                     Asks("sum", Kind::kSum, {{1, -0.5}, {1, 0.5}}, 9000),
                     Asks("top", Kind::kPeak, {}, 5001), half,
                     Asks("flux", Kind::kFlux, {{-1, -1}, {1, 1}}, 1)}));
  const double blur = 2e-3;
  const auto expect = [&](const Finding& one, double value, Place place, Verdict verdict) {
    EXPECT_NEAR(one.value.value, value, blur * value) << one.name;
    EXPECT_NEAR(one.place.h_deg, place.h_deg, 0.1) << one.name;
    EXPECT_NEAR(one.place.v_deg, place.v_deg, 0.1) << one.name;
    EXPECT_EQ(one.verdict, verdict) << one.name;
    EXPECT_FALSE(one.pass_probability);
  };
  expect(Named(found, "point"), Hill(-1, 0), {-1, 0}, Verdict::kPass);
  expect(Named(found, "point", false), Hill(-1, 0), {-1, 0}, Verdict::kPass);
  expect(Named(found, "line"), Hill(-1, 0), {-1, 0}, Verdict::kFail);
  expect(Named(found, "line", false), Hill(1, 0), {1, 0}, Verdict::kFail);
  expect(Named(found, "zone"), Hill(-1, 1), {-1, 1}, Verdict::kFail);
  expect(Named(found, "zone", false), 5000, {1, -0.5}, Verdict::kFail);
  expect(Named(found, "sum"), 5000 + Hill(1, 0.5), {1, -0.5}, Verdict::kPass);
  expect(Named(found, "top"), 5000, {1, -0.5}, Verdict::kFail);
  EXPECT_EQ(Named(found, "half", false).limit_text, "0.5 × top");
  EXPECT_NEAR(Named(found, "half", false).limit, 2500, 2500 * blur);
  EXPECT_EQ(Named(found, "half", false).verdict, Verdict::kFail);
  // The mean of the hill over the rectangle is 5000 - 300 (1 + 1/3 + 1/4 + 1/3).
  const double degree = std::numbers::pi / 180;
  EXPECT_NEAR(Named(found, "flux").value.value,
              (5000 - 300 * (2.0 / 3 + 1.25)) * 4 * degree * degree, 0.01);
  EXPECT_EQ(found.verdict, Verdict::kFail);
  // What fails only if something does not hold does not count.
  EXPECT_EQ(HeadlampOf(lamp, AskedOf({Asks("top", Kind::kPeak, {}, 4900), half})).verdict,
            Verdict::kPass);
}

TEST(Headlamp, WhatTheLightFieldDoesNotShowIsNotMeasured) {
  const Lamp lamp = LampOfField(FieldOf(Hill, 4, -4, 3));
  const auto verdict = [&](Requirement one) {
    const Headlamp found = HeadlampOf(lamp, AskedOf({std::move(one)}));
    EXPECT_EQ(found.verdict, found.findings[0].verdict);
    EXPECT_EQ(found.remarks.empty(), found.verdict != Verdict::kNotMeasured);
    return found.verdict;
  };
  EXPECT_EQ(verdict(Asks("a", Kind::kPoint, {{8, 0}}, 100)), Verdict::kNotMeasured);
  EXPECT_EQ(verdict(Asks("a", Kind::kPoint, {{8, 0}}, {}, 100)), Verdict::kNotMeasured);
  EXPECT_EQ(verdict(Asks("a", Kind::kLine, {{0, 0}, {8, 0}}, {}, 6000)), Verdict::kNotMeasured);
  EXPECT_EQ(verdict(Asks("a", Kind::kLine, {{0, 0}, {8, 0}}, {}, 4000)), Verdict::kFail);
  EXPECT_EQ(verdict(Asks("a", Kind::kLine, {{-3, 0}, {3, 0}}, {}, 6000)), Verdict::kPass);
}

// Aimed anew by (h, v), the beam at a place is the one that was at its sum with it.
TEST(Headlamp, TheSweepIsThatOfLampsAimedAnew) {
  const Lamp lamp = LampOfField(FieldOf(Hill, 6, -5, 4));
  HeadlampAsked asked = AskedOf({Asks("a", Kind::kPoint, {{0, 0}}, 4800),
                                 Asks("b", Kind::kLine, {{0, 0}, {2, 0}}, {}, 4990)});
  asked.regulation.aiming.tolerance_h_deg = 1.5;
  asked.regulation.aiming.tolerance_v_deg = 1;
  const AimSweep sweep = HeadlampOf(lamp, asked).sweep.value();
  ASSERT_EQ(sweep.margin.size(), sweep.h_deg.size() * sweep.v_deg.size());
  EXPECT_EQ(sweep.h_deg.front(), -1.5);
  EXPECT_EQ(sweep.v_deg.back(), 1);
  for (std::size_t v = 0; v < sweep.v_deg.size(); ++v)
    for (std::size_t h = 0; h < sweep.h_deg.size(); ++h) {
      const double x = sweep.h_deg[h], y = sweep.v_deg[v];
      const double most = Hill(std::clamp(1.0, x, x + 2), y);
      const double margin = std::min(Hill(x, y) / 4800 - 1, 1 - most / 4990);
      EXPECT_NEAR(sweep.margin[v * sweep.h_deg.size() + h], margin, 2e-3);
      EXPECT_NEAR(sweep.failed[v * sweep.h_deg.size() + h], (Hill(x, y) < 4800) + (most > 4990),
                  std::abs(margin) < 2e-3 ? 1 : 0);
    }
}

TEST(Headlamp, ItIsMeasuredAsItIsAimed) {
  const PassingBeam beam{0.9, -1.4, 0.1, 20000, 400};
  const Lamp lamp = LampOfField(FieldOf(beam));
  HeadlampAsked asked = AskedOf({Asks("75R", Kind::kPoint, {{1.15, -0.57}}, 12000),
                                 Asks("B50L", Kind::kPoint, {{-3.43, 0.57}}, {}, 450)});
  asked.regulation.aiming.kind = Aiming::Kind::kCutOff;
  asked.regulation.aiming.level = {{-2.5, -2}, {-2.5, 1}};
  asked.regulation.aiming.level_v_deg = -0.57;
  for (const double h : {1.0, 2.0, 3.0})
    asked.regulation.aiming.sideways.push_back({{h, -2}, {h, 2}});
  asked.regulation.cut_off = CutOffLimits{0.03, 0.13, 0.45, {-1.5, -2.5, -3.5}, 0.2};
  asked.regulation.screen_m = 10;
  const Headlamp aimed = HeadlampOf(lamp, asked);
  EXPECT_EQ(aimed.verdict, Verdict::kPass);
  EXPECT_LT(aimed.cut_off->spread_deg.value(), 0.05);
  EXPECT_NEAR(aimed.cut_off->place.v_deg, -0.57, 1e-3);
  // Its light comes from a millimetre: 10 m away nothing lies elsewhere.
  EXPECT_NEAR(aimed.cut_off->at_screen->place.v_deg, -0.57, 0.02);
  EXPECT_GE(aimed.cut_off->along.size(), 10u);
  // Pictures of both screens have square pixels, as near as whole rows come to it.
  for (const PlaneAsked& screen : {aimed.screen, aimed.aiming_screen.value()}) {
    const double pixel_m = screen.width_m / screen.columns;
    EXPECT_EQ(screen.rows, static_cast<int>(screen.height_m / pixel_m)) << screen.name;
  }
  asked.aim = Place{aimed.aimed.h_deg, aimed.aimed.v_deg};
  const Headlamp again = HeadlampOf(lamp, asked);
  EXPECT_NEAR(Named(again, "75R").value.value, Named(aimed, "75R").value.value, 1e-6 * 20000);
  asked.aim = Place{0, 0};  // as it was: too low for 75R
  EXPECT_EQ(HeadlampOf(lamp, asked).verdict, Verdict::kFail);
}

// Where a driver's line of sight meets the road, 0.65 m below the lamp: what a point source of that
// intensity gives it, I h / r^3.
TEST(Headlamp, TheRoadIsSeenFromTheDriversEye) {
  const Lamp lamp = LampOfField(FieldOf([](double, double) { return 5000; }, 12, -6, 2));
  HeadlampAsked asked = AskedOf({Asks("a", Kind::kPoint, {{0, 0}}, 1)});
  asked.eye_m = {-0.4, 1.2, -1.5};
  for (const Place aim : {Place{0, 0}, Place{3, 0.5}}) {
    SCOPED_TRACE(aim.h_deg);
    asked.aim = aim;  // the road lies below the lamp as it is aimed
    const RoadView view = HeadlampOf(lamp, asked).view;
    const BeamFrame frame = BeamFrame{}.Turned(aim);
    EXPECT_NEAR(Length(view.eye_m - (-0.4 * frame.right + 0.55 * frame.up - 1.5 * frame.forward)),
                0, 1e-12);
    const auto values = IlluminanceIn(lamp, view);
    ASSERT_EQ(values.size(), std::size_t(view.rows) * view.columns);
    for (const int row : {0, 20, 40})
      for (const int column : {50, 60, 69}) {
        const double below =
            view.farthest + (view.nearest - view.farthest) * (row + 0.5) / view.rows;
        const double ahead = 1.2 / below,
                     right = ahead *
                             (view.left + (view.right - view.left) * (column + 0.5) / view.columns);
        const double r = std::hypot(ahead - 1.5, right - 0.4, 0.65);
        const double expected = 5000 * 0.65 / (r * r * r);
        EXPECT_NEAR(values[std::size_t(row) * view.columns + column], expected, 0.01 * expected)
            << row << " " << column;
      }
  }
}

// A lamp whose true value is the limit passes with probability 1/2, whichever lab measures it, and the
// probabilities that labs state are uniform: their mean is 1/2, its variance 1/12 per lab.
// LUXFIELD_LABS=1600 is the proof.
void ExpectOnTheLimit(const lightfield::LightField& field, HeadlampAsked asked, double share,
                      int labs, std::uint64_t stream) {
  const auto sigma = SigmaOf(field, share);
  Requirement& last = asked.regulation.requirements.back();
  Headlamp truth = HeadlampOf(WithSigma(field, sigma), asked);
  (last.least ? last.least : last.most)->value = truth.findings.back().value.value;
  truth = HeadlampOf(WithSigma(field, sigma), asked);
  EXPECT_NEAR(truth.pass_probability.value(), 0.5, 1e-6);
  const auto state = [](const Headlamp& headlamp) {
    const Finding& finding = headlamp.findings.back();
    Quantities stated = {{"value", finding.value}, {"margin", finding.margin}};
    if (headlamp.cut_off) stated["gradient of the cut-off"] = headlamp.cut_off->gradient;
    return stated;
  };
  LabsJudge judge(state(truth));
  core::Random random(TestSeed(20261128), stream);
  int passed = 0;
  double sum = 0;
  for (int lab = 0; lab < labs; ++lab) {
    const Headlamp found = HeadlampOf(WithSigma(Drawn(field, sigma, random), sigma), asked);
    const Finding& finding = found.findings.back();
    passed += finding.verdict == Verdict::kPass;
    sum += finding.pass_probability.value();
    judge.Add(state(found));
  }
  std::printf("%d of %d labs pass; the mean of their probabilities is %.3f\n", passed, labs,
              sum / labs);
  constexpr int kProofLabs = 1600;
  EXPECT_NEAR(double(passed) / labs, 0.5,
              labs >= kProofLabs ? 0.05 : 4.5 * 0.5 / std::sqrt(double(labs)));
  EXPECT_NEAR(sum / labs, 0.5, 4.5 / std::sqrt(12.0 * labs));
  judge.ExpectHonest();
}

TEST(Headlamp, OnALimitItPassesHalfOfTheLabs) {
  ExpectOnTheLimit(FieldOf(Hill, 2.5, -2.5, 2),
                   AskedOf({Asks("sure", Kind::kPoint, {{1, 0}}, 100),
                            Asks("limit", Kind::kPoint, {{-1, 0}}, 1)}),
                   0.01, LabsOr(160), 1);
}

// Near the cut-off a value moves with the aim, and the aim with the noise of all of the cut-off.
TEST(Headlamp, OnALimitNearTheCutOffTheAimsNoiseCounts) {
  HeadlampAsked asked = AskedOf({Asks("glare", Kind::kPoint, {{-3.43, -0.3}}, {}, 1)});
  asked.regulation.aiming.kind = Aiming::Kind::kCutOff;
  asked.regulation.aiming.level = {{-2.5, -1.6}, {-2.5, 0.4}};
  asked.regulation.aiming.level_v_deg = -0.57;
  ExpectOnTheLimit(FieldOf(PassingBeam{0, -0.7, 0.15, 20000, 1000}, 4.5, -3, 1.5, kFineTexel),
                   asked, 0.005, LabsOr(40), 2);
}

}  // namespace
}  // namespace luxfield::photometry
