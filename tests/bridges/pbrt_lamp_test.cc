// Lamps as lights of pbrt-v4, lit as its source says and by pbrt itself: the far field's picture, projectors
// beside the exact irradiance.
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
  const core::Image picture = core::ReadExrImage(scratch / "lamp.pbrt.far.exr");
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
  EXPECT_THAT(core::ReadFile(scratch / "lamp.pbrt.far.pbrt"),
              testing::HasSubstr("\"goniometric\""));
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

  core::Rgb Illuminance(Vec3 p, Vec3 n) const {
    core::Rgb sum{};
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
      for (int c = 0; c < 3; ++c) sum[c] += picture.at(c, int(y), int(x)) * cosine / (r * r);
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
        largest = std::max(largest, std::abs(core::Luminance(scene.Illuminance(p, n)) - exact));
        brightest = std::max(brightest, exact);
      }
      EXPECT_LT(largest / brightest, nearest_pixel) << int(basis) << " " << two;
      ASSERT_GE(written.near.size(), 4u);
      EXPECT_LT(written.near.back().largest, nearest_pixel);  // at 10 m
      std::printf("%d %d: %.4f, at 1 m %.4f\n", int(basis), two, largest / brightest,
                  written.near[written.near.size() - 3].largest);
    }
}

// pbrt itself, of a part of a scene moved by `place`: the picture of a white plane 1.5 m before the lamp,
// pi times its radiance, from a camera behind the lamp, whose columns run towards -x.
constexpr int kColumns = 36, kRows = 24;
constexpr double kPlane = 1.5, kEye = -1, kHalfHeight = 0.5;

Vec3 PlaceOfPixel(int row, int column) {
  const double size = 2 * kHalfHeight * (kPlane - kEye) / kRows;
  return {(kColumns / 2.0 - column - 0.5) * size, (kRows / 2.0 - row - 0.5) * size, kPlane};
}

core::Image PlaneByPbrt(const std::filesystem::path& part, Vec3 place, int samples) {
  std::ostringstream scene;
  scene << "Scale -1 1 1\nLookAt 0 0 " << kEye
        << " 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" "
        << 360 / M_PI * std::atan(kHalfHeight) << "\nFilm \"rgb\" \"integer xresolution\" "
        << kColumns << " \"integer yresolution\" " << kRows
        << "\nPixelFilter \"box\" \"float xradius\" 0.005"
        << " \"float yradius\" 0.005\nSampler \"zsobol\" \"integer pixelsamples\" " << samples
        << "\nIntegrator \"path\" \"integer maxdepth\" 1 \"string lightsampler\" "
           "\"power\"\nWorldBegin\n"
        << "AttributeBegin\nTranslate " << place.x << " " << place.y << " " << place.z
        << "\nInclude " << part.filename()
        << "\nAttributeEnd\nMaterial \"diffuse\" \"rgb reflectance\" [ 1 1 1 ]\n"
        << "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -9 -9 "
        << kPlane << " 9 -9 " << kPlane << " 9 9 " << kPlane << " -9 9 " << kPlane << " ]\n";
  core::WriteFileAtomically(part.parent_path() / "scene.pbrt", scene.str());
  const std::string said =
      OutputOf("cd '" + part.parent_path().string() + "' && '" + ForeignProgram("pbrt") +
               "' --quiet --outfile plane.exr scene.pbrt 2>&1");
  EXPECT_EQ(said, "");
  core::Image picture = core::ReadExrImage(part.parent_path() / "plane.exr");
  for (float& value : picture.data) value *= static_cast<float>(M_PI);
  return picture;
}

// Each channel's largest difference over the brightest pixel, and that of the means.
void ExpectAgrees(const core::Image& picture, const std::vector<core::Rgb>& truth, double most,
                  double mean) {
  for (int channel = 0; channel < 3; ++channel) {
    double largest = 0, brightest = 0, sum = 0, true_sum = 0;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const double value = picture.plane(channel)[k];
      largest = std::max(largest, std::abs(value - truth[k][channel]));
      brightest = std::max(brightest, truth[k][channel]);
      sum += value, true_sum += truth[k][channel];
    }
    std::printf("channel %d: largest %.4f, means %.5f\n", channel, largest / brightest,
                sum / true_sum - 1);
    EXPECT_LT(largest, most * brightest) << channel;
    EXPECT_NEAR(sum, true_sum, mean * true_sum) << channel;
  }
}

// The projectors light in pbrt as in the model of it above, and the goniometric light as the far field
// does at the nearest pixel: half a pixel of 0.2 degrees at most where a beam of 6 degrees falls by up to
// 0.61 / 6 of its peak a degree, 1.0 %. Both are moved aside. pbrt draws wavelengths: 1024 samples
// leave up to 0.8 % in blue.
TEST(PbrtLamp, PbrtItselfLights) {
  LUXFIELD_NEEDS_FOREIGN("pbrt");
  const Vec3 place{0.2, -0.1, 0.1};
  for (const int channels : {1, 3}) {
    const Scratch scratch("itself");
    const Lamp lamp{{"", {}, formats::AsymmetricField(channels)}};
    WritePbrtLamp(scratch / "lamp.pbrt", lamp, "lamp.lf.exr");
    const PbrtScene scene(scratch / "lamp.pbrt");
    const auto luminance = formats::LuminanceOf(lamp);
    const auto flux = lightfield::TotalFlux(lamp);
    std::vector<core::Rgb> near, far;
    for (int row = 0; row < kRows; ++row)
      for (int column = 0; column < kColumns; ++column) {
        const Vec3 p = PlaceOfPixel(row, column) - place;
        near.push_back(scene.Illuminance(p, {0, 0, -1}));
        const double r = Length(p), y = formats::IntensityOf(luminance, p, {}) * p.z / (r * r * r);
        far.emplace_back();
        for (int c = 0; c < 3; ++c) far.back()[c] = y * flux[c] / core::Luminance(flux);
      }
    ExpectAgrees(PlaneByPbrt(scratch / "lamp.pbrt", place, 1024), near, 0.02, 0.004);
    ExpectAgrees(PlaneByPbrt(scratch / "lamp.pbrt.far.pbrt", place, 1024), far, 0.02, 0.004);
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
