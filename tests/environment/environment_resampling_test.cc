// Pictures of every layout to cube maps: energy, constants, orientation.
#include "luxfield/environment/environment_resampling.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"

namespace luxfield::environment {
namespace {

using enum EnvironmentLayout;
using enum TexelRegistration;

constexpr double kPi = std::numbers::pi;
constexpr double kRounding = 0x1p-23;  // of weight and radiance to float, together

struct Case {
  EnvironmentLayout layout;
  TexelRegistration registration;
  int width, height, face_size;
};
const Case kCases[] = {{kLatitudeLongitude, kCells, 48, 24, 11},
                       {kLatitudeLongitude, kNodes, 48, 24, 16},
                       {kLatitudeLongitude, kCells, 2, 1, 4},
                       {kAngularMap, kCells, 33, 33, 9},
                       {kAngularMap, kCells, 2, 2, 1},
                       {kMirrorBall, kCells, 40, 40, 16},
                       {kMirrorBall, kCells, 1, 1, 3},
                       {kFisheyeHemisphere, kCells, 32, 32, 12},
                       {kCube, kCells, 16, 96, 16},
                       {kCube, kCells, 9, 54, 14},
                       {kCube, kNodes, 9, 54, 9}};

std::string Label(const Case& c) {
  return std::string(EnvironmentLayoutName(c.layout)) + " " + std::to_string(c.width);
}

core::Rgb PictureEnergy(const CubeResampler& resampler, const core::Image& picture) {
  core::Rgb sum{};
  for (int channel = 0; channel < 3; ++channel)
    for (std::size_t k = 0; k < picture.plane_size(); ++k)
      sum[channel] += resampler.source_solid_angles()[k] * picture.plane(channel)[k];
  return sum;
}

core::Rgb CubeEnergy(const CubeMap& cube) {
  core::Rgb energy = MeanRadiance(cube);
  for (double& value : energy) value *= 4 * kPi;
  return energy;
}

TEST(EnvironmentResampling, EveryMapKeepsItsEnergy) {
  constexpr std::uint64_t kSeed = 7;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  for (const Case& c : kCases) {
    const CubeResampler resampler(c.layout, c.registration, c.width, c.height, c.face_size);
    const auto expect_kept = [&](const core::Image& picture, const char* what) {
      const core::Rgb before = PictureEnergy(resampler, picture),
                      after = CubeEnergy(resampler(picture));
      for (std::size_t channel = 0; channel < 3; ++channel) {
        ASSERT_GT(before[channel], 0);
        EXPECT_NEAR(after[channel] / before[channel], 1, kRounding) << Label(c) << ' ' << what;
      }
    };
    core::Image constant(c.width, c.height, 3), noise(c.width, c.height, 3);
    for (float& value : constant.data) value = 0.7f;
    // Seven decades, far above what HALF holds.
    for (float& value : noise.data) value = float(std::pow(10.0, 7 * random.Uniform()));
    expect_kept(constant, "constant");
    expect_kept(noise, "random");
    // Single texels, among them those at the border.
    for (int k = 0; k < 60; ++k) {
      core::Image one(c.width, c.height, 3);
      const int row = k < 20 ? 0 : k < 40 ? c.height - 1 : int(random() % c.height);
      const int column = int(random() % c.width);
      if (resampler.source_solid_angles()[std::size_t(row) * c.width + column] < 1e-14) continue;
      for (int channel = 0; channel < 3; ++channel) one.at(channel, row, column) = 2e5f;
      expect_kept(one, "one texel");
    }
  }
}

TEST(EnvironmentResampling, AConstantStaysConstant) {
  for (const Case& c : kCases) {
    const CubeResampler resampler(c.layout, c.registration, c.width, c.height, c.face_size);
    core::Image constant(c.width, c.height, 1);
    for (float& value : constant.data) value = 1e6f;
    const CubeMap cube = resampler(constant);
    // Cubes have straight edges. Elsewhere the outlines' tolerance of 1e-6 shows at most where a
    // mirror ball's rim squeezes texels to needles.
    EXPECT_LT(resampler.partition_error(), c.layout == kCube         ? 1e-12
                                           : c.layout == kMirrorBall ? 5e-4
                                                                     : 1e-4)
        << Label(c);
    for (int face = 0; face < 6; ++face)
      for (int row = 0; row < c.face_size; ++row) {
        // A fisheye is black below the horizon, which halves the middle row of an odd face.
        const bool above = face == 4 || (face < 4 && 2 * (row + 1) <= c.face_size);
        const bool below = face == 5 || (face < 4 && 2 * row >= c.face_size);
        if (c.layout == kFisheyeHemisphere && !above && !below) continue;
        const double expected = c.layout == kFisheyeHemisphere && below ? 0 : 1e6;
        for (int column = 0; column < c.face_size; ++column)
          EXPECT_NEAR(cube.at(face, row, column, 2), expected,
                      1e6 * (resampler.partition_error() + kRounding + 1e-12))
              << Label(c) << ' ' << face << ' ' << row << ' ' << column;
      }
  }
}

TEST(EnvironmentResampling, ACubeOfTheSameSizeIsItselfFaceByFace) {
  core::Random random(8, 0);
  core::Image strip(5, 30, 3);
  for (float& value : strip.data) value = float(1e5 * random.Uniform());
  const CubeMap cube = CubeResampler(kCube, kCells, 5, 30, 5)(strip);
  const int faces[] = {0, 1, 4, 5, 3, 2};  // +X, -X, +Y, -Y, +Z, -Z of OpenEXR in the world
  for (int k = 0; k < 6; ++k)
    for (int row = 0; row < 5; ++row)
      for (int column = 0; column < 5; ++column)
        for (int channel = 0; channel < 3; ++channel)
          EXPECT_NEAR(cube.at(faces[k], row, column, channel),
                      strip.at(channel, 5 * k + row, column), 1e5 * kRounding);
}

// A sky without any symmetry, its gradient below 3.
double Sky(lightfield::Vec3 w) { return 2 + w.x + 0.5 * w.y * w.z + 0.7 * std::sin(2 * w.z + w.y); }

core::Image Photograph(const Case& c, const std::function<double(lightfield::Vec3)>& sky) {
  core::Image picture(c.width, c.height, 1);
  const TexelEdges edges = MakeTexelEdges(c.layout, c.registration, c.width, c.height);
  for (int row = 0; row < c.height; ++row)
    for (int column = 0; column < c.width; ++column) {
      const auto w = DirectionFromPicture(c.layout, {0.5 * (edges.x[column] + edges.x[column + 1]),
                                                     0.5 * (edges.y[row] + edges.y[row + 1])});
      if (w) picture.at(0, row, column) = float(sky(w->direction));
    }
  return picture;
}

// Largest error over cube texels whose centres a photograph shows, against the sky itself.
double WorstError(const CubeMap& cube, const std::function<double(lightfield::Vec3)>& sky,
                  bool hemisphere) {
  double worst = 0;
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < cube.face_size; ++row)
      for (int column = 0; column < cube.face_size; ++column) {
        const lightfield::Vec3 w =
            lightfield::Normalized(CubeVector({face, -1 + 2 * (column + 0.5) / cube.face_size,
                                               1 - 2 * (row + 0.5) / cube.face_size}));
        if (hemisphere && w.z < 0.15) continue;
        worst = std::max(worst, std::abs(cube.at(face, row, column, 0) - sky(w)));
      }
  return worst;
}

TEST(EnvironmentResampling, EveryLayoutShowsTheSameSky) {
  const Case cases[] = {{kLatitudeLongitude, kCells, 128, 64, 32},
                        {kLatitudeLongitude, kNodes, 128, 64, 32},
                        {kAngularMap, kCells, 128, 128, 32},
                        {kMirrorBall, kCells, 256, 256, 32},
                        {kFisheyeHemisphere, kCells, 96, 96, 32},
                        {kCube, kCells, 32, 192, 32},
                        {kCube, kNodes, 33, 198, 32}};
  for (const Case& c : cases) {
    const CubeMap cube =
        CubeResampler(c.layout, c.registration, c.width, c.height, c.face_size)(Photograph(c, Sky));
    const bool hemisphere = c.layout == kFisheyeHemisphere;
    // Half the diagonal of a picture texel (0.05 rad) and of a cube texel (0.04 rad) times the
    // gradient; a ball's rim texels reach 0.25 rad from straight ahead.
    const double bound = 3 * (0.09 + (c.layout == kMirrorBall ? 0.25 : 0));
    EXPECT_LT(WorstError(cube, Sky, hemisphere), bound) << Label(c);
    // Mirrored, turned or upside down it is another sky.
    for (const auto& other :
         {std::function<lightfield::Vec3(lightfield::Vec3)>([](lightfield::Vec3 w) {
            return lightfield::Vec3{-w.x, w.y, w.z};
          }),
          std::function<lightfield::Vec3(lightfield::Vec3)>([](lightfield::Vec3 w) {
            return lightfield::Vec3{w.y, -w.x, w.z};
          }),
          std::function<lightfield::Vec3(lightfield::Vec3)>([](lightfield::Vec3 w) {
            return lightfield::Vec3{w.x, -w.y, -w.z};
          })})
      EXPECT_GT(WorstError(
                    cube, [&](lightfield::Vec3 w) { return Sky(other(w)); }, hemisphere),
                1.5 * bound)
          << Label(c);
  }
}

TEST(EnvironmentResampling, SizesThatFitNothingAreRefused) {
  const auto refusal = [](EnvironmentLayout layout, int width, int height,
                          int face_size) -> std::string {
    try {
      CubeResampler(layout, kCells, width, height, face_size);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal(kCube, 4, 16, 4), testing::HasSubstr("6 N high"));
  EXPECT_THAT(refusal(kMirrorBall, 4, 5, 4), testing::HasSubstr("square"));
  EXPECT_THAT(refusal(kLatitudeLongitude, 0, 5, 4), testing::HasSubstr("0 x 5"));
  EXPECT_THAT(refusal(kLatitudeLongitude, 4, 2, 0), testing::HasSubstr("face size 0"));
  EXPECT_THAT(refusal(kLatitudeLongitude, 4, 2, 20000), testing::HasSubstr("20000"));
  const CubeResampler resampler(kLatitudeLongitude, kCells, 4, 2, 2);
  EXPECT_THROW(resampler(core::Image(4, 3, 3)), InputError);
  EXPECT_THROW(resampler(core::Image(4, 2, 2)), InputError);
}

}  // namespace
}  // namespace luxfield::environment
