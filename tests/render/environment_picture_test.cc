// Pictures of scenes under environment maps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/render/renderer.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;
using std::numbers::pi;

constexpr int kFaceSize = 16;

// A latitude-longitude picture with a bright patch that belongs to no axis.
std::filesystem::path WriteSky(const std::string& name) {
  core::Image image(64, 32, 3);
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 64; ++column)
      for (int c = 0; c < 3; ++c)
        image.at(c, row, column) = row > 16
                                       ? 0.2f
                                       : 0.5f + 0.1f * static_cast<float>(c) +
                                             0.3f * std::sin(0.2f * static_cast<float>(column)) +
                                             (std::hypot(column - 40, row - 6) < 3 ? 20.0f : 0.0f);
  const auto path = std::filesystem::path(testing::TempDir()) / ("luxfield_sky_" + name + ".exr");
  core::WriteExrImage(path, image);
  return path;
}

// A floor and a block on it, symmetric under quarter turns about z, seen together with the sky.
scene::Scene Block(const std::filesystem::path& sky, double turn_deg = 0, bool glossy = false) {
  scene::Scene scene;
  scene.geometry.materials = {{"floor", {0.25f, 0.5f, 0.75f}, -1}};
  if (glossy) {
    scene.geometry.materials[0].kind = scene::MaterialKind::kGgx;
    scene.geometry.materials[0].roughness = 0.5f;
  }
  scene::AppendQuad({-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, 0, scene.geometry);
  scene::AppendBox(scene::Translation({0, 0, 0.4}) * scene::Scaling({0.8, 0.8, 0.8}), 0,
                   scene.geometry);
  const auto turn = scene::RotationXyz({0, 0, turn_deg});
  scene.camera =
      scene::Camera::LookAt(turn.Vector({1.5, -4, 1.5}), {0, 0, 0.8}, {0, 0, 1}, 60, 32, 24);
  scene.environment = scene::Environment{sky, {}, turn, 2, kFaceSize};
  return scene;
}

Frame RenderWith(const scene::Scene& scene, const RenderOptions& options) {
  LitScene lit(Device::Open(), scene);
  return Renderer(lit, options).Render();
}

RenderOptions Options(Shadows shadows, int samples) {
  RenderOptions options;
  options.shadows = shadows;
  options.samples_per_pixel = samples;
  return options;
}

class EnvironmentPicture : public testing::Test {
 protected:
};

// Over the sky itself, a picture without it is the picture with it: A over a sky that is the same
// everywhere, at edges too.
TEST_F(EnvironmentPicture, GoesOverOthersByItsAlpha) {
  const auto sky = std::filesystem::path(testing::TempDir()) / "luxfield_sky_even.exr";
  core::Image even(8, 4, 3);
  std::fill(even.data.begin(), even.data.end(), 0.75f);
  core::WriteExrImage(sky, even);
  auto options = Options(Shadows::kTraced, 32);
  options.antialias = 4;
  const Frame whole = RenderWith(Block(sky), options);
  options.background = false;
  const Frame cut_out = RenderWith(Block(sky), options);
  int edges = 0;
  for (std::size_t i = 0; i < whole.alpha.data.size(); ++i) {
    EXPECT_EQ(whole.alpha.data[i], 1);
    const float alpha = cut_out.alpha.data[i];
    EXPECT_EQ(alpha, cut_out.coverage.data[i]);
    edges += alpha > 0 && alpha < 1;
    for (int c = 0; c < 3; ++c)  // the scene shows the sky at twice its radiance
      EXPECT_NEAR(cut_out.radiance.plane(c)[i] + (1 - alpha) * 1.5f, whole.radiance.plane(c)[i],
                  1e-5f);
  }
  EXPECT_GT(edges, 10);
  EXPECT_EQ(cut_out.irradiance.data, whole.irradiance.data);
  EXPECT_EQ(cut_out.variance.data, whole.variance.data);
  EXPECT_EQ(cut_out.samples.data, whole.samples.data);
}

TEST_F(EnvironmentPicture, ShowsTheSkyAndItsLight) {
  const auto sky = WriteSky("light");
  const auto map = MakeCubeMap(environment::ReadEnvironmentPicture(sky), kFaceSize);
  const scene::Scene scene = Block(sky);
  auto options = Options(Shadows::kNone, 128);
  options.seed = 12;
  const Frame frame = RenderWith(scene, options);
  EXPECT_EQ(frame.provenance.count("environment sha256"), 1u);
  EXPECT_EQ(frame.provenance.at("environment"), options.knobs.environment.Text());
  int background = 0, different = 0, lit = 0;
  double squares = 0;
  std::map<std::array<float, 3>, double> exact;  // by normal: a handful of them
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      if (frame.coverage.at(0, row, column) == 0) {
        const auto t = map.texel_of(scene.camera.Direction(column + 0.5, row + 0.5));
        ++background;
        for (int c = 0; c < 3; ++c)
          different +=
              std::abs(frame.radiance.at(c, row, column) - 2 * map.data[3 * t + c]) > 1e-5f;
        EXPECT_EQ(frame.samples.at(0, row, column), 0);
        EXPECT_EQ(frame.variance.at(0, row, column), 0);
        continue;
      }
      const std::array<float, 3> n{frame.normal.at(0, row, column), frame.normal.at(1, row, column),
                                   frame.normal.at(2, row, column)};
      if (!exact.count(n)) exact[n] = 2 * core::Luminance(Irradiance(map, {n[0], n[1], n[2]}));
      const double e =
          core::Luminance({frame.irradiance.at(0, row, column), frame.irradiance.at(1, row, column),
                           frame.irradiance.at(2, row, column)});
      const double shown = core::Luminance({0.25, 0.5, 0.75}) / pi;
      squares += std::pow((e - exact[n]) * shown, 2) / frame.variance.at(0, row, column);
      ++lit;
    }
  std::printf("%d pixels of sky, %d of them on a border; %d lit, error^2 / stated variance %.3f\n",
              background, different, lit, squares / lit);
  EXPECT_GT(background, 100);
  EXPECT_LT(different, background / 50);  // a direction on the border of two texels
  EXPECT_GT(lit, 100);
  // Stratified: below what independent samples would have, and not without noise. (The luminance of
  // the radiance is not that of the irradiance times that of the albedo: a grey patch is.)
  EXPECT_LT(squares / lit, 1.3);
  EXPECT_GT(squares / lit, 0.01);
}

