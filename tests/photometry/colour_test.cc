// Colours against those of illuminants and black bodies, and their noise against draws.
#include "luxfield/photometry/colour.h"

#include <gtest/gtest.h>

#include "luxfield/core/primaries.h"
#include "tests/photometry/lamps.h"
#include "tests/seed.h"

namespace luxfield::photometry {
namespace {

using core::Rgb;
using lightfield::LightField;
using lightfield::PosedLightField;

// u', v' of x, y.
std::array<double, 2> Uv(double x, double y) {
  const double d = -2 * x + 12 * y + 3;
  return {4 * x / d, 9 * y / d};
}

// CIE 15:2018: illuminant A is the black body of 2856 K, D65 has 6504 K, D50 5003 K.
TEST(ColourTemperature, OfIlluminants) {
  for (const auto& [x, y, kelvin, duv] :
       {std::array{0.44758, 0.40745, 2856.0, 0.0}, std::array{0.31272, 0.32903, 6504.0, 0.0032},
        std::array{0.34567, 0.35851, 5003.0, 0.0032}}) {
    const auto [u, v] = Uv(x, y);
    const auto found = ColourTemperatureOf(u, v);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->kelvin, kelvin, 3e-3 * kelvin);
    EXPECT_NEAR(found->duv, duv, 3e-4);
  }
  // Black bodies by Planck's law and the CIE 1931 observer: x, y.
  for (const auto& [x, y, kelvin] :
       {std::array{0.52669, 0.41331, 2000.0}, std::array{0.38045, 0.37675, 4000.0},
        std::array{0.28063, 0.28828, 10000.0}}) {
    const auto [u, v] = Uv(x, y);
    const auto found = ColourTemperatureOf(u, v);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->kelvin, kelvin, 5e-3 * kelvin);
    EXPECT_NEAR(found->duv, 0, 2e-4);
  }
}

TEST(ColourTemperature, FarFromBlackBodiesThereIsNone) {
  for (const auto& [x, y] :
       {std::array{0.64, 0.33}, std::array{0.30, 0.60}, std::array{0.15, 0.06}}) {
    const auto [u, v] = Uv(x, y);
    EXPECT_FALSE(ColourTemperatureOf(u, v));
  }
}

// White on the axis, reddish towards +u, bluish towards -u: red = 1 + a s, blue = 1 - a s.
LightField Tinted() {
  LightField field = SmoothField(3);
  const auto& g = field.geometry;
  for (int m = 0; m < g.grid.count(); ++m)
    for (int row = 0; row < g.lattice.height; ++row)
      for (int column = 0; column < g.lattice.width; ++column) {
        const auto s = g.lattice.centre(row, column);
        const std::size_t k = std::size_t(row) * g.lattice.width + column;
        const float light = field.image(m, 1)[k];
        field.image(m, 0)[k] = light * static_cast<float>(1 + s.x);
        field.image(m, 2)[k] = light * static_cast<float>(1 - s.x);
      }
  return field;
}

ColourLamp LampInColour(const LightField& field) {
  const std::vector<PosedLightField> fields = {{"", {}, field}};
  return *ColourLampOf(fields, {}, {}, "");
}

TEST(Colour, IsThatOfTheIntensitiesOfItsChannels) {
  const LightField field = Tinted();
  const ColourLamp lamp = LampInColour(field);
  for (const lightfield::Vec3 d : {lightfield::Vec3{0, 0, 1}, {0.3, 0, 1}, {-0.2, 0.1, 1}}) {
    const auto rgb = FarFieldIntensity(field, d);
    const Rgb xyz = core::Apply(core::XyzFromRgb(core::kRec709), {rgb[0], rgb[1], rgb[2]});
    const double sum = xyz[0] + xyz[1] + xyz[2];
    const Colour colour = *ColourOf(lamp, IntensityTowards(lamp.channels[0], d));
    EXPECT_NEAR(colour.x.value, xyz[0] / sum, 1e-9);
    EXPECT_NEAR(colour.y.value, xyz[1] / sum, 1e-9);
    const auto [u, v] = Uv(xyz[0] / sum, xyz[1] / sum);
    EXPECT_NEAR(colour.u.value, u, 1e-9);
    EXPECT_NEAR(colour.v.value, v, 1e-9);
    EXPECT_FALSE(colour.x.u);
  }
}

