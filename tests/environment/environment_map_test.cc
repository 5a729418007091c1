// Environment maps from files: which layout a file has, what is refused, and other authors' maps.
#include "luxfield/environment/environment_map.h"

#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/random.h"
#include "luxfield/environment/environment_compare.h"
#include "luxfield/environment/environment_resampling.h"
#include "tests/lightfield/support.h"
#include "tests/test_data.h"

namespace luxfield::environment {
namespace {

using testing::HasSubstr;
using enum EnvironmentLayout;

constexpr double kPi = std::numbers::pi;

std::filesystem::path WritePicture(int width, int height, float value = 1) {
  core::Image image(width, height, 3);
  for (float& v : image.data) v = value;
  const auto path = lightfield::UniquePath(".exr");
  core::WriteExrImage(path, image);
  return path;
}

std::filesystem::path WriteTagged(int width, int height, Imf::Envmap envmap) {
  Imf::Header header(width, height);
  Imf::addEnvmap(header, envmap);
  const auto path = lightfield::UniquePath(".exr");
  const std::vector<Imf::Rgba> pixels(std::size_t(width) * height, Imf::Rgba(1, 2, 3));
  Imf::RgbaOutputFile file(path.c_str(), header, Imf::WRITE_RGB);
  file.setFrameBuffer(pixels.data(), 1, width);
  file.writePixels(height);
  return path;
}

std::string Refusal(const std::filesystem::path& path,
                    std::optional<EnvironmentLayout> named = {}) {
  try {
    ReadEnvironmentPicture(path, named);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    return error.what();
  }
  return "accepted";
}

TEST(EnvironmentMap, AttributeThenNameThenShapeTellTheLayout) {
  const auto tagged = ReadEnvironmentPicture(WriteTagged(8, 4, Imf::ENVMAP_LATLONG));
  EXPECT_EQ(tagged.layout, kLatitudeLongitude);
  EXPECT_EQ(tagged.registration, TexelRegistration::kNodes);
  EXPECT_EQ(tagged.image.at(2, 3, 7), 3);
  EXPECT_EQ(ReadEnvironmentPicture(WriteTagged(2, 12, Imf::ENVMAP_CUBE)).layout, kCube);
  // The attribute holds for a shape that would tell another layout.
  EXPECT_EQ(ReadEnvironmentPicture(WriteTagged(6, 6, Imf::ENVMAP_LATLONG)).layout,
            kLatitudeLongitude);

  const auto wide = ReadEnvironmentPicture(WritePicture(8, 4));
  EXPECT_EQ(wide.layout, kLatitudeLongitude);
  EXPECT_EQ(wide.registration, TexelRegistration::kCells);
  EXPECT_EQ(ReadEnvironmentPicture(WritePicture(2, 12)).layout, kCube);
  for (const auto layout : {kAngularMap, kMirrorBall, kFisheyeHemisphere, kLatitudeLongitude})
    EXPECT_EQ(ReadEnvironmentPicture(WritePicture(5, 5), layout).layout, layout);
}

TEST(EnvironmentMap, WhatTellsNoLayoutIsRefusedWithTheOption) {
  const auto square = Refusal(WritePicture(5, 5));
  EXPECT_THAT(square, HasSubstr("5 x 5"));
  EXPECT_THAT(square, HasSubstr("--layout"));
  EXPECT_THAT(square, HasSubstr("mirror-ball"));
  EXPECT_THAT(Refusal(WritePicture(6, 5), kMirrorBall), HasSubstr("6 x 5"));
  EXPECT_THAT(Refusal(WritePicture(8, 4), kCube), HasSubstr("six squares"));
  EXPECT_THAT(Refusal(WriteTagged(8, 4, Imf::ENVMAP_LATLONG), kCube), HasSubstr("envmap"));
  EXPECT_THAT(Refusal(WriteTagged(8, 4, Imf::ENVMAP_CUBE)), HasSubstr("8 x 4"));
  EXPECT_EQ(Refusal(WriteTagged(8, 4, Imf::ENVMAP_LATLONG), kLatitudeLongitude), "accepted");
  EXPECT_NE(Refusal("/nonexistent/sky.hdr"), "accepted");
  const auto text = lightfield::UniquePath(".hdr");
  std::ofstream(text) << "not a picture\n";
  EXPECT_THAT(Refusal(text), HasSubstr("OpenEXR"));
}

TEST(EnvironmentMap, RadianceMustBeFiniteAndNotNegativeWhereItShows) {
  for (const float bad : {NAN, INFINITY, -1e-3f}) {
    core::Image image(8, 8, 3);
    image.at(1, 3, 2) = bad;
    const auto inside = lightfield::UniquePath(".exr");
    core::WriteExrImage(inside, image);
    EXPECT_THAT(Refusal(inside, kMirrorBall), HasSubstr("row 3, column 2 of channel G"));
    image.at(1, 3, 2) = 1;
    image.at(0, 0, 7) = bad;
    const auto outside = lightfield::UniquePath(".exr");
    core::WriteExrImage(outside, image);
    EXPECT_EQ(Refusal(outside, kMirrorBall), "accepted");
    const CubeMap cube = MakeCubeMap(ReadEnvironmentPicture(outside, kMirrorBall), 4);
    for (const float value : cube.data) EXPECT_TRUE(std::isfinite(value));
    EXPECT_THAT(Refusal(outside, kLatitudeLongitude), HasSubstr("row 0, column 7 of channel R"));
  }
}

TEST(EnvironmentMap, ValuesAboveTheRangeOfHalfSurvive) {
  const CubeMap cube = MakeCubeMap(ReadEnvironmentPicture(WritePicture(16, 8, 3e7f)));
  for (const float value : cube.data) EXPECT_NEAR(value, 3e7, 3e7 * 1e-5);
  const auto hdr = lightfield::UniquePath(".hdr");
  std::string bytes = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n";
  for (int k = 0; k < 32; ++k) bytes += std::string("\x80\x80\x80\xa0", 4);  // (128.5 / 256) 2^32
  std::ofstream(hdr, std::ios::binary) << bytes;
  const auto picture = ReadEnvironmentPicture(hdr);
  EXPECT_EQ(picture.image.at(0, 0, 0), 128.5f * 16777216);
  EXPECT_NEAR(MeanRadiance(MakeCubeMap(picture))[1] / (128.5 * 16777216), 1, 1e-6);
}

std::filesystem::path WriteWithChromaticities(const Imf::Chromaticities& chromaticities,
                                              const Imf::Rgba& pixel,
                                              Imf::RgbaChannels channels = Imf::WRITE_RGB) {
  Imf::Header header(4, 2);
  Imf::addChromaticities(header, chromaticities);
  const auto path = lightfield::UniquePath(".exr");
  const std::vector<Imf::Rgba> pixels(8, pixel);
  Imf::RgbaOutputFile file(path.c_str(), header, channels);
  file.setFrameBuffer(pixels.data(), 1, 4);
  file.writePixels(2);
  return path;
}

// Known answers: the matrix of ITU-R BT.2407 for Rec. 2020 (white D65 in both); white of ACES stays
// white.
TEST(EnvironmentMap, ChromaticitiesBecomeRec709) {
  const Imf::Chromaticities rec2020({0.708f, 0.292f}, {0.170f, 0.797f}, {0.131f, 0.046f},
                                    {0.3127f, 0.3290f}),
      aces({0.7347f, 0.2653f}, {0, 1}, {0.0001f, -0.077f}, {0.32168f, 0.33767f});
  const Imf::Chromaticities nonsense({0.3f, 0.3f}, {0.3f, 0.3f}, {0.3f, 0.3f}, {0.3f, 0.3f});
  const auto first = [](const std::filesystem::path& path) {
    const core::Image image = ReadEnvironmentPicture(path).image;
    return core::Rgb{image.plane(0)[7], image.plane(1)[7], image.plane(2)[7]};
  };
  const core::Rgb colour = first(WriteWithChromaticities(rec2020, Imf::Rgba(0.5f, 0.75f, 0.625f)));
  const double expected[] = {1.6605 * 0.5 - 0.5876 * 0.75 - 0.0728 * 0.625,
                             -0.1246 * 0.5 + 1.1329 * 0.75 - 0.0083 * 0.625,
                             -0.0182 * 0.5 - 0.1006 * 0.75 + 1.1187 * 0.625};
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(colour[c], expected[c], 3e-4) << c;
  // Out of reach: not negative, and as bright as it was (Rec. 2020's Y of green is 0.6780).
  const core::Rgb green = first(WriteWithChromaticities(rec2020, Imf::Rgba(0, 1, 0)));
  EXPECT_NEAR(*std::min_element(green.begin(), green.end()), 0, 1e-6);
  EXPECT_NEAR(core::Luminance(green), 0.6780, 3e-4);
  const core::Rgb white = first(WriteWithChromaticities(aces, Imf::Rgba(2, 2, 2)));
  for (const double value : white) EXPECT_NEAR(value, 2, 1e-5);
  // Rec. 709's own change nothing, to the bit.
  const core::Rgb own =
      first(WriteWithChromaticities(Imf::Chromaticities(), Imf::Rgba(0.125f, 1, 0)));
  EXPECT_EQ(own, (core::Rgb{0.125, 1, 0}));
  // Nonsense and luminance-chroma pictures are refused by name.
  EXPECT_THAT(Refusal(WriteWithChromaticities(nonsense, Imf::Rgba(1, 1, 1))),
              HasSubstr("chromaticities"));
  EXPECT_THAT(
      Refusal(WriteWithChromaticities(Imf::Chromaticities(), Imf::Rgba(1, 1, 1), Imf::WRITE_YC)),
      HasSubstr("RY, BY"));
}

// What a viewer sees who faces -y and turns: to the left, straight on, right, up, down, behind.
TEST(EnvironmentMap, CrossesAreUnfoldedAroundWhatIsAhead) {
  constexpr int kSize = 5;
  const lightfield::Vec3 front = {0, -1, 0}, right = {-1, 0, 0}, up = {0, 0, 1};
  const auto minus = [](lightfield::Vec3 v) { return -1.0 * v; };
  // Paper folded around the head: going over an edge turns the view by a quarter about it.
  struct Square {
    int column, row;
    lightfield::Vec3 axis, right, up;
  };
  const Square middle = {1, 1, front, right, up};
  const auto over = [&](const Square& from, int dx, int dy) {
    Square to = {from.column + dx, from.row + dy, from.axis, from.right, from.up};
    if (dx == 1) to.axis = from.right, to.right = minus(from.axis);
    if (dx == -1) to.axis = minus(from.right), to.right = from.axis;
    if (dy == 1) to.axis = minus(from.up), to.up = from.axis;
    if (dy == -1) to.axis = from.up, to.up = minus(from.axis);
    return to;
  };
  for (const bool vertical : {true, false}) {
    SCOPED_TRACE(vertical);
    const Square right_one = over(middle, 1, 0), below = over(middle, 0, 1);
    const Square squares[] = {middle,
                              right_one,
                              over(middle, -1, 0),
                              over(middle, 0, -1),
                              below,
                              vertical ? over(below, 0, 1) : over(right_one, 1, 0)};
    core::Image image(kSize * (vertical ? 3 : 4), kSize * (vertical ? 4 : 3), 3);
    for (const Square& s : squares)
      for (int row = 0; row < kSize; ++row)
        for (int column = 0; column < kSize; ++column) {
          const double x = -1 + (2 * column + 1.0) / kSize, y = 1 - (2 * row + 1.0) / kSize;
          const lightfield::Vec3 w = lightfield::Normalized(s.axis + x * s.right + y * s.up);
          const float values[] = {float(2 + w.x), float(2 + w.y), float(2 + w.z)};
          for (int c = 0; c < 3; ++c)
            image.at(c, s.row * kSize + row, s.column * kSize + column) = values[c];
        }
    const auto path = lightfield::UniquePath(".exr");
    core::WriteExrImage(path, image);
    const auto picture = ReadEnvironmentPicture(path);
    EXPECT_EQ(picture.layout, kCube);
    EXPECT_EQ(picture.image.width, kSize);
    const CubeMap cube = MakeCubeMap(picture, kSize);
    for (int face = 0; face < 6; ++face)
      for (int row = 0; row < kSize; ++row)
        for (int column = 0; column < kSize; ++column) {
          const lightfield::Vec3 w = lightfield::Normalized(
              CubeVector({face, -1 + (2 * column + 1.0) / kSize, 1 - (2 * row + 1.0) / kSize}));
          EXPECT_NEAR(cube.at(face, row, column, 0), 2 + w.x, 1e-5);
          EXPECT_NEAR(cube.at(face, row, column, 1), 2 + w.y, 1e-5);
          EXPECT_NEAR(cube.at(face, row, column, 2), 2 + w.z, 1e-5);
        }
    EXPECT_EQ(Refusal(path, kCube), "accepted");
    EXPECT_NE(Refusal(path, kMirrorBall), "accepted");
  }
}

// ---- maps of other authors --------------------------------------------------------------------

// One rule of orientation for all files: the two layouts that their authors made of a map agree,
// and no turned or mirrored reading agrees better.
TEST(EnvironmentMap, TwoLayoutsOfTheSameMapAgree) {
  const auto folder = testdata::Folder() / "env";
  LUXFIELD_NEEDS_DATA(folder);
  // What the files themselves leave: each was filtered for its own lattice, and sharp lines differ
  // most. Measured 0.0072, 0.0028, 0.0173 at 64 texels.
  const struct {
    const char* name;
    double agree, wrong;
  } cases[] = {{"Kerner", 0.008, 0.5}, {"Orientation", 0.0035, 0.02}, {"WavyLines", 0.03, 0.1}};
  const CubeResampler whole(kLatitudeLongitude, TexelRegistration::kNodes, 1024, 512, 64);
  const CubeResampler cells(kLatitudeLongitude, TexelRegistration::kCells, 1024, 512, 64);
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const std::string stem = std::string("openexr__") + c.name + (c.name[0] == 'K' ? "Env" : "");
    const auto strip = ReadEnvironmentPicture(folder / (stem + "Cube.exr"));
    const auto wide = ReadEnvironmentPicture(folder / (stem + "LatLong.exr"));
    EXPECT_EQ(strip.layout, kCube);
    EXPECT_EQ(wide.layout, kLatitudeLongitude);
    EXPECT_EQ(wide.registration, TexelRegistration::kNodes);
    const CubeMap cube = MakeCubeMap(strip, 64);
    const EnvironmentDifference difference = CompareEnvironments(whole(wide.image), cube);
    ASSERT_TRUE(difference.turned);
    std::printf("%s: relative %.4f, turned %.4f, mean %.1e, irradiance %.1e\n", c.name,
                difference.relative, *difference.turned, difference.mean, difference.irradiance);
    EXPECT_LT(difference.relative, c.agree);
    EXPECT_GT(*difference.turned, c.wrong);
    EXPECT_LT(difference.mean, 1e-4);
    EXPECT_LT(difference.irradiance, 1e-3);
    // Pixels taken as whole at the borders are read wrongly, too.
    EXPECT_GT(CompareEnvironments(cells(wide.image), cube).relative, 2 * difference.relative);
  }
}

// The brightest by luminance, whichever channel brings it, with all of its channels; a grey picture's
// is the same in all three.
TEST(EnvironmentMap, TheBrightestPixelIsThatOfTheLargestLuminance) {
  EnvironmentPicture picture{core::Image(8, 4, 3), kLatitudeLongitude};
  for (float& value : picture.image.data) value = 0.5f;
  picture.image.at(2, 1, 3) = 40;  // luminance 0.93 * 0.5 + 0.0722 * 40 = 3.4
  picture.image.at(0, 2, 6) = 10;  // 0.79 * 0.5 + 0.2126 * 10 = 2.5
  const BrightestPixel blue = FindBrightestPixel(picture);
  EXPECT_EQ(blue.row, 1);
  EXPECT_EQ(blue.column, 3);
  EXPECT_EQ(blue.radiance, (core::Rgb{0.5, 0.5, 40}));
  picture.image = core::Image(8, 4, 1);
  picture.image.at(0, 2, 5) = 2;
  const BrightestPixel grey = FindBrightestPixel(picture);
  EXPECT_EQ(grey.column, 5);
  EXPECT_EQ(grey.radiance, (core::Rgb{2, 2, 2}));
}

TEST(EnvironmentMap, ComparisonNamesWhatItCannotCompare) {
  CubeMap map(4);
  std::fill(map.data.begin(), map.data.end(), 1.0f);
  map.at(2, 1, 3, 0) = 5;
  const EnvironmentDifference own = CompareEnvironments(map, map);
  EXPECT_EQ(own.relative, 0);
  EXPECT_EQ(own.irradiance, 0);
  EXPECT_GT(own.turned.value_or(0), 0.01);
  EXPECT_THROW(CompareEnvironments(map, CubeMap(8)), InputError);
  EXPECT_THROW(CompareEnvironments(map, CubeMap(4)), InputError);  // black
}

// OpenEXR's picture of the same map on a sphere, seen from outside. Its view was found by search:
// orthographic, a radius of 0.9 half pictures, and a rotation that came out as 45, 45 and 10
// degrees; no mirrored view correlates above 0.64.
TEST(EnvironmentMap, TheWavyLinesOnASphereAreThoseOfTheirAuthors) {
  const auto folder = testdata::Folder() / "env";
  LUXFIELD_NEEDS_DATA(folder);
  const core::Image sphere = core::ReadExrImage(folder / "openexr__WavyLinesSphere.exr");
  ASSERT_EQ(sphere.width, 480);
  const double r = std::sqrt(0.5), cosine = std::cos(kPi / 18), sine = std::sin(kPi / 18);
  const lightfield::Vec3 right = {-0.5, -r, 0.5};
  const lightfield::Vec3 up =
      cosine * lightfield::Vec3{r, 0, r} + sine * lightfield::Vec3{0.5, -r, -0.5};
  const lightfield::Vec3 to_viewer = lightfield::Cross(right, up);
  const auto correlation = [&](const CubeMap& cube, double handedness) {
    double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
    for (int row = 0; row < 480; ++row)
      for (int column = 0; column < 480; ++column) {
        const double a = (column + 0.5 - 240) / 216, b = (240 - row - 0.5) / 216;
        if (a * a + b * b > 0.9) continue;
        const lightfield::Vec3 w =
            (handedness * a) * right + b * up + std::sqrt(1 - a * a - b * b) * to_viewer;
        const double ours = cube.data[3 * cube.texel_of(w)], theirs = sphere.at(0, row, column);
        n += 1, x += ours, y += theirs, xx += ours * ours, yy += theirs * theirs,
            xy += ours * theirs;
      }
    return (xy - x * y / n) / std::sqrt((xx - x * x / n) * (yy - y * y / n));
  };
  for (const char* layout : {"Cube", "LatLong"}) {
    const auto path = folder / fmt::format("openexr__WavyLines{}.exr", layout);
    const CubeMap cube = MakeCubeMap(ReadEnvironmentPicture(path), 256);
    // 0.946 and 0.937: our texels are squares where theirs are filtered.
    EXPECT_GT(correlation(cube, 1), 0.92) << layout;
    EXPECT_LT(correlation(cube, -1), 0.7) << layout;
  }
}

// E(n) straight from the pixels of a latitude-longitude picture, each at its centre: nothing of the
// cube in it.
core::Rgb IrradianceOfPixels(const core::Image& image, lightfield::Vec3 n) {
  core::Rgb sum{};
  for (int row = 0; row < image.height; ++row) {
    const double theta0 = kPi * row / image.height, theta1 = kPi * (row + 1) / image.height;
    const double angle = 2 * kPi / image.width * (std::cos(theta0) - std::cos(theta1));
    for (int column = 0; column < image.width; ++column) {
      const double theta = 0.5 * (theta0 + theta1),
                   phi = kPi * (1 - (2 * column + 1.0) / image.width);
      const double cosine = n.x * std::sin(theta) * std::sin(phi) -
                            n.y * std::sin(theta) * std::cos(phi) + n.z * std::cos(theta);
      if (cosine <= 0) continue;
      for (int channel = 0; channel < 3; ++channel)
        sum[channel] += angle * cosine * image.at(channel, row, column);
    }
  }
  return sum;
}

TEST(EnvironmentMap, RadianceFilesOfOtherAuthorsKeepTheirSunAndLight) {
  const auto folder = testdata::Folder() / "env";
  LUXFIELD_NEEDS_DATA(folder);
  // The largest value, by another decoder's rule (mantissa without the half step) plus that step.
  const struct {
    const char* name;
    double peak, elevation_low_deg, elevation_high_deg;
  } cases[] = {{"pmndrs__sunrise", 222720, 0, 30},       {"pmndrs__park", 69376, 5, 45},
               {"gkj__kloppenheim_05_1k", 83712, 5, 80}, {"gkj__noon_grass_1k", 64384, 30, 90},
               {"pmndrs__studio", 3576, -90, 90},        {"pmndrs__night", 115.25, -90, 90}};
  constexpr std::uint64_t kSeed = 9;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  const CubeResampler resampler(kLatitudeLongitude, TexelRegistration::kCells, 1024, 512, 128);
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const auto picture = ReadEnvironmentPicture(folder / (std::string(c.name) + ".hdr"));
    ASSERT_EQ(picture.layout, kLatitudeLongitude);
    ASSERT_EQ(picture.image.width, 1024);
    ASSERT_EQ(picture.image.height, 512);
    EXPECT_EQ(*std::max_element(picture.image.data.begin(), picture.image.data.end()),
              float(c.peak));
    const BrightestPixel sun = FindBrightestPixel(picture);
    const double elevation_deg = std::asin(sun.direction.z) * 180 / kPi;
    EXPECT_GT(elevation_deg, c.elevation_low_deg);
    EXPECT_LT(elevation_deg, c.elevation_high_deg);
    EXPECT_NEAR(sun.solid_angle_sr,
                2 * kPi * kPi / 512 / 1024 * std::cos(elevation_deg * kPi / 180), 1e-9);

    const CubeMap cube = resampler(picture.image);
    core::Rgb energy{};
    for (int channel = 0; channel < 3; ++channel)
      for (std::size_t k = 0; k < picture.image.plane_size(); ++k)
        energy[channel] += resampler.source_solid_angles()[k] * picture.image.plane(channel)[k];
    // What sits in a few pixels moves by up to half a diagonal of a cube texel, 0.011 rad, when it
    // is spread over it; all else averages out.
    double sun_energy = 0;
    for (std::size_t k = 0; k < picture.image.plane_size(); ++k) {
      const double value = picture.image.plane(0)[k];
      if (value > 0.01 * c.peak) sun_energy += value * resampler.source_solid_angles()[k];
    }
    const core::Rgb mean = MeanRadiance(cube);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(4 * kPi * mean[k] / energy[k], 1, 0x1p-23);
    for (int k = 0; k < 4; ++k) {
      const double z = 2 * random.Uniform() - 1, phi = 2 * kPi * random.Uniform(),
                   s = std::sqrt(1 - z * z);
      const lightfield::Vec3 n = {s * std::cos(phi), s * std::sin(phi), z};
      const core::Rgb e = Irradiance(cube, n), pixels = IrradianceOfPixels(picture.image, n);
      for (std::size_t channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(e[channel], pixels[channel], 1e-3 * pixels[channel] + 0.011 * sun_energy);
    }
  }
}

}  // namespace
}  // namespace luxfield::environment