// The scene with its camera and sky turned together looks the same; turned without the sky it does
// not.
TEST_F(EnvironmentPicture, ARotatedMapRotatesThePicture) {
  const auto sky = WriteSky("rotated");
  // Shared samples and none of the BRDF: the same numbers, turned.
  auto options = Options(Shadows::kNone, 64);
  options.knobs.environment.sets = SampleSets::kShared;
  options.knobs.environment.brdf_share = 0;
  const Frame straight = RenderWith(Block(sky), options);
  const auto difference = [&](const scene::Scene& scene) {
    const Frame frame = RenderWith(scene, options);
    double sum = 0, of = 0;
    for (std::size_t k = 0; k < frame.radiance.data.size(); ++k) {
      sum += std::abs(frame.radiance.data[k] - straight.radiance.data[k]);
      of += straight.radiance.data[k];
    }
    return sum / of;
  };
  scene::Scene camera_only = Block(sky, 90);
  camera_only.environment->world_from_environment = {};
  const double turned = difference(Block(sky, 90)), other = difference(camera_only);
  std::printf("turned together %.2e, the camera alone %.2f\n", turned, other);
  EXPECT_LT(turned, 2e-3);  // pixels on edges of the block and of texels
  EXPECT_GT(other, 0.1);
}

TEST_F(EnvironmentPicture, ShadowsDarkenTheFloorBesideTheBlock) {
  const auto sky = WriteSky("shadows");
  const Frame open = RenderWith(Block(sky), Options(Shadows::kNone, 128));
  const Frame traced = RenderWith(Block(sky), Options(Shadows::kTraced, 128));
  double near_open = 0, near_traced = 0, far_open = 0, far_traced = 0;
  for (int row = 0; row < open.height; ++row)
    for (int column = 0; column < open.width; ++column) {
      const double x = open.position.at(0, row, column), y = open.position.at(1, row, column);
      if (open.coverage.at(0, row, column) == 0 || open.position.at(2, row, column) != 0) continue;
      const double distance = std::max(std::abs(x), std::abs(y));
      (distance < 0.7 ? near_open : far_open) += open.irradiance.at(1, row, column);
      (distance < 0.7 ? near_traced : far_traced) += traced.irradiance.at(1, row, column);
    }
  std::printf("light that is left: beside the block %.3f, farther %.3f\n", near_traced / near_open,
              far_traced / far_open);
  EXPECT_LT(near_traced / near_open, 0.9);
  EXPECT_GT(far_traced / far_open, near_traced / near_open + 0.05);
  EXPECT_LE(far_traced / far_open, 1.01);
}

