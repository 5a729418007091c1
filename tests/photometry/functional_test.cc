#include "luxfield/photometry/functional.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/photometry/point_receiver.h"
#include "tests/lightfield/support.h"
#include "tests/photometry/lamps.h"

namespace luxfield::photometry {
namespace {

using lightfield::Normalized;
using lightfield::PosedLightField;
using lightfield::RigidPose;
using lightfield::Vec2;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 20261125;

// Two fields with poses of their own: turned about an odd axis, and moved.
Lamp TwoFields() {
  RigidPose moved, turned;
  moved.translation_m = {0.01, -0.02, 0.03};
  const double c = std::cos(1.1), s = std::sin(1.1);
  turned.rotation = {c, 0, s, 0, 1, 0, -s, 0, c};
  turned.translation_m = {-0.05, 0.02, 0};
  const std::vector<PosedLightField> fields = {{"a", moved, SmoothField()},
                                               {"b", turned, SmoothField()}};
  return LampOf(fields);
}

// integral L(w) k(w) dw from the model's radiance, by Gauss rules of five nodes on `parts` pieces of
// each stretch between knots and borders of texels as seen from p.
double ByQuadrature(const Lamp& lamp, Vec3 p, const std::function<double(Vec3)>& kernel,
                    int parts = 1) {
  const auto nodes = [&](const std::vector<double>& breaks) {
    std::vector<double> finer;
    for (std::size_t k = 0; k + 1 < breaks.size(); ++k)
      for (int part = 0; part < parts; ++part)
        finer.push_back(breaks[k] + (breaks[k + 1] - breaks[k]) * part / parts);
    finer.push_back(breaks.back());
    return lightfield::GaussNodes(finer);
  };
  double sum = 0;
  for (const PosedLightField& posed : lamp.fields) {
    const auto& g = posed.field.geometry;
    const Vec3 own = posed.luminaire_from_field.Inverse().Point(p);
    if (own.z <= 0) continue;
    const double share = g.delta_m / own.z;  // s = u + share (p - u)
    const auto to_f = [&](double s, double at) { return (s - share * at) / (1 - share); };
    const auto across =
        nodes(lightfield::BreakpointsU(g, [&](double s) { return to_f(s, own.x); }));
    for (const auto& b :
         nodes(lightfield::BreakpointsV(g, [&](double t) { return to_f(t, own.y); })))
      for (const auto& a : across) {
        const Vec3 to_light = Vec3{a.x, b.x, 0} - own;
        const double r = Length(to_light);
        const Vec2 s{a.x - share * to_light.x, b.x - share * to_light.y};
        sum += lightfield::Radiance(posed.field, {a.x, b.x}, s)[0] * own.z / (r * r * r) *
               kernel(posed.luminaire_from_field.Direction((1 / r) * to_light)) * a.weight *
               b.weight;
      }
  }
  return sum;
}

TEST(Functional, QuantitiesAtAPointAreIntegralsOfRadiance) {
  const Vec3 n = Normalized(Vec3{0.2, -0.1, -1}), axis = Normalized(Vec3{0.1, 1, 0.3});
  const Vec3 facing = Normalized(Cross(axis, Vec3{1, 0.2, 0}));
  for (const Lamp& lamp : {LampOfField(SmoothField()), TwoFields()})
    for (const Vec3 p : {Vec3{0.02, -0.03, 0.2}, Vec3{0.01, 0.05, 0.36}, Vec3{0.3, -0.2, 1.3}}) {
      const auto expect = [&](const Functional& functional, const std::function<double(Vec3)>& k) {
        const double expected = ByQuadrature(lamp, p, k);
        EXPECT_NEAR(Value(lamp, functional), expected, 1e-7 * std::abs(expected) + 1e-9);
      };
      expect(IlluminanceAt(lamp, p, n), [&](Vec3 w) { return std::max(0.0, Dot(n, w)); });
      // A horizon that cuts the lamp.
      const double cut = ByQuadrature(
          lamp, p, [&](Vec3 w) { return std::max(0.0, Dot(axis, w)); }, 8);
      EXPECT_NEAR(Value(lamp, IlluminanceAt(lamp, p, axis)), cut, 3e-4 * cut);
      expect(FluenceRateAt(lamp, p), [](Vec3) { return 1.0; });
      expect(ReceivedAt(lamp, {.shape = ReceiverShape::kSphere}, p), [](Vec3) { return 0.25; });
      const PointReceiver half{
          .shape = ReceiverShape::kSemicylinder, .axis = axis, .facing = facing};
      expect(ReceivedAt(lamp, {.shape = ReceiverShape::kCylinder, .axis = axis}, p),
             [&](Vec3 w) { return Length(Cross(axis, w)) / std::numbers::pi; });
      expect(ReceivedAt(lamp, half, p),
             [&](Vec3 w) { return (Length(Cross(axis, w)) + Dot(facing, w)) / std::numbers::pi; });
      const auto j = LightVectorAt(lamp, p);
      expect(j[0], [](Vec3 w) { return w.x; });
      expect(j[1], [](Vec3 w) { return w.y; });
      expect(j[2], [](Vec3 w) { return w.z; });
    }
}

TEST(Functional, WeightsGiveTheClosedForms) {
  const Lamp lamp = TwoFields();
  const double flux = lightfield::TotalFlux(lamp.fields)[0];
  EXPECT_NEAR(Value(lamp, FluxOf(lamp)), flux, 1e-9 * flux);
  for (const Vec3 d : {Vec3{0, 0, 1}, Vec3{0.3, -0.2, 1}, Vec3{1, 0.1, 0.2}, Vec3{0, 0, -1}}) {
    const double expected = IntensityValue(lamp, d);
    EXPECT_NEAR(Value(lamp, IntensityTowards(lamp, d)), expected, 1e-9 * std::abs(expected));
  }
  for (const Vec3 p : {Vec3{0.02, -0.03, 0.2}, Vec3{0.01, 0.05, 0.36}, Vec3{3, -2, 13}})
    for (const Vec3 n : {Vec3{0, 0, -1}, Normalized(Vec3{0.7, 0.7, -0.1})}) {
      const double expected = IlluminanceValue(lamp, p, n);
      // Where the horizon cuts, the closed form clips texels that the rule of nodes does not.
      EXPECT_NEAR(Value(lamp, IlluminanceAt(lamp, p, n)), expected, 1e-4 * expected + 1e-12);
    }
}

TEST(Functional, HalvesOfTheFluxAreTheFlux) {
  const Lamp lamp = TwoFields();
  const double flux = Value(lamp, FluxOf(lamp));
  const double up = Value(lamp, FluxTowards(lamp, {0.1, 0, -1})),
               down = Value(lamp, FluxTowards(lamp, {-0.1, 0, 1}));
  EXPECT_NEAR(up + down, flux, 1e-6 * flux);
  EXPECT_GT(up, 0.01 * flux);
  // Intensity over that half of the sphere, by a midpoint rule.
  double sum = 0;
  constexpr int kPlanes = 360, kAngles = 180;
  for (int c = 0; c < kPlanes; ++c)
    for (int a = 0; a < kAngles; ++a) {
      const double gamma = (a + 0.5) * std::numbers::pi / kAngles,
                   angle = (c + 0.5) * 2 * std::numbers::pi / kPlanes;
      const Vec3 d{std::sin(gamma) * std::cos(angle), std::sin(gamma) * std::sin(angle),
                   std::cos(gamma)};
      if (Dot(d, {0.1, 0, -1}) > 0)
        sum += IntensityValue(lamp, d) * std::sin(gamma) * 2 * std::numbers::pi * std::numbers::pi /
               kPlanes / kAngles;
    }
  EXPECT_NEAR(up, sum, 0.003 * flux);
}

TEST(Functional, SumsOfFunctionalsAreSums) {
  const Lamp lamp = TwoFields();
  const Functional a = FluxOf(lamp), b = IntensityTowards(lamp, {0.1, 0, 1}),
                   c = IlluminanceAt(lamp, {0, 0, 2}, {0, 0, -1});
  EXPECT_NEAR(Value(lamp, Sum({{2, &a}, {-3, &b}, {0.5, &c}})),
              2 * Value(lamp, a) - 3 * Value(lamp, b) + 0.5 * Value(lamp, c),
              1e-9 * Value(lamp, a));
}

// At once, of directions and places of which some see nothing, and one whose horizon cuts the lamp.
TEST(Functional, SumsOfManyAreSums) {
  const Lamp lamp = LampOfField(SmoothField());
  const std::vector<WeighedDirection> directions = {
      {2, {0.1, 0, 1}}, {-1, {-0.4, 0.3, 1}}, {3, {0, 0, -1}}};
  const Vec3 facing{0, 0, -1}, aside = Normalized(Vec3{1, 0, -0.2});
  const std::vector<WeighedReceiver> receivers = {
      {0.5, {0.1, 0, 0.7}, facing}, {4, {0, 0, 0.05}, aside}, {2, {0, 0, -1}, facing}};
  double intensity = 0, illuminance = 0;
  for (const auto& [factor, d] : directions) intensity += factor * IntensityValue(lamp, d);
  for (const auto& [factor, p, n] : receivers)
    illuminance += factor * Value(lamp, IlluminanceAt(lamp, p, n));
  EXPECT_NEAR(Value(lamp, IntensitySum(lamp, directions)), intensity, 1e-9 * intensity);
  EXPECT_NEAR(Value(lamp, IlluminanceSum(lamp, receivers)), illuminance, 1e-9 * illuminance);
  EXPECT_EQ(Value(lamp, IntensitySum(lamp, {})), 0);
}

TEST(Functional, ThreeChannelsAreTheirLuminance) {
  const auto field = SmoothField(3);
  const Lamp lamp = LampOfField(field);
  const double expected = core::Luminance(lightfield::TotalFlux(field));
  EXPECT_NEAR(Value(lamp, FluxOf(lamp)), expected, 1e-6 * expected);
}

TEST(Functional, ChannelsAreWeighedAsAsked) {
  const auto field = SmoothField(3);
  const std::vector<PosedLightField> fields = {{"", {}, field}};
  const std::array factors = {4.0, 0.0, 2.5};
  const auto flux = lightfield::TotalFlux(field);
  const double expected = 4 * flux[0] + 2.5 * flux[2];
  const Lamp lamp = LampOf(fields, factors, "x");
  EXPECT_NEAR(Value(lamp, FluxOf(lamp)), expected, 1e-6 * expected);
  EXPECT_THROW(LampOf(fields, std::array{1.0, 2.0}, "x"), InputError);
}

constexpr std::array kOneChannel = {1.0};

// Over draws of the noise, (n - 1) s^2 / u^2 of every quantity is chi-squared.
void ExpectUncertaintiesOfDraws(const NoisyField& noisy, std::span<const double> channels) {
  constexpr int kDraws = 400;
  const auto lamp_of = [&](const lightfield::LightField& field) {
    const std::vector<PosedLightField> fields = {{"", {}, field}};
    return LampOf(fields, channels, "");
  };
  Lamp lamp = lamp_of(noisy.field());
  const std::vector<PosedLightField> sigma = {{"", {}, noisy.SigmaOfC()}};
  const std::vector<SolveMaps> maps = {noisy.maps()};
  SetNoise(lamp, sigma, maps, "sigma");
  EXPECT_EQ(lamp.noise[0].independent_texels(), 0u);
  const Vec3 p{0.05, -0.02, 0.4};
  const Functional e = IlluminanceAt(lamp, p, {0, 0, -1}), flux = FluxOf(lamp);
  const std::vector<Functional> asked = {
      flux,
      IntensityTowards(lamp, {0, 0, 1}),
      IntensityTowards(lamp, {0.2, 0.1, 1}),
      e,
      IlluminanceAt(lamp, {0, 0, 0.05}, Normalized(Vec3{1, 0, -0.2})),
      FluenceRateAt(lamp, p),
      ReceivedAt(lamp, {.shape = ReceiverShape::kCylinder, .axis = {0, 1, 0}}, p),
      LightVectorAt(lamp, p)[0],
      Sum({{1, &e}, {-0.1, &flux}}),
  };
  std::vector<double> sums(asked.size()), squares(asked.size());
  core::Random random(kSeed, 1);
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  for (int draw = 0; draw < kDraws; ++draw) {
    const Lamp drawn = lamp_of(noisy.Draw(random));
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const double error = Value(drawn, asked[k]) - Value(lamp, asked[k]);
      sums[k] += error;
      squares[k] += error * error;
    }
  }
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const double u = Uncertainty(lamp, asked[k]).value(), mean = sums[k] / kDraws;
    EXPECT_LT(std::abs(mean), 4.5 * u / std::sqrt(kDraws)) << k;
    const double chi_squared = (squares[k] - kDraws * mean * mean) / (u * u);
    EXPECT_NEAR(chi_squared, kDraws - 1, 4.5 * std::sqrt(2.0 * (kDraws - 1))) << k;
  }
}

