// Rays and pictures of light fields, checked as files: what is right holds within its stated error,
// what is mirrored, moved or scaled does not.
#include "luxfield/formats/export_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/ray_formats.h"
#include "tests/formats/light_field_lamps.h"
#include "tests/seed.h"

namespace luxfield::formats {
namespace {

using lightfield::PosedLightField;
using lightfield::Vec3;

constexpr std::uint64_t kRays = 150000;

std::filesystem::path Folder() {
  const auto folder = std::filesystem::path(testing::TempDir()) / "export_check";
  std::filesystem::create_directories(folder);
  return folder;
}

// Rays of density E: function and texel by their coefficient, the sum of three uniforms on F, a
// uniform on I.
std::vector<Ray> RaysOf(const std::vector<PosedLightField>& lamp, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::vector<double> weights;
  for (const auto& posed : lamp)
    weights.insert(weights.end(), posed.field.data.begin(), posed.field.data.end());
  std::discrete_distribution<std::size_t> draw(weights.begin(), weights.end());
  const double flux = lightfield::TotalFlux(lamp)[0] / double(kRays);
  std::vector<Ray> rays;
  for (std::uint64_t n = 0; n < kRays; ++n) {
    std::size_t at = draw(random), k = 0;
    for (; at >= lamp[k].field.data.size(); ++k) at -= lamp[k].field.data.size();
    const auto& g = lamp[k].field.geometry;
    const std::size_t m = at / g.plane_size(), texel = at % g.plane_size();
    const auto sum = [&] { return uniform(random) + uniform(random) + uniform(random); };
    const double u =
        g.grid.u0_m + (double(m % std::size_t(g.grid.width)) + sum()) * g.grid.spacing_m;
    const double v =
        g.grid.v0_m + (double(m / std::size_t(g.grid.width)) + sum()) * g.grid.spacing_m;
    const double s =
        g.lattice.s_of_column(double(texel % std::size_t(g.lattice.width)) + uniform(random));
    const double t =
        g.lattice.t_of_row(double(texel / std::size_t(g.lattice.width)) + uniform(random));
    const auto& pose = lamp[k].luminaire_from_field;
    rays.push_back({pose.Point({u, v, 0}),
                    pose.Direction(lightfield::Normalized(Vec3{s - u, t - v, g.delta_m})),
                    flux,
                    {}});
  }
  return rays;
}

ExportCheck Checked(const std::vector<PosedLightField>& lamp, const std::vector<Ray>& rays,
                    RayFormat format, const char* name) {
  const auto path = Folder() / name;
  RayFileHeader header;
  header.ray_count = rays.size();
  header.luminous_flux_lm = rays.front().flux * double(rays.size());
  std::size_t at = 0;
  WriteRays(path, format, header, true, false, [&](Ray& ray) {
    if (at == rays.size()) return false;
    ray = rays[at++];
    return true;
  });
  return CheckRays(path, lamp, 0);
}

void ExpectCounting(const ExportCheck& check) {
  EXPECT_TRUE(check.holds()) << check.max_rel_error << " " << check.stated_error;
  EXPECT_GT(check.mc_sigma, 0.005);
  EXPECT_LT(check.stated_error, 0.15);
  // Chi-squared of n degrees of freedom has the variance 2 n.
  EXPECT_GT(check.degrees, 60);
  EXPECT_LT(std::abs(check.chi_squared - check.degrees), 5 * std::sqrt(2.0 * check.degrees));
}

TEST(ExportCheck, RaysOfTheLightFieldPassInEveryFormat) {
  const auto seed = TestSeed(31);
  const auto lamp = AsymmetricLamp();
  const auto rays = RaysOf(lamp, seed);
  for (const auto& [format, name] :
       {std::pair{RayFormat::kTm25, "x.tm25ray"}, std::pair{RayFormat::kZemax, "x.dat"},
        std::pair{RayFormat::kLightTools, "x.ltrf"}, std::pair{RayFormat::kSpeos, "x.speos.ray"}}) {
    SCOPED_TRACE(name);
    ExpectCounting(Checked(lamp, rays, format, name));
  }
  // Narrower in v: little light in the widest zone, at its edge.
  auto narrow = LuminanceOf(AsymmetricLamp(3));
  ExpectCounting(Checked(narrow, RaysOf(narrow, seed), RayFormat::kTm25, "narrow.tm25ray"));
  const auto both = LampOfTwoSides();
  ExpectCounting(Checked(both, RaysOf(both, seed), RayFormat::kTm25, "two.tm25ray"));
}

TEST(ExportCheck, WrongRaysAreFound) {
  const auto lamp = AsymmetricLamp();
  const auto rays = RaysOf(lamp, TestSeed(32));
  const auto holds = [&](const std::function<void(Ray&)>& spoil) {
    auto spoilt = rays;
    for (Ray& ray : spoilt) spoil(ray);
    return Checked(lamp, spoilt, RayFormat::kTm25, "spoilt.tm25ray").holds();
  };
  EXPECT_TRUE(holds([](Ray&) {}));
  EXPECT_FALSE(holds([](Ray& ray) { ray.flux *= 1.2; }));
  EXPECT_FALSE(holds([](Ray& ray) { ray.position_m.x += 0.01; }));
  EXPECT_FALSE(holds([](Ray& ray) { ray.direction.y = -ray.direction.y; }));
  // The brighter half of F changed with the darker one: the far field is the same.
  EXPECT_FALSE(holds([](Ray& ray) {
    ray.position_m.x = -ray.position_m.x;
    ray.position_m.y = -ray.position_m.y;
  }));
}

TEST(ExportCheck, TooFewRaysAreRefused) {
  const auto lamp = AsymmetricLamp();
  auto rays = RaysOf(lamp, 1);
  rays.resize(100);
  try {
    Checked(lamp, rays, RayFormat::kTm25, "few.tm25ray");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("has 100 rays, too few for --check"));
  }
}

// What --check is for: a file that is turned, mirrored or scaled is found out.
TEST(ExportCheck, WrongIntensitiesAreFound) {
  const auto lamp = AsymmetricLamp();
  const FarField found = SampleFarField(lamp, {}, {}, "x");
  const auto path = Folder() / "x.ies";
  const auto seed = TestSeed(8);
  const auto checks = [&](const Photometry& table) {
    core::WriteFileAtomically(path, FormatLm63(table, Lm63Version::k2002, "x.ies"));
    return std::pair{CheckIntensities(path, found, lamp, {}).holds(),
                     CheckInterpolation(path, found, lamp, {}, seed).holds()};
  };
  EXPECT_EQ(checks(found.table), std::pair(true, true));
  Photometry turned = found.table;
  for (double& plane : turned.planes_deg) plane = std::fmod(plane + 90, 360);
  ClosePlanes(turned);
  EXPECT_EQ(checks(turned), std::pair(false, false));
  Photometry scaled = found.table;
  for (double& cd : scaled.intensity_cd) cd *= 1.02;
  EXPECT_EQ(checks(scaled), std::pair(false, false));
}

// A peak in one direction of the table, dark around it: the cells about it are lit at one corner.
TEST(ExportCheck, CellsThatAreLitAtOneCornerAreLookedInto) {
  FarField one;
  one.table.planes_deg = {0, 90, 180, 270};
  one.table.angles_deg = {0, 20, 40, 60, 90};
  one.table.intensity_cd.assign(20, 0);
  one.table.intensity_cd[1 * 5 + 2] = 5e3;
  const auto path = Folder() / "one.ies";
  core::WriteFileAtomically(path, FormatLm63(one.table, Lm63Version::k2002, "one.ies"));
  const ExportCheck check = CheckInterpolation(path, one, AsymmetricLamp(), {}, TestSeed(9));
  EXPECT_EQ(check.receivers, 500);
  EXPECT_GT(check.max_rel_error, 0.5);  // next to the peak
  EXPECT_FALSE(check.holds());
}

Eye EyeAt(Vec3 position, Eye::Projection projection) {
  Eye eye;
  eye.projection = projection;
  eye.position_m = position;
  eye.width = 90;
  eye.height = 60;
  return eye;
}

// Every projection's pixels sum to the exact irradiance at the eye, and their solid angles to that of
// the picture.
TEST(ExportCheck, PicturesSumToTheIrradianceAtTheEye) {
  const auto seed = TestSeed(33);
  using enum Eye::Projection;
  for (const auto& lamp : {AsymmetricLamp(), AsymmetricLamp(3), LampOfTwoSides()})
    for (const auto projection : {kPerspective, kFisheye, kEquirectangular}) {
      Eye eye = EyeAt({0.06, -0.03, 0.25}, projection);
      eye.fov_deg = projection == kFisheye ? 100 : FovOfWholeLamp(eye, lamp);
      const LampPicture picture = DrawLamp(lamp, eye, 6, seed);
      const auto path = Folder() / "x.exr";
      core::WriteExrImage(path, picture.image);
      const auto check = CheckLampPicture(core::ReadExrImage(path), eye, picture.irradiance_sigma,
                                          lamp, 1e-6, "x");
      EXPECT_TRUE(check.holds()) << check.max_rel_error << " " << check.stated_error;
      EXPECT_LT(check.stated_error, 0.1);
      core::Image brighter = picture.image;
      for (float& value : brighter.data) value *= 1.2f;
      EXPECT_FALSE(
          CheckLampPicture(brighter, eye, picture.irradiance_sigma, lamp, 1e-6, "x").holds());
    }
}

TEST(ExportCheck, SolidAnglesSumToThatOfThePicture) {
  using enum Eye::Projection;
  const auto sum = [](const Eye& eye) {
    double total = 0;
    for (int row = 0; row < eye.height; ++row)
      for (int column = 0; column < eye.width; ++column)
        if (const auto ray = RayOf(eye, column + 0.5, row + 0.5)) {
          EXPECT_NEAR(lightfield::Length(ray->direction), 1, 1e-12);
          total += ray->solid_angle;
        }
    return total;
  };
  Eye perspective = EyeAt({0.2, 0.1, 1}, kPerspective);
  perspective.fov_deg = 60;
  const double b = std::tan(std::numbers::pi / 6),
               a = 1.5 * b;  // of a pyramid: 4 asin(sin a' sin b')
  EXPECT_NEAR(sum(perspective), 4 * std::asin(a * b / std::sqrt((1 + a * a) * (1 + b * b))), 1e-3);
  EXPECT_NEAR(sum(EyeAt({0.2, 0.1, 1}, kEquirectangular)), 4 * std::numbers::pi, 1e-2);
  Eye fisheye = EyeAt({0.2, 0.1, 1}, kFisheye);
  fisheye.fov_deg = 180;
  fisheye.width = fisheye.height = 400;  // the circle's edge crosses pixels
  EXPECT_NEAR(sum(fisheye), 2 * std::numbers::pi, 1e-2);
}

// u points right and v up for an eye before the lamp; a pixel shows the radiance of its ray.
TEST(ExportCheck, PicturesAreTheRightWayRound) {
  using enum Eye::Projection;
  auto lamp = AsymmetricLamp();
  auto& field = lamp[0].field;
  for (int m = 0; m < field.geometry.grid.count(); ++m)  // the function at +u, +v alone, evenly
    for (float& c : field.image(m, 0)) c = m == field.geometry.grid.index(3, 2) ? 1e8f : 0.0f;
  const auto centre = field.geometry.grid.centre(3, 2);
  for (const auto projection : {kPerspective, kFisheye, kEquirectangular}) {
    Eye eye = EyeAt({0, 0, 0.4}, projection);
    eye.width = eye.height = 256;
    eye.fov_deg = 40;
    const auto picture = DrawLamp(lamp, eye, 2, 1).image;
    double x = 0, y = 0, sum = 0;
    for (int row = 0; row < eye.height; ++row)
      for (int column = 0; column < eye.width; ++column) {
        const double value = picture.at(0, row, column);
        x += value * (column + 0.5), y += value * (row + 0.5), sum += value;
      }
    const auto ray = RayOf(eye, x / sum, y / sum);
    ASSERT_TRUE(ray);
    // Where the picture's middle of light meets F: about the function's middle.
    const double way = -0.4 / ray->direction.z;
    EXPECT_NEAR(way * ray->direction.x, centre.x, 0.002);
    EXPECT_NEAR(way * ray->direction.y, centre.y, 0.002);
    EXPECT_GT(x / sum, 128);
    EXPECT_LT(y / sum, 128);
  }
}

TEST(ExportCheck, IrradianceOnAPlane) {
  for (const auto& lamp : {AsymmetricLamp(), LampOfTwoSides()}) {
    Eye eye = EyeAt({0.1, -0.05, 0.5}, Eye::Projection::kPerspective);
    const auto image = DrawIrradiance(lamp, eye, 0.6, 0.4);
    const auto seed = TestSeed(34);
    const auto check = CheckIrradiance(image, eye, 0.6, 0.4, lamp, 1e-6, seed);
    EXPECT_TRUE(check.holds()) << check.max_rel_error << " " << check.stated_error;
    EXPECT_LT(check.stated_error, 0.02);
    core::Image mirrored = image;
    for (int row = 0; row < eye.height; ++row)
      for (int column = 0; column < eye.width; ++column)
        mirrored.at(0, row, column) = image.at(0, row, eye.width - 1 - column);
    EXPECT_FALSE(CheckIrradiance(mirrored, eye, 0.6, 0.4, lamp, 1e-6, seed).holds());
  }
}

TEST(ExportCheck, EyesThatSeeNothingAreRefused) {
  Eye eye = EyeAt({0, 0, 1}, Eye::Projection::kPerspective);
  eye.up = {0, 0, 2};
  EXPECT_THROW(eye.Validate(), InputError);
  eye.up = {0, 1, 0};
  eye.look_at_m = eye.position_m;
  EXPECT_THROW(eye.Validate(), InputError);
  eye.look_at_m = {0, 0, 2};
  EXPECT_THROW(FovOfWholeLamp(eye, AsymmetricLamp()), InputError);
  EXPECT_FALSE(ShowsWholeLamp(eye, AsymmetricLamp()));
}

}  // namespace
}  // namespace luxfield::formats
