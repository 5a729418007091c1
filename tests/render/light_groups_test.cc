// Light groups: that they are the picture, and what scaling them makes of it.
#include "luxfield/render/film/light_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/measures.h"
#include "luxfield/render/film/film.h"
#include "luxfield/render/renderer.h"
#include "tests/render/small_scene.h"

namespace luxfield::render {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// Two lamps and a sky behind, over a floor that glows a little.
scene::Scene TwoLampsAndASky(double left = 1, double right = 0.5, double sky_scale = 1) {
  const auto sky = std::filesystem::path(testing::TempDir()) / "luxfield_light_groups_sky.exr";
  core::Image picture(16, 8, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i)
    picture.data[i] = 0.05f + 0.01f * static_cast<float>(i % 16);
  core::WriteExrImage(sky, picture);
  scene::Scene scene = render::LampOverFloor();
  scene.luminaires.push_back(scene.luminaires[0]);
  scene.luminaires[0].name = "left lamp";
  scene.luminaires[0].scale = left;
  scene.luminaires[1].name = "right lamp";
  scene.luminaires[1].scale = right;
  scene.luminaires[1].world_from_luminaire = scene::LookAt({1.5, 0.5, 1}, {0.5, 2.5, 0}, {0, 0, 1});
  scene.environment.emplace();
  scene.environment->file = sky;
  scene.environment->scale = sky_scale;
  scene.geometry.materials[0].emission = {0.02f, 0.01f, 0.005f};
  scene.camera.width = 24;
  scene.camera.height = 18;
  return scene;
}

Frame RenderWith(const scene::Scene& scene, RenderOptions options) {
  LitScene lit(Device::Open(), scene);
  return Renderer(lit, options).Render();
}

RenderOptions Grouped(int passes = 1) {
  RenderOptions options;
  options.estimator = "windowed";
  options.samples_per_pixel = 48;
  options.antialias = 2;
  options.passes = passes;
  options.light_groups = true;
  return options;
}

// Of some terms, each rounded to float a few times.
void ExpectSame(const core::Image& a, const core::Image& b) {
  ASSERT_EQ(a.data.size(), b.data.size());
  for (std::size_t i = 0; i < a.data.size(); ++i)
    EXPECT_NEAR(a.data[i], b.data[i], 2e-6 * std::abs(b.data[i]) + 1e-12);
}

class LightGroupsTest : public testing::Test {
 protected:
};

TEST_F(LightGroupsTest, AddUpToThePicture) {
  for (const int passes : {1, 3}) {
    const Frame frame = RenderWith(TwoLampsAndASky(), Grouped(passes));
    ASSERT_EQ(frame.groups.size(), 4u);
    EXPECT_EQ(frame.groups[0].name, "left lamp");
    EXPECT_EQ(frame.groups[1].name, "right lamp");
    EXPECT_EQ(frame.groups[2].name, "environment");
    EXPECT_EQ(frame.groups[3].name, "emission");
    const Frame same = ScaleLightGroups(frame, {}, "x");
    ExpectSame(same.radiance, frame.radiance);
    ExpectSame(same.irradiance, frame.irradiance);
    if (passes == 1) ExpectSame(same.variance, frame.variance);
    // They change nothing else of the picture.
    RenderOptions plain = Grouped(passes);
    plain.light_groups = false;
    const Frame alone = RenderWith(TwoLampsAndASky(), plain);
    EXPECT_EQ(alone.radiance.data, frame.radiance.data);
    EXPECT_EQ(alone.irradiance.data, frame.irradiance.data);
    EXPECT_EQ(alone.samples.data, frame.samples.data);
    EXPECT_EQ(alone.groups.size(), 0u);
  }
}

// A scaled picture is the picture of a scene whose lights are scaled so: the same samples bring the
// scaled light, and what is said of the noise is its own. Each light has its samples: those that
// pixels deal out themselves go where the light is.
TEST_F(LightGroupsTest, ScaledAreThePictureOfScaledLights) {
  RenderOptions options = Grouped();
  options.light_samples = {16, 16, 16};
  const Frame frame = RenderWith(TwoLampsAndASky(), options);
  const Frame dimmed =
      ScaleLightGroups(frame, {{"left lamp", 0.25}, {"environment", 3}, {"right lamp", 0}}, "x");
  const Frame truth = RenderWith(TwoLampsAndASky(0.25, 0, 3), options);
  ExpectSame(dimmed.radiance, truth.radiance);
  ExpectSame(dimmed.irradiance, truth.irradiance);
  double said = 0, true_sum = 0;
  for (const float v : dimmed.variance.data) said += v;
  for (const float v : truth.variance.data) true_sum += v;
  // Both are measured at some 200 draws of their own.
  std::printf("variance of the scaled picture over that of the rendered one: %.3f\n",
              said / true_sum);
  EXPECT_NEAR(said / true_sum, 1, 0.5);
  EXPECT_EQ(dimmed.provenance.at("light_scales"),
            "environment = 3, left lamp = 0.25, right lamp = 0");
  EXPECT_EQ(dimmed.samples.data, frame.samples.data);
  // Again: scales multiply.
  const Frame back = ScaleLightGroups(dimmed, {{"left lamp", 4}, {"environment", 1.0 / 3}}, "x");
  ExpectSame(back.groups[0].radiance, frame.groups[0].radiance);
  ExpectSame(back.groups[2].variance, frame.groups[2].variance);
}

TEST_F(LightGroupsTest, SurviveTheFile) {
  const Frame frame = RenderWith(TwoLampsAndASky(), Grouped());
  const auto path = std::filesystem::path(testing::TempDir()) / "luxfield_light_groups.exr";
  WriteFrame(path, frame);
  core::ExrReader reader(path);
  EXPECT_EQ(reader.ReadFloat(0, "left lamp.G"),
            std::vector<float>(frame.groups[0].radiance.plane(1).begin(),
                               frame.groups[0].radiance.plane(1).end()));
  EXPECT_TRUE(reader.has_channel(0, "environment.irradiance.R"));
  EXPECT_TRUE(reader.has_channel(0, "right lamp.variance.Y"));
  const Frame again = ReadFrame(path);
  ASSERT_EQ(again.groups.size(), frame.groups.size());
  for (std::size_t g = 0; g < again.groups.size(); ++g) {
    EXPECT_EQ(again.groups[g].name, frame.groups[g].name);
    EXPECT_EQ(again.groups[g].radiance.data, frame.groups[g].radiance.data);
    EXPECT_EQ(again.groups[g].irradiance.data, frame.groups[g].irradiance.data);
    EXPECT_EQ(again.groups[g].variance.data, frame.groups[g].variance.data);
  }
  EXPECT_EQ(again.normal.data, frame.normal.data);
  EXPECT_EQ(again.position.data, frame.position.data);
  EXPECT_EQ(again.alpha.data, frame.alpha.data);
  EXPECT_EQ(again.coverage.data, frame.coverage.data);
  EXPECT_EQ(again.variance.data, frame.variance.data);
  EXPECT_EQ(again.samples.data, frame.samples.data);
  EXPECT_EQ(again.provenance, frame.provenance);
}

TEST_F(LightGroupsTest, WrongNamesAreNamed) {
  const Frame frame = RenderWith(TwoLampsAndASky(), Grouped());
  EXPECT_THAT(
      [&] {
        ScaleLightGroups(frame, {{"left lmap", 1}}, "x.exr");
      },
      ThrowsMessage<InputError>(
          testing::AllOf(HasSubstr("x.exr"), HasSubstr("did you mean 'left lamp'"))));
  EXPECT_THAT(
      [&] {
        ScaleLightGroups(frame, {{"sun", 1}}, "x.exr");
      },
      ThrowsMessage<InputError>(HasSubstr("left lamp, right lamp, environment")));
  EXPECT_THAT(
      [&] {
        ScaleLightGroups(frame, {{"left lamp", -1}}, "x.exr");
      },
      ThrowsMessage<InputError>(HasSubstr("-1")));
  Frame plain = frame;
  plain.groups.clear();
  EXPECT_THAT(
      [&] {
        ScaleLightGroups(plain, {{"left lamp", 1}}, "x.exr");
      },
      ThrowsMessage<InputError>(HasSubstr("--light-groups")));
  // Names that other layers have, before anything is rendered.
  using Names = std::vector<std::string>;
  EXPECT_THAT([] { MakeLightGroups(Names{"a"}, Names{"a"}, false, 2, 2); },
              ThrowsMessage<InputError>(HasSubstr("'a'")));
  EXPECT_THAT([] { MakeLightGroups(Names{"irradiance"}, Names{}, false, 2, 2); },
              ThrowsMessage<InputError>(HasSubstr("irradiance.R")));
  EXPECT_THAT(
      [] {
        MakeLightGroups(Names{"a", "a.irradiance"}, Names{}, false, 2, 2);
      },
      ThrowsMessage<InputError>(HasSubstr("rename")));
  EXPECT_THAT(
      [] {
        MakeLightGroups(Names{"a", "b"}, Names{}, false, 16384, 16384);
      },
      ThrowsMessage<InputError>(HasSubstr("14.0 GiB")));
  EXPECT_EQ(MakeLightGroups(Names{"cube", "cube"}, Names{"lamp"}, false, 2, 2).size(), 2u);
}

}  // namespace
}  // namespace luxfield::render
