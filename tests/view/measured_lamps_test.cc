// How well lamps are measured that light a point, by a formula of two numbers.
#include "luxfield/view/lighting/measured_lamps.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "luxfield/core/error.h"
#include "tests/e2e/program.h"
#include "tests/e2e/tiny_session.h"
#include "tests/render/small_scene.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using lightfield::Vec3;

class MeasuredLampsTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = e2e::FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
    scene_ = render::LampOverFloor(false);
    scene_.luminaires[0].light_field = folder_ / "lamp.lf.exr";
    lightfield::WriteLightField(folder_ / "lamp.lf.exr", render::SoftLamp());
  }
  void TearDown() override { fs::remove_all(folder_); }

  // sigma(C) is a share of C, independent: of a sum of n equal terms the share over sqrt(n).
  void WriteSigma(float share) const {
    lightfield::LightField sigma = render::SoftLamp();
    for (float& value : sigma.data) value *= share;
    sigma.provenance["solve"] = "none";
    lightfield::WriteLightField(folder_ / "lamp.sigma.lf.exr", sigma);
  }
  std::vector<scene::PlacedLamp> Lamps() const {
    std::vector<scene::PlacedLamp> lamps;
    for (const auto& luminaire : scene_.luminaires)
      lamps.push_back({luminaire.world_from_luminaire, luminaire.scale});
    return lamps;
  }

  fs::path folder_;
  scene::Scene scene_;
  const Vec3 point_{0, 3, 0}, up_{0, 0, 1};
};

TEST_F(MeasuredLampsTest, FollowTheNoiseAndTheLampsThatLight) {
  EXPECT_FALSE(MeasuredLamps(scene_).RelativeSigma(point_, up_, Lamps()));
  WriteSigma(0.1f);
  const auto once = MeasuredLamps(scene_).RelativeSigma(point_, up_, Lamps());
  ASSERT_TRUE(once);
  EXPECT_GT(*once, 0.1 / 100);  // some thousand texels light the point
  EXPECT_LT(*once, 0.1 / 5);
  WriteSigma(0.2f);
  EXPECT_NEAR(*MeasuredLamps(scene_).RelativeSigma(point_, up_, Lamps()), 2 * *once, 1e-6 * *once);
  // The same file twice has its noise twice, too; switched off, a lamp has none.
  scene_.luminaires.push_back(scene_.luminaires[0]);
  const MeasuredLamps two(scene_);
  auto lamps = Lamps();
  EXPECT_NEAR(*two.RelativeSigma(point_, up_, lamps), 2 * *once, 1e-6 * *once);
  lamps[1].scale = 0;
  EXPECT_NEAR(*two.RelativeSigma(point_, up_, lamps), 2 * *once, 1e-6 * *once);
  // A colour changes what is known, factors that are alike do not.
  lamps[1].scale = 1;
  lamps[0].colour = lamps[1].colour = {2, 2, 2};
  EXPECT_NEAR(*two.RelativeSigma(point_, up_, lamps), 2 * *once, 1e-6 * *once);
  lamps[1].colour = {2, 2, 1};
  EXPECT_FALSE(two.RelativeSigma(point_, up_, lamps));
  lamps[1].colour = {0, 0, 0};  // switched off as well
  EXPECT_NEAR(*two.RelativeSigma(point_, up_, lamps), 2 * *once, 1e-6 * *once);
  // Behind all lamps nothing arrives.
  EXPECT_FALSE(two.RelativeSigma({0, -3, 0}, up_, lamps));
}

TEST_F(MeasuredLampsTest, OtherLightsLeaveItUnknown) {
  WriteSigma(0.1f);
  scene_.area_lights.emplace_back();
  EXPECT_FALSE(MeasuredLamps(scene_).RelativeSigma(point_, up_, Lamps()));
  scene_.area_lights.clear();
  scene_.classical_lights.emplace_back();
  EXPECT_FALSE(MeasuredLamps(scene_).RelativeSigma(point_, up_, Lamps()));
  scene_.classical_lights.clear();
  lightfield::LightField wrong = render::SoftLamp();
  wrong.geometry.delta_m *= 2;
  lightfield::WriteLightField(folder_ / "lamp.sigma.lf.exr", wrong);
  EXPECT_THROW(MeasuredLamps{scene_}, InputError);
}

}  // namespace
}  // namespace luxfield::view
