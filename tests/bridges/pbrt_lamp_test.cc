// Lamps as lights of pbrt-v4, lit as its source says: the far field's picture, projectors beside the exact
// irradiance.
#include "luxfield/bridges/pbrt_lamp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "luxfield/core/colour.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/random.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/lightfield/light_vector.h"
#include "tests/bridges/foreign.h"
#include "tests/seed.h"

namespace luxfield::bridges {
namespace {

using lightfield::Vec3;
using Lamp = std::vector<lightfield::PosedLightField>;

// Where the sphere's direction lies in the square, by Clarberg's inverse with the arc tangent itself.
std::array<double, 2> EqualAreaPlace(Vec3 d) {
  const double r = std::sqrt(1 - std::abs(d.z));
  const double phi = 2 / M_PI * std::atan2(std::abs(d.y), std::abs(d.x));
  double x = r - phi * r, y = phi * r;
  if (d.z < 0) {
    const double old = x;
    x = 1 - y, y = 1 - old;
  }
  return {std::copysign(x, d.x), std::copysign(y, d.y)};
}

TEST(PbrtLamp, PixelsAreTheIntensities) {
  const Scratch scratch("pbrt");
  const auto lamp = LampOfTwoFaces();
  const PbrtLamp written = WritePbrtLamp(scratch / "lamp.pbrt", lamp, "lamp.lf.exr");
  const core::Image picture = core::ReadExrImage(scratch / "lamp_far.exr");
  ASSERT_EQ(picture.width, picture.height);
  core::Random random(TestSeed(6), 2, 0);
  double peak = 0, flux = 0;
  for (const float i : picture.data) peak = std::max(peak, double{i}), flux += i;
  EXPECT_NEAR(flux * 4 * M_PI / double(picture.data.size()),
              core::Luminance(lightfield::TotalFlux(lamp)),
              2e-3 * core::Luminance(lightfield::TotalFlux(lamp)));
  for (int k = 0; k < 300; ++k) {
    const double z = 2 * random.Uniform() - 1, around = 2 * M_PI * random.Uniform();
    const Vec3 d{std::sqrt(1 - z * z) * std::cos(around), std::sqrt(1 - z * z) * std::sin(around),
                 z};
    // pbrt exchanges y and z of goniometric lights.
    const Vec3 in_light{d.x, d.z, d.y};
    const auto [x, y] = EqualAreaPlace(in_light);
    const Vec3 back = EqualAreaDirection(x, y);
    EXPECT_NEAR(Length(back - in_light), 0, 1e-9);
    const int column = static_cast<int>((x + 1) / 2 * picture.width),
              row = static_cast<int>((y + 1) / 2 * picture.height);
    EXPECT_NEAR(picture.data[std::size_t(row) * picture.width + column],
                formats::IntensityOf(lamp, d, {}), 0.01 * peak);
  }
  ASSERT_EQ(written.far.size(), 4u);  // 0.1 m lies within the lamp's reach
  EXPECT_LT(written.far[3].largest, 0.02);
  EXPECT_THAT(core::ReadFile(scratch / "lamp_far.pbrt"), testing::HasSubstr("\"goniometric\""));
}

// The projection lights of a scene's part as pbrt-v4 lights with them (its lights.cpp: the pictures'
// screen, y flipped, the nearest pixel).
class PbrtScene {
 public:
  explicit PbrtScene(const std::filesystem::path& path) {
    std::istringstream words(core::ReadFile(path));
    Eigen::Matrix4d world = Eigen::Matrix4d::Identity();
    for (std::string word; words >> word;) {
      if (word == "AttributeBegin") world.setIdentity();
      if (word == "ConcatTransform") {
        Eigen::Matrix4d m;
        words >> word;
        for (int k = 0; k < 16; ++k) words >> m.data()[k];  // by columns, as pbrt's file has them
        world *= m;
      }
      if (word != "\"filename\"" && word != "filename\"") continue;
      words >> word;
      const auto file = path.parent_path() / word.substr(1, word.size() - 2);
      lights_.push_back({world, core::ReadExrImage(file)});
    }
  }
  std::size_t size() const { return lights_.size(); }

