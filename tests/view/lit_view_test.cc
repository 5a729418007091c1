// Pictures for who moves through a scene, judged by those that the renderer makes of it.
#include "luxfield/view/lighting/lit_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "luxfield/core/error.h"
#include "luxfield/core/execution.h"
#include "luxfield/core/exr.h"
#include "luxfield/render/accuracy/accuracy.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/render/film/film.h"
#include "tests/render/small_scene.h"

namespace luxfield::view {
namespace {

using render::Frame;
using render::LuminanceError;

LitRequest Of(const scene::Scene& scene) {
  LitRequest request;
  request.camera = scene.camera;
  for (const auto& luminaire : scene.luminaires)
    request.lamps.push_back({luminaire.world_from_luminaire, luminaire.scale});
  request.frame_s = 1e3;  // all pixels
  return request;
}

// Pixels of quick pictures are their centres, of refined ones means over several points.
constexpr int kQuick = 1, kRefined = render::kSmoothAntialias;

Frame Exact(const scene::Scene& scene, int antialias) {
  render::LitScene lit(render::Device::Open(), scene);
  render::RenderOptions options;
  options.estimator = "exact";
  options.antialias = antialias;
  options.shadows = render::Shadows::kNone;
  return render::Renderer(lit, options).Render();
}

Frame Reference(const scene::Scene& scene, int antialias) {
  render::LitScene lit(render::Device::Open(), scene);
  render::RenderOptions options;
  options.samples_per_pixel = 4000;
  options.antialias = antialias;
  options.seed = 99;
  return render::Renderer(lit, options).Render();
}

Frame Done(LitView& view) {
  LitPicture picture = view.Refine();
  while (!picture.done) picture = view.Refine();
  return *picture.frame;
}

// About as bright as the lamp.
scene::AreaLight PanelOverBox() {
  scene::AreaLight light;
  light.name = "panel";
  light.radiance = {1, 1, 1};
  light.width_m = light.height_m = 0.5;
  light.world_from_light = scene::LookAt({0, 2, 1.5}, {0.2, 2.5, 0}, {0, 1, 0});
  return light;
}

class LitViewTest : public testing::Test {
 protected:
  scene::Scene scene_ = render::LampOverFloor();
};

TEST_F(LitViewTest, QuickPicturesAreWithinTheErrorTheyState) {
  LitView view(render::Device::Open(), scene_);
  LitRequest request = Of(scene_);
  request.moving_shadows = false;
  view.Ask(request);
  view.Quick();  // knows no speed yet, and has fewer pixels
  const LitPicture picture = view.Quick();
  EXPECT_TRUE(picture.quick);
  ASSERT_EQ(picture.frame->width, scene_.camera.width);
  EXPECT_LE(LuminanceError(picture.frame->radiance, Exact(scene_, kQuick).radiance),
            picture.error.value());
  EXPECT_EQ(picture.samples, 0);
  request.moving_shadows = true;
  view.Ask(request);
  EXPECT_FALSE(view.Quick().error);
}

TEST_F(LitViewTest, QuickPicturesGetSmallerWhereTimeIsShort) {
  LitView view(render::Device::Open(), scene_);
  LitRequest request = Of(scene_);
  request.frame_s = 1e-9;
  view.Ask(request);
  view.Quick();
  const LitPicture picture = view.Quick();
  EXPECT_LT(picture.frame->width, scene_.camera.width / 4);
  EXPECT_GE(picture.frame->width, 1);
}

// With a light that takes many samples, pictures come on the way.
TEST_F(LitViewTest, RefinedPicturesReachTheErrorAskedFor) {
  scene_.area_lights.push_back(PanelOverBox());
  LitRequest request = Of(scene_);
  request.round_s = 1e-9;
  // Where samples cost hardly more than the picture itself, all are taken in one round: then half of
  // the error takes four times as many.
  int rounds = 0;
  for (request.error = 0.01; rounds < 2; request.error /= 2) {
    ASSERT_GT(request.error, 0.001);
    LitView view(render::Device::Open(), scene_);
    view.Ask(request);
    LitPicture picture;
    double before = 1e9;
    for (rounds = 0; !picture.done; ++rounds) {
      ASSERT_LT(rounds, 60);
      picture = view.Refine();
      EXPECT_LT(picture.error.value(), 1.5 * before);  // it falls, up to its own scatter
      before = picture.error.value();
    }
    EXPECT_TRUE(picture.reached);
    EXPECT_LE(picture.error.value(), request.error);
    EXPECT_EQ(view.Refine().frame->radiance.data, picture.frame->radiance.data);
    // The estimate's own uncertainty, and the reference's noise, some 0.2 %.
    constexpr double kReference = 0.002;
    EXPECT_LT(LuminanceError(picture.frame->radiance, Reference(scene_, kRefined).radiance),
              1.4 * std::hypot(request.error, kReference));
    EXPECT_GT(picture.samples, 0);
  }
}

// Lobes take many more samples of `cells`, which the window would light them with unasked.
TEST_F(LitViewTest, RefinedPicturesTakeTheEstimatorThatRenderChooses) {
  for (const bool glossy : {false, true})
    for (const bool shadows : {false, true}) {
      scene_.geometry.materials[0].kind =
          glossy ? scene::MaterialKind::kGgx : scene::MaterialKind::kLambert;
      scene_.geometry.materials[0].roughness = 0.2f;
      LitView view(render::Device::Open(), scene_);
      LitRequest request = Of(scene_);
      request.error = 0.01;
      request.shadows = shadows;
      view.Ask(request);
      LitPicture picture = view.Refine();
      while (!picture.done) picture = view.Refine();
      EXPECT_TRUE(picture.reached);

      render::LitScene lit(render::Device::Open(), scene_);
      render::AccuracyRequest of_render;
      of_render.rel_error = request.error;
      of_render.picture.antialias = kRefined;
      of_render.picture.shadows = shadows ? render::Shadows::kTraced : render::Shadows::kNone;
      const auto rendered = RenderToAccuracy(lit, of_render);
      std::printf("glossy %d shadows %d: %s with %.0f, %s with %d\n", glossy, shadows,
                  picture.estimator.c_str(), picture.samples, rendered.chosen.estimator.c_str(),
                  rendered.chosen.samples_per_pixel);
      EXPECT_EQ(picture.estimator, rendered.chosen.estimator);
      EXPECT_LT(LuminanceError(picture.frame->radiance, rendered.frame.radiance),
                1.5 * std::sqrt(2) * request.error);
      if (glossy && shadows) {
        render::RenderOptions by_cells = of_render.picture;
        by_cells.samples_per_pixel = 64;
        const render::Frame frame = render::Renderer(lit, by_cells).Render();
        const double error = render::NoiseOf(frame, 63).RelativeError();
        EXPECT_LT(picture.samples, 0.5 * 64 * std::pow(error / request.error, 2));
      }
    }
}

TEST_F(LitViewTest, WithoutShadowsOnePictureWithoutNoiseReachesIt) {
  LitView view(render::Device::Open(), scene_);
  LitRequest request = Of(scene_);
  request.shadows = false;
  request.error = 1e-3;
  view.Ask(request);
  const LitPicture picture = view.Refine();
  EXPECT_TRUE(picture.reached);
  EXPECT_LE(LuminanceError(picture.frame->radiance, Exact(scene_, kRefined).radiance),
            request.error);
}

// The same as if the scene's file had the lamp and the camera there.
TEST_F(LitViewTest, MovedLampsAndCamerasLightAsIfTheyHadStoodThere) {
  scene::Scene moved = scene_;
  moved.luminaires[0].world_from_luminaire =
      scene::LookAt({0.5, 0.2, 0.8}, {-0.5, 4, 0.1}, {0, 0, 1});
  moved.luminaires[0].scale = 0.25;
  moved.camera = scene::Camera::LookAt({1.5, -0.5, 1}, {0, 2, 0}, {0, 0, 1}, 60, 40, 30);
  LitView view(render::Device::Open(), scene_);
  view.Ask(Of(scene_));
  view.Quick();  // makes the tables of where things were
  LitRequest request = Of(moved);
  request.shadows = false;
  view.Ask(request);
  EXPECT_FALSE(view.Quick().error);  // its volume is that of elsewhere
  EXPECT_LE(LuminanceError(view.Refine().frame->radiance, Exact(moved, kRefined).radiance),
            request.error);
}

// Lights of photometric files, likewise.
TEST_F(LitViewTest, MovedClassicalLightsLightAsIfTheyHadStoodThere) {
  scene::ClassicalLight light;
  light.name = "tube";
  light.model = scene::ClassicalModel::kArea;
  light.distribution = std::filesystem::path(LUXFIELD_SOURCE_DIR) / "data/scenes/tube.ies";
  light.world_from_light = scene::LookAt({0, 2, 1.5}, {0, 2.5, 0}, {0, 1, 0});
  scene_.luminaires.clear();
  scene_.classical_lights.push_back(light);
  scene::Scene moved = scene_;
  moved.classical_lights[0].world_from_light =
      scene::LookAt({0.75, 1, 1}, {0, 2.5, 0}, {0, 1, 0.5});
  moved.classical_lights[0].scale = 0.5;
  moved.classical_lights[0].colour = {1, 0.5, 0.25};
  LitView view(render::Device::Open(), scene_), of_moved(render::Device::Open(), moved);
  LitRequest request = Of(scene_);
  view.Ask(request);
  const Frame before = *view.Quick().frame;
  const scene::ClassicalLight& there = moved.classical_lights[0];
  request.classical_lights = {{there.world_from_light, there.scale, there.colour}};
  LitView anew(render::Device::Open(), scene_);
  anew.Ask(request);
  of_moved.Ask(Of(moved));
  const Frame changed = *anew.Quick().frame, expected = *of_moved.Quick().frame;
  EXPECT_EQ(changed.radiance.data, expected.radiance.data);
  EXPECT_NE(changed.radiance.data, before.radiance.data);
  // It is sampled, also where nothing is in its way, with an error that is not the volume's.
  request.moving_shadows = false;
  view.Ask(request);
  EXPECT_FALSE(view.Quick().error);
}

// Materials and the environment, likewise: the same pictures as of a scene that has them.
TEST_F(LitViewTest, ChangedMaterialsAndEnvironmentsLightAsIfTheSceneHadThem) {
  core::Image sky(16, 8, 3);
  for (std::size_t i = 0; i < sky.data.size(); ++i) sky.data[i] = static_cast<float>(i % 7);
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield_view_sky.exr";
  core::WriteExrImage(file, sky);
  scene_.environment = scene::Environment{};
  scene_.environment->file = file;
  scene_.environment->layout = environment::EnvironmentLayout::kLatitudeLongitude;
  scene_.environment->face_size = 8;
  scene::Scene other = scene_;
  other.geometry.materials[0].albedo = {0.9f, 0.2f, 0.4f};
  other.environment->world_from_environment = scene::RotationXyz({10, 20, 70});
  other.environment->scale = 3;
  LitView view(render::Device::Open(), scene_), of_other(render::Device::Open(), other);
  LitRequest request = Of(scene_);
  request.error = 0.02;
  view.Ask(request);
  const Frame before = Done(view);
  request.materials =
      std::make_shared<const std::vector<scene::Material>>(other.geometry.materials);
  request.environment = PlacedSky{other.environment->world_from_environment, 3};
  view.Ask(request);
  LitRequest other_request = Of(other);
  other_request.error = 0.02;
  other_request.seed = 2;
  of_other.Ask(other_request);
  const Frame changed = Done(view), expected = Done(of_other);
  // Two pictures of that error, whose estimates scatter.
  EXPECT_LT(LuminanceError(changed.radiance, expected.radiance), 1.5 * std::sqrt(2) * 0.02);
  EXPECT_GT(LuminanceError(changed.radiance, before.radiance), 0.2);
}

// The picture of the soft maps is as far from the traced one as was measured, at fewer pixels.
TEST_F(LitViewTest, TheErrorOfSoftShadowsIsMeasuredForTheViewThatIsAsked) {
  LitView view(render::Device::Open(), scene_);
  LitRequest request = Of(scene_);
  view.Ask(request);
  view.Quick();
  EXPECT_FALSE(view.soft_maps_error());
  EXPECT_TRUE(view.HasUnknownShadows());
  const LitPicture quick = view.Quick();
  view.MeasureShadows();
  EXPECT_FALSE(view.HasUnknownShadows());
  const double measured = view.soft_maps_error().value();
  EXPECT_EQ(view.Refine().soft_maps_error, measured);
  const double apart = LuminanceError(quick.frame->radiance, Reference(scene_, kQuick).radiance);
  // The reference's noise is some 0.2 %, the volume's error 0.5 %, the small picture has 3000 pixels.
  EXPECT_NEAR(measured, apart, 0.25 * apart + 0.007);
  request.lamps[0].scale = 0.5;
  view.Ask(request);
  EXPECT_TRUE(view.HasUnknownShadows());
  request.moving_shadows = false;
  view.Ask(request);
  EXPECT_FALSE(view.HasUnknownShadows());
}

TEST_F(LitViewTest, AnInterruptedRoundLeavesThoseBeforeIt) {
  scene_.area_lights.push_back(PanelOverBox());
  LitView view(render::Device::Open(), scene_);
  LitRequest request = Of(scene_);
  request.error = 0.003;
  request.round_s = 1e-9;
  view.Ask(request);
  const auto interrupted = [&] {
    core::Execution execution;
    execution.interrupts = [] { return 1; };
    core::RunWith(std::move(execution), [&] { EXPECT_THROW(view.Refine(), Interrupted); });
  };
  interrupted();  // while the estimator is chosen
  const double before = view.Refine().samples;
  interrupted();
  EXPECT_GT(view.Refine().samples, before);
}

// Glossy surfaces, which the volume does not take.
TEST_F(LitViewTest, QuickPicturesShowGlossySurfacesAsMattOnes) {
  scene_.geometry.materials[0].kind = scene::MaterialKind::kGgx;
  scene_.geometry.materials[0].roughness = 0.4f;
  LitView view(render::Device::Open(), scene_);
  LitRequest request = Of(scene_);
  request.moving_shadows = false;
  view.Ask(request);
  view.Quick();
  const LitPicture picture = view.Quick();
  scene::Scene matt = scene_;
  scene::MakeLambertian(matt.geometry);
  EXPECT_LE(LuminanceError(picture.frame->radiance, Exact(matt, kQuick).radiance),
            picture.error.value());
}

}  // namespace
}  // namespace luxfield::view
