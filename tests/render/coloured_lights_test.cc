// Lights whose channels have factors: each channel of what they bring is theirs times its own.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/render/lights_apart.h"
#include "tests/render/renderer_fixture.h"

namespace luxfield::render {
namespace {

constexpr core::Rgb kRed = {2, 0.5, 0}, kBlue = {0.125, 0.25, 1};

// A grey lamp and a point of a photometric file, each of its own group.
scene::Scene TwoLights() {
  auto scene = Floor({Above(WriteLamp("grey", Lamp(1)), -0.5, 1.5)});
  const auto file = Temporary("coloured.ies");
  core::WriteFileAtomically(
      file, "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 1\n0 60 90\n0\n4 3 0\n");
  scene.classical_lights.push_back({"point",
                                    scene::ClassicalModel::kPoint,
                                    file,
                                    {},
                                    scene::LookAt({0.6, 0, 1.2}, {0.5, 0.2, 0}, {0, 1, 0}),
                                    200});
  return scene;
}

scene::Scene Coloured(scene::Scene scene) {
  scene.luminaires[0].colour = kRed;
  scene.classical_lights[0].colour = kBlue;
  return scene;
}

void ExpectTimes(const core::Rgb& colour, const core::Image& white, const core::Image& coloured) {
  double light = 0;
  for (int c = 0; c < white.channels; ++c)
    for (std::size_t k = 0; k < white.plane_size(); ++k) {
      const double expected = colour[static_cast<std::size_t>(c)] * double{white.plane(c)[k]};
      ASSERT_NEAR(coloured.plane(c)[k], expected, 2e-6 * std::abs(expected))
          << "channel " << c << ", pixel " << k;
      light += expected;
    }
  EXPECT_GT(light, 0);
}

// Samples are drawn as those of the white lights are, whose light they then are times the colour; the
// variance of a grey light's luminance goes by the square of its colour's.
TEST(ColouredLights, EachChannelIsTimesItsFactor) {
  const Device device = Device::Open();
  for (const std::string estimator : {"cells", "exact"}) {
    RenderOptions options = Unshadowed(estimator);
    options.light_groups = true;
    options.relight = false;
    options.light_samples = {16, 1};
    LitScene white(device, TwoLights()), coloured(device, Coloured(TwoLights()));
    const Frame before = Renderer(white, options).Render(),
                after = Renderer(coloured, options).Render();
    ASSERT_EQ(after.groups.size(), 2u) << estimator;
    for (std::size_t g = 0; g < 2; ++g) {
      SCOPED_TRACE(fmt::format("{} {}", estimator, after.groups[g].name));
      const core::Rgb& colour = g == 0 ? kRed : kBlue;
      ExpectTimes(colour, before.groups[g].radiance, after.groups[g].radiance);
      ExpectTimes(colour, before.groups[g].irradiance, after.groups[g].irradiance);
      if (estimator == "exact" || g == 1) continue;  // without noise
      ExpectTimes({std::pow(core::Luminance(colour), 2)}, before.groups[g].variance,
                  after.groups[g].variance);
    }
  }
}

// A lamp that is placed anew has the colour that it is placed with.
TEST(ColouredLights, APlacedLampTakesItsColour) {
  const Device device = Device::Open();
  LitScene fresh(device, Coloured(TwoLights())), placed(device, TwoLights());
  const scene::Luminaire lamp = Coloured(TwoLights()).luminaires[0];
  placed.PlaceLuminaire(0, {lamp.world_from_luminaire, lamp.scale, lamp.colour});
  RenderOptions options = Unshadowed("exact");
  options.light_samples = {1, 0};
  EXPECT_EQ(Renderer(placed, options).Render().radiance.data,
            Renderer(fresh, options).Render().radiance.data);
}

// Lights one by one, as shares of strategies are chosen by.
TEST(ColouredLights, LightsApartAreTheirs) {
  const Device device = Device::Open();
  LitScene white(device, TwoLights()), coloured(device, Coloured(TwoLights()));
  const StrategySetting setting{Strategies::kLight, 8};
  const auto before = LightsApart(white, false).Light(setting, 3),
             after = LightsApart(coloured, false).Light(setting, 3);
  ExpectTimes(kRed, before.parts[0], after.parts[0]);
  ExpectTimes(kBlue, before.parts[1], after.parts[1]);
}

}  // namespace
}  // namespace luxfield::render