  double Illuminance(Vec3 p, Vec3 n) const {
    double sum = 0;
    for (const Light& light : lights_) {
      const Eigen::Matrix4d to = light.world_from_light * Eigen::Vector4d(1, -1, 1, 1).asDiagonal();
      const Vec3 away = p - Vec3{to(0, 3), to(1, 3), to(2, 3)};
      const double r = Length(away), cosine = -Dot(away, n) / r;
      const Eigen::Vector3d w =
          to.topLeftCorner<3, 3>().inverse() * Eigen::Vector3d(away.x / r, away.y / r, away.z / r);
      if (!(w.z() >= 1e-3 && cosine > 0)) continue;
      const core::Image& picture = light.picture;
      const double aspect = double(picture.width) / picture.height,
                   half = std::tan(85 * M_PI / 180), wide = std::max(aspect, 1.0),
                   high = std::max(1 / aspect, 1.0);
      const double x = (w.x() / w.z() / half / wide + 1) / 2 * picture.width,
                   y = (w.y() / w.z() / half / high + 1) / 2 * picture.height;
      if (!(x >= 0 && x < picture.width && y >= 0 && y < picture.height)) continue;
      core::Rgb rgb{};
      for (int c = 0; c < 3; ++c) rgb[c] = picture.at(c, int(y), int(x));
      sum += core::Luminance(rgb) * cosine / (r * r);
    }
    return sum;
  }

 private:
  struct Light {
    Eigen::Matrix4d world_from_light;
    core::Image picture;
  };
  std::vector<Light> lights_;
};

// The exact irradiance but for the nearest pixel, half a texel off at most along both axes where a beam
// of 30 mm on I falls by up to 0.61 / 30 mm of its peak: sqrt(2) 1.3 % by texels of 1.25 mm, sqrt(2) 5 %
// by 5 mm. Of every basis, of fields with a pose and of three channels, off the axis, where a lamp that is
// turned or mirrored would be far off.
TEST(PbrtLamp, ProjectorsCarryTheNearField) {
  for (const lightfield::BasisKind basis :
       {lightfield::BasisKind::kBilinear, lightfield::BasisKind::kBspline2,
        lightfield::BasisKind::kQuadratic})
    for (const bool two : {false, true}) {
      if (two && basis != lightfield::BasisKind::kBspline2) continue;  // it has that basis
      const Scratch scratch("projectors");
      const Lamp lamp =
          two ? LampOfTwoFaces() : Lamp{{"", {}, formats::AsymmetricField(3, basis, 4)}};
      const PbrtLamp written = WritePbrtLamp(scratch / "lamp.pbrt", lamp, "lamp.lf.exr");
      const double nearest_pixel = std::sqrt(2.0) * (two ? 0.05 : 0.013);
      const PbrtScene scene(scratch / "lamp.pbrt");
      EXPECT_EQ(scene.size(), std::size_t(written.projectors));
      EXPECT_EQ(written.files.size(), scene.size() + 3);
      core::Random random(TestSeed(9), 2, 0);
      double largest = 0, brightest = 0;
      for (int k = 0; k < 60; ++k) {
        const Vec3 p{1.2 * random.Uniform() - 0.6, 1.2 * random.Uniform() - 0.6,
                     1 + random.Uniform()};
        const Vec3 n = Normalized(Vec3{random.Uniform() - 0.5, random.Uniform() - 0.5, -1});
        double exact = 0;
        for (const auto& posed : lamp) {
          const auto inverse = posed.luminaire_from_field.Inverse();
          exact +=
              core::Luminance(ExactIrradiance(posed.field, inverse.Point(p), inverse.Direction(n)));
        }
        largest = std::max(largest, std::abs(scene.Illuminance(p, n) - exact));
        brightest = std::max(brightest, exact);
      }
      EXPECT_LT(largest / brightest, nearest_pixel) << int(basis) << " " << two;
      ASSERT_GE(written.near.size(), 4u);
      EXPECT_LT(written.near.back().largest, nearest_pixel);  // at 10 m
      std::printf("%d %d: %.4f, at 1 m %.4f\n", int(basis), two, largest / brightest,
                  written.near[written.near.size() - 3].largest);
    }
}

// Of a box basis a cell's light is that of one image: where all of an image is below zero, its picture
// has no light, and its flux is what is stated as left out.
TEST(PbrtLamp, NegativeLightIsLeftOutAndStated) {
  const Scratch scratch("negative");
  Lamp lamp{{"", {}, formats::AsymmetricField(1, lightfield::BasisKind::kBox)}};
  for (float& c : lamp[0].field.image(1, 0)) c *= -0.5f;
  double flux = 0, negative = 0;
  for (const float c : lamp[0].field.data) flux += c, negative += std::max(0.0f, -c);
  const PbrtLamp written = WritePbrtLamp(scratch / "lamp.pbrt", lamp, "lamp.lf.exr");
  EXPECT_EQ(written.projectors, lamp[0].field.geometry.grid.count() - 1);
  EXPECT_NEAR(written.negative_share, negative / flux, 1e-5 * negative / flux);
  for (std::size_t k = 3; k < written.files.size(); ++k)
    for (const float i : core::ReadExrImage(written.files[k]).data) ASSERT_GE(i, 0);
}

}  // namespace
}  // namespace luxfield::bridges