// The stated variance of passes is that of the pictures: tiles leave the mean alone.
TEST_F(EnvironmentPicture, PassesAndTilesKeepTheMean) {
  const auto sky = WriteSky("passes");
  for (const bool glossy : {false, true}) {
    auto options = Options(Shadows::kTraced, 256);
    options.passes = 4;  // so that the variance is that of stratified samples
    const Frame one = RenderWith(Block(sky, 0, glossy), options);
    options.seed = 5;
    options.knobs.environment.tiles = 4;
    const Frame other = RenderWith(Block(sky, 0, glossy), options);
    double difference = 0, variance = 0;
    for (std::size_t k = 0; k < one.variance.data.size(); ++k) {
      if (one.coverage.data[k] == 0) continue;
      const auto luminance = [&](const Frame& frame) {
        return core::Luminance(
            {frame.radiance.plane(0)[k], frame.radiance.plane(1)[k], frame.radiance.plane(2)[k]});
      };
      difference += luminance(one) - luminance(other);
      variance += double{one.variance.data[k]} + other.variance.data[k];
    }
    std::printf("glossy %d: difference %.2f standard deviations\n", glossy,
                difference / std::sqrt(variance));
    EXPECT_LT(std::abs(difference), 4 * std::sqrt(variance));
  }
}

// Frame k of a sequence looks as the scene with that frame's file alone.
TEST_F(EnvironmentPicture, ASequenceShowsOneFrameAfterTheOther) {
  const auto folder = std::filesystem::path(testing::TempDir()) /
                      ("luxfield_sky_sequence_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  constexpr int kFrames = 3;
  const auto name = [&](int frame) { return folder / ("sky_" + std::to_string(frame) + ".exr"); };
  for (int frame = 0; frame < kFrames; ++frame) {
    core::Image image(64, 32, 3);
    for (std::size_t k = 0; k < image.data.size(); ++k)
      image.data[k] = 0.1f + static_cast<float>((k * (7 + frame)) % 32);
    core::WriteExrImage(name(frame), image);
  }
  LitScene lit(Device::Open(), Block(folder));
  EXPECT_EQ(lit.frame_count(), std::size_t{kFrames});
  const RenderOptions options = Options(Shadows::kTraced, 16);
  Renderer renderer(lit, options);
  std::vector<float> before;
  for (int frame = 0; frame < kFrames; ++frame) {
    if (frame > 0) {
      ASSERT_TRUE(lit.NextFrame());
    }
    const Frame streamed = renderer.Render(), alone = RenderWith(Block(name(frame)), options);
    EXPECT_EQ(streamed.radiance.data, alone.radiance.data) << frame;
    EXPECT_NE(streamed.radiance.data, before) << frame;
    EXPECT_EQ(streamed.provenance.at("environment file"), name(frame).filename().string());
    EXPECT_EQ(streamed.provenance.at("environment sha256"),
              alone.provenance.at("environment sha256"));
    before = streamed.radiance.data;
  }
  EXPECT_FALSE(lit.NextFrame());
  LitScene single(Device::Open(), Block(name(0)));
  EXPECT_EQ(single.frame_count(), 1u);
  EXPECT_FALSE(single.NextFrame());
  std::filesystem::remove_all(folder);
}

TEST_F(EnvironmentPicture, WrongInputIsNamed) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  scene::Scene scene = Block("nowhere.exr");
  EXPECT_THAT([&] { RenderWith(scene, {}); }, ThrowsMessage<InputError>(HasSubstr("nowhere.exr")));
  scene = Block(WriteSky("wrong"));
  auto options = Options(Shadows::kNone, 4);
  options.knobs.environment.tiles = 3;
  EXPECT_THAT([&] { RenderWith(scene, options); }, ThrowsMessage<InputError>(HasSubstr("3 tiles")));
}

}  // namespace
}  // namespace luxfield::render