TEST(CoefficientNoise, OfTheGramSolve) {
  const auto field = SmoothField();
  ExpectUncertaintiesOfDraws({field, PlainMaps(field.geometry.grid), 0.01}, kOneChannel);
}

TEST(CoefficientNoise, OfTheLuminanceOfThreeChannels) {
  const auto field = SmoothField(3);
  ExpectUncertaintiesOfDraws({field, PlainMaps(field.geometry.grid), 0.01},
                             core::kLuminanceWeights);
}

TEST(CoefficientNoise, OfTwoChannelsWeighed) {
  const auto field = SmoothField(2);
  ExpectUncertaintiesOfDraws({field, PlainMaps(field.geometry.grid), 0.01}, std::array{4.6, -1.3});
}

TEST(CoefficientNoise, OfDualFilters) {
  ExpectUncertaintiesOfDraws({SmoothField(), {}, 0.01}, kOneChannel);
}

// What no solve of all positions leaves is taken as independent, and counted.
TEST(CoefficientNoise, SigmaOfOneCoefficientAloneIsIndependent) {
  const auto field = SmoothField();
  lightfield::LightField sigma(field.geometry);
  sigma.image(5, 0)[7 * 17 + 6] = 3;
  Lamp lamp = LampOfField(field);
  const std::vector<PosedLightField> sigmas = {{"", {}, sigma}};
  const std::vector<SolveMaps> maps = {PlainMaps(field.geometry.grid)};
  SetNoise(lamp, sigmas, maps, "sigma");
  EXPECT_EQ(lamp.noise[0].independent_texels(), 1u);
  const Functional flux = FluxOf(lamp);
  EXPECT_NEAR(Uncertainty(lamp, flux).value(), 3 * flux[0].weights[0], 1e-9 * flux[0].weights[0]);
}

