// Frames of a sequence are the pictures of scenes in which everything stands like that.
#include "luxfield/render/picture_sequence.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "tests/render/small_scene.h"

namespace luxfield::render {
namespace {

std::vector<scene::Placement> ThreePlacements() {
  std::vector<scene::Placement> placements;
  for (const double t : {0.0, 0.5, 1.0}) {
    scene::Placement placement;
    placement.camera =
        scene::Camera::LookAt({-1 + t, -1, 1.5 + t}, {0, 2.5, 0.2}, {0, 0, 1}, 50 - 10 * t, 40, 30);
    placement.lamps.push_back(
        {scene::LookAt({0.3 * t, -0.2 * t, 0.6 + 0.2 * t}, {t, 5, 0.3}, {0, 0, 1}), 1 - t / 2});
    placements.push_back(placement);
  }
  return placements;
}

Frame Alone(const scene::Placement& placement, RenderOptions options, std::uint64_t seed) {
  scene::Scene scene = LampOverFloor();
  scene.camera = placement.camera;
  scene.luminaires[0].world_from_luminaire = placement.lamps[0].world_from_luminaire;
  scene.luminaires[0].scale = placement.lamps[0].scale;
  scene.luminaires[0].colour = placement.lamps[0].colour;
  options.seed = seed;
  LitScene lit(Device::Open(), scene);
  return Renderer(lit, options).Render();
}

TEST(PictureSequence, ShowsEachFrameAsIfItWereTheOnlyOne) {
  struct Case {
    const char* estimator;
    Shadows shadows;
  };
  for (const Case& c : {Case{"windowed", Shadows::kTraced}, Case{"volume", Shadows::kSoftMaps},
                        Case{"cells", Shadows::kMaps}}) {
    PictureSequenceOptions options;
    options.picture.estimator = c.estimator;
    options.picture.shadows = c.shadows;
    options.picture.samples_per_pixel = 8;
    options.picture.seed = 5;
    options.placements = ThreePlacements();
    LitScene lit(Device::Open(), LampOverFloor());
    PictureSequence sequence(lit, options);
    ASSERT_EQ(sequence.frame_count(), 3u);
    std::vector<float> before;
    for (std::size_t n = 0; n < 3; ++n) {
      const Frame frame = sequence.Render(n);
      const Frame alone = Alone(options.placements[n], options.picture, 5 + n);
      EXPECT_EQ(frame.radiance.data, alone.radiance.data) << c.estimator << " " << n;
      EXPECT_EQ(frame.variance.data, alone.variance.data) << c.estimator << " " << n;
      EXPECT_NE(frame.radiance.data, before) << c.estimator << " " << n;
      before = frame.radiance.data;
    }
    LitScene again(Device::Open(), LampOverFloor());
    EXPECT_EQ(PictureSequence(again, options).Render(2).radiance.data, before) << c.estimator;
  }
}

TEST(PictureSequence, TakesTheEnvironmentsFramesAlong) {
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("luxfield_sequence_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  for (int frame = 0; frame < 3; ++frame) {
    core::Image image(64, 32, 3);
    for (std::size_t k = 0; k < image.data.size(); ++k)
      image.data[k] = 0.1f + static_cast<float>((k * (7 + frame)) % 32);
    core::WriteExrImage(folder / ("sky_" + std::to_string(frame) + ".exr"), image);
  }
  scene::Scene scene = LampOverFloor();
  scene.environment.emplace().file = folder;
  PictureSequenceOptions options;
  options.picture.samples_per_pixel = 16;
  options.placements = ThreePlacements();
  LitScene lit(Device::Open(), scene);
  PictureSequence sequence(lit, options);
  const Frame last = sequence.Render(2);
  EXPECT_EQ(last.provenance.at("environment file"), "sky_2.exr");
  const Frame back = sequence.Render(0), middle = sequence.Render(1);
  EXPECT_EQ(back.provenance.at("environment file"), "sky_0.exr");

  LitScene all(Device::Open(), scene);
  PictureSequence whole(all, options);
  EXPECT_EQ(whole.Render(0).radiance.data, back.radiance.data);
  EXPECT_EQ(whole.Render(1).radiance.data, middle.radiance.data);
  EXPECT_EQ(whole.Render(2).radiance.data, last.radiance.data);

  options.placements.pop_back();
  EXPECT_THROW(PictureSequence(lit, options), InputError);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::render