TEST(Colour, DeviationsAreThoseOfTheTable) {
  const LightField field = Tinted();
  const std::vector<PosedLightField> fields = {{"", {}, field}};
  const Lamp luminance = LampOf(fields);
  const IntensityTable table = TableOf(luminance, 30, 5);
  const ColourDistribution found =
      ColourDistributionOf(LampInColour(field), table, PeakDirectionOf(luminance));
  double largest = 0, most = 0;
  for (const Estimate& one : table.intensity) most = std::max(most, one.value);
  for (std::size_t k = 0; k < table.intensity.size(); ++k) {
    EXPECT_EQ(found.table[k].has_value(), table.intensity[k].value > 0.01 * most) << k;
    if (table.intensity[k].value < 0.1 * most) continue;
    largest = std::max(largest, std::hypot(found.table[k]->u.value - found.mean->u.value,
                                           found.table[k]->v.value - found.mean->v.value));
  }
  EXPECT_NEAR(found.largest_deviation->value, largest, 1e-12);
  EXPECT_LT(found.rms_deviation->value, largest);
  EXPECT_GT(found.rms_deviation->value, 0.1 * largest);
  // An even lamp deviates nowhere.
  LightField even = SmoothField(3);
  for (int m = 0; m < even.geometry.grid.count(); ++m)
    for (const int channel : {1, 2})
      std::ranges::copy(even.image(m, 0), even.image(m, channel).begin());
  const ColourDistribution none =
      ColourDistributionOf(LampInColour(even), table, PeakDirectionOf(luminance));
  EXPECT_LT(none.largest_deviation->value, 1e-6);
  EXPECT_NEAR(none.axis->kelvin->value, 6504, 20);
}

TEST(Colour, OneChannelAndDarknessHaveNone) {
  const std::vector<PosedLightField> one = {{"", {}, SmoothField()}};
  EXPECT_FALSE(ColourLampOf(one, {}, {}, ""));
  LightField dark = SmoothField(3);
  for (float& c : dark.data) c = 0;
  const ColourLamp lamp = LampInColour(dark);
  const Lamp luminance = lamp.channels[0];
  EXPECT_FALSE(ColourOf(lamp, FluxOf(luminance)));
  const ColourDistribution none = ColourDistributionOf(lamp, TableOf(luminance, 90, 30), {0, 0, 1});
  EXPECT_FALSE(none.mean || none.largest_deviation || none.rms_deviation);
}

// Over draws (n - 1) s^2 / u^2 is chi-squared.
TEST(Colour, ItsNoiseIsThatOfDraws) {
  constexpr int kDraws = 300;
  const LightField field = Tinted();
  const NoisyField noisy(field, PlainMaps(field.geometry.grid), 0.001);
  const std::vector<PosedLightField> fields = {{"", {}, field}},
                                     sigma = {{"", {}, noisy.SigmaOfC()}};
  const std::vector<SolveMaps> maps = {noisy.maps()};
  const ColourLamp lamp = *ColourLampOf(fields, sigma, maps, "sigma");
  const Functional functional = IntensityTowards(lamp.channels[0], {0.2, 0.05, 1});
  const Colour truth = *ColourOf(lamp, functional);
  const auto figures = [](const Colour& c) {
    return std::vector<Estimate>{c.x, c.y, c.u, c.v, *c.kelvin, *c.duv};
  };
  const auto expected = figures(truth);
  std::vector<double> squares(expected.size());
  core::Random random(TestSeed(20261129), 1);
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto found = figures(*ColourOf(LampInColour(noisy.Draw(random)), functional));
    for (std::size_t k = 0; k < expected.size(); ++k)
      squares[k] += std::pow((found[k].value - expected[k].value) / expected[k].u.value(), 2);
  }
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_NEAR(squares[k], kDraws, 4.5 * std::sqrt(2.0 * kDraws)) << k;
}

}  // namespace
}  // namespace luxfield::photometry