// Without weights in memory: maps, none, and a texel that is independent of them.
TEST(CoefficientNoise, SeparableWeightsSayTheSame) {
  const auto field = SmoothField();
  for (const SolveMaps& maps : {PlainMaps(field.geometry.grid), SolveMaps{}})
    for (const float spoilt : {1.0f, 30.0f}) {
      auto sigma = NoisyField(field, maps, 0.01).SigmaOfC();
      sigma.image(5, 0)[7 * 17 + 6] *= spoilt;
      Lamp lamp = LampOfField(field);
      const std::vector<PosedLightField> sigmas = {{"", {}, sigma}};
      SetNoise(lamp, sigmas, std::vector<SolveMaps>{maps}, "sigma");
      EXPECT_EQ(lamp.noise[0].independent_texels(), maps.independent() || spoilt == 1 ? 0u : 1u);
      for (const Vec3 d :
           {Vec3{0, 0, 1}, Vec3{-0.1, -0.2, 1}, Vec3{0.6, 0, 1}, Vec3{9, 0, 1}, Vec3{0, 0, -1}}) {
        const Estimate whole = Evaluate(lamp, IntensityTowards(lamp, d)),
                       apart = IntensityEstimate(lamp, d);
        EXPECT_NEAR(apart.value, whole.value, 1e-9 * std::abs(whole.value));
        EXPECT_NEAR(apart.u.value(), whole.u.value(), 1e-9 * whole.u.value());
      }
    }
}

TEST(CoefficientNoise, RefusesWhatIsNoSigma) {
  const auto field = SmoothField();
  Lamp lamp = LampOfField(field);
  auto negative = field;
  negative.data[3] = -1;
  auto other = field;
  other.geometry.delta_m *= 2;
  const auto three = SmoothField(3);
  const std::vector<SolveMaps> maps(1);
  for (const auto& wrong : {negative, other, three}) {
    const std::vector<PosedLightField> sigma = {{"", {}, wrong}};
    EXPECT_THROW(SetNoise(lamp, sigma, maps, "x.sigma.lf.exr"), InputError);
  }
  EXPECT_TRUE(lamp.noise.empty());
}

}  // namespace
}  // namespace luxfield::photometry
