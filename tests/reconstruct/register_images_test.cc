#include "luxfield/reconstruct/bracket/register_images.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Lattice;
using lightfield::Vec2;

constexpr std::uint64_t kSeed = 31;
const std::vector<float> kUnitScale{1.0f};

MergedFrame Frame(int width, int height) {
  MergedFrame frame;
  frame.width = width;
  frame.height = height;
  core::Random random(kSeed, static_cast<std::uint64_t>(width));
  for (int p = 0; p < width * height; ++p) {
    frame.rate_e_per_s.push_back(1 + random.UniformFloat());
    frame.sigma_e_per_s.push_back(0.1f + random.UniformFloat());
    frame.count.push_back(2);
    frame.mask.push_back(0);
  }
  return frame;
}

// Pixels of pitch p, the sensor's middle on the filter's axis, row 0 on top.
std::array<double, 9> Centred(int width, int height, double pitch_m) {
  return {pitch_m, 0, -pitch_m * width / 2, 0, -pitch_m, pitch_m * height / 2, 0, 0, 1};
}

TEST(Registration, CopiesAlignedPixelsExactly) {
  // 40 x 30 pixels of 0.1 mm around a filter at (0.7, -0.3) mm; a lattice of the same pitch: texel
  // (r, c) is pixel (r + 4, c + 3).
  const MergedFrame frame = Frame(40, 30);
  const Vec2 centre{0.7e-3, -0.3e-3};
  const Lattice lattice{20, 16, centre.x - 20e-4 + 3e-4, centre.y + 15e-4 - 4e-4, 1e-4, 1e-4};
  const RegisteredImage image =
      Registration(Centred(40, 30, 1e-4), 40, 30, lattice).Apply(frame, kUnitScale, centre);
  for (int r = 0; r < 16; ++r)
    for (int c = 0; c < 20; ++c) {
      EXPECT_EQ(image.value[r * 20 + c], frame.rate_e_per_s[(r + 4) * 40 + c + 3]);
      EXPECT_EQ(image.sigma[r * 20 + c], frame.sigma_e_per_s[(r + 4) * 40 + c + 3]);
      EXPECT_EQ(image.count[r * 20 + c], 2);
      EXPECT_EQ(image.mask[r * 20 + c], 0u);
    }
}

TEST(Registration, AveragesWholePixelsAndTheirVariances) {
  const MergedFrame frame = Frame(16, 16);
  const Lattice lattice{4, 4, -8e-4, 8e-4, 4e-4, 4e-4};
  const RegisteredImage image =
      Registration(Centred(16, 16, 1e-4), 16, 16, lattice).Apply(frame, kUnitScale, {});
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) {
      double sum = 0, variance = 0;
      for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
          const int p = (4 * r + y) * 16 + 4 * c + x;
          sum += frame.rate_e_per_s[p];
          variance += std::pow(frame.sigma_e_per_s[p], 2);
        }
      EXPECT_FLOAT_EQ(image.value[r * 4 + c], static_cast<float>(sum / 16));
      EXPECT_FLOAT_EQ(image.sigma[r * 4 + c], static_cast<float>(std::sqrt(variance) / 16));
    }
}

// Pixels hold the exact mean of f(s, t) = sin(a s) cos(b t) over their area.
double MeanOfF(double s0, double s1, double t0, double t1) {
  const double a = 3000, b = 2000;
  return (std::cos(a * s0) - std::cos(a * s1)) / a / (s1 - s0) *
         (std::sin(b * t1) - std::sin(b * t0)) / b / (t1 - t0);
}

TEST(Registration, ConvergesToAreaIntegralsInSecondOrder) {
  const Vec2 centre{0.13e-3, 0.21e-3};
  const Lattice lattice{10, 8, -0.9e-3, 0.8e-3, 0.17e-3, 0.19e-3};
  double previous = 0;
  for (const int size : {64, 128, 256}) {
    const double pitch = 2.6e-3 / size;
    MergedFrame frame = Frame(size, size);
    for (int r = 0; r < size; ++r)
      for (int c = 0; c < size; ++c) {
        const double s = centre.x - 1.3e-3 + c * pitch, t = centre.y + 1.3e-3 - r * pitch;
        frame.rate_e_per_s[r * size + c] = static_cast<float>(MeanOfF(s, s + pitch, t - pitch, t));
      }
    const RegisteredImage image = Registration(Centred(size, size, pitch), size, size, lattice)
                                      .Apply(frame, kUnitScale, centre);
    double worst = 0;
    for (int r = 0; r < 8; ++r)
      for (int c = 0; c < 10; ++c) {
        ASSERT_EQ(image.mask[r * 10 + c], 0u);
        worst = std::max(worst, std::abs(image.value[r * 10 + c] -
                                         MeanOfF(lattice.s_of_column(c), lattice.s_of_column(c + 1),
                                                 lattice.t_of_row(r + 1), lattice.t_of_row(r))));
      }
    // An edge that cuts a pixel moves at most an eighth of slope pitch^2, on four sides, of a
    // texel's mean.
    EXPECT_LT(worst, (3000 / 0.17e-3 + 2000 / 0.19e-3) * pitch * pitch / 4);
    if (previous > 0) {
      EXPECT_GT(previous / worst, 2.5);  // 4 on average over cuts
    }
    previous = worst;
  }
}

// An oblique camera.
std::array<double, 9> Oblique(int width, int height) {
  const double p = 1e-4;
  return {p * 0.98,          p * 0.21,     -p * 0.6 * width, -p * 0.17, -p * 1.05,
          p * 0.62 * height, 0.15 / width, -0.1 / height,    1};
}

TEST(Registration, WeighsObliquePixelsByTheirArea) {
  const int width = 48, height = 40;
  const MergedFrame frame = Frame(width, height);
  const Lattice lattice{5, 4, -1.0e-3, 0.9e-3, 0.31e-3, 0.27e-3};
  const Vec2 centre{0.05e-3, -0.1e-3};
  const std::array<double, 9> h = Oblique(width, height);
  const RegisteredImage image =
      Registration(h, width, height, lattice).Apply(frame, kUnitScale, centre);
  const Eigen::Matrix3d inverse =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h.data()).inverse();
  constexpr int kSamples = 1200;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 5; ++c) {
      // Brute force: which pixel does every one of 1200^2 points of the texel fall on?
      std::vector<double> weight(frame.mask.size(), 0);
      for (int y = 0; y < kSamples; ++y)
        for (int x = 0; x < kSamples; ++x) {
          const Eigen::Vector3d q(lattice.s_of_column(c + (x + 0.5) / kSamples) - centre.x,
                                  lattice.t_of_row(r + (y + 0.5) / kSamples) - centre.y, 1);
          const Eigen::Vector3d pixel = inverse * q;
          const int column = static_cast<int>(std::floor(pixel.x() / pixel.z()));
          const int row = static_cast<int>(std::floor(pixel.y() / pixel.z()));
          ASSERT_TRUE(column >= 0 && column < width && row >= 0 && row < height);
          weight[row * width + column] += 1.0 / kSamples / kSamples;
        }
      double value = 0, variance = 0;
      for (std::size_t p = 0; p < weight.size(); ++p) {
        value += weight[p] * frame.rate_e_per_s[p];
        variance += weight[p] * weight[p] * std::pow(frame.sigma_e_per_s[p], 2);
      }
      ASSERT_EQ(image.mask[r * 5 + c], 0u);
      // About 20 pixels, each border point-sampled to 1/1200 of the texel's side per pixel side:
      // below 1e-4.
      EXPECT_NEAR(image.value[r * 5 + c], value, 1e-4);
      EXPECT_NEAR(image.sigma[r * 5 + c], std::sqrt(variance), 1e-4);
    }
}

TEST(Registration, PolygonsAndSeparableWeightsAgree) {
  const MergedFrame frame = Frame(50, 44);
  const Lattice lattice{13, 11, -1.9e-3, 1.7e-3, 0.29e-3, 0.31e-3};
  std::array<double, 9> h = Centred(50, 44, 1e-4);
  const RegisteredImage separable =
      Registration(h, 50, 44, lattice).Apply(frame, kUnitScale, {0.03e-3, 0.04e-3});
  h[1] = 1e-30;  // no longer axis-aligned to the letter
  const RegisteredImage polygons =
      Registration(h, 50, 44, lattice).Apply(frame, kUnitScale, {0.03e-3, 0.04e-3});
  EXPECT_EQ(separable.mask, polygons.mask);
  for (std::size_t p = 0; p < separable.value.size(); ++p) {
    EXPECT_FLOAT_EQ(separable.value[p], polygons.value[p]);
    EXPECT_FLOAT_EQ(separable.sigma[p], polygons.sigma[p]);
  }
}

TEST(Registration, KeepsAConstantAndAppliesTheScalePerPixel) {
  MergedFrame frame = Frame(48, 40);
  std::vector<float> scale;
  for (float& rate : frame.rate_e_per_s) {
    scale.push_back(5 / rate);  // what vignetting took, times 5
  }
  const Lattice lattice{6, 5, -1.0e-3, 0.9e-3, 0.3e-3, 0.3e-3};
  const RegisteredImage image =
      Registration(Oblique(48, 40), 48, 40, lattice).Apply(frame, scale, {});
  for (std::size_t p = 0; p < image.value.size(); ++p) {
    ASSERT_EQ(image.mask[p], 0u);
    EXPECT_NEAR(image.value[p], 5, 1e-5);
  }
}

TEST(Registration, SaysUnknownOffTheSensorAndOnDefects) {
  for (const double skew : {0.0, 1e-30}) {
    MergedFrame frame = Frame(10, 10);
    frame.mask[3 * 10 + 4] = lightfield::kDefect;
    frame.mask[7 * 10 + 7] = lightfield::kSaturated;
    frame.mask[5 * 10 + 5] = lightfield::kTooDark;  // enters sums as the others do
    std::array<double, 9> h = Centred(10, 10, 1e-4);
    h[1] = skew;
    // Twelve texels each way on ten pixels, shifted by half a pixel: the outermost are half off the
    // sensor.
    const Lattice lattice{12, 12, -6e-4, 6e-4, 1e-4, 1e-4};
    const RegisteredImage image =
        Registration(h, 10, 10, lattice).Apply(frame, kUnitScale, {0.5e-4, 0});
    for (int r = 0; r < 12; ++r)
      for (int c = 0; c < 12; ++c) {
        // Texel column c covers pixel columns c - 1.5 to c - 0.5.
        std::uint32_t expected = r < 1 || r > 10 || c < 2 || c > 10 ? lightfield::kOffSensor : 0u;
        const auto touches = [&](int row, int column) {
          return r == row + 1 && (c == column + 1 || c == column + 2);
        };
        if (touches(3, 4)) expected |= lightfield::kDefect;
        if (touches(7, 7)) expected |= lightfield::kSaturated;
        EXPECT_EQ(image.mask[r * 12 + c], expected) << r << " " << c;
        if (expected) {
          EXPECT_EQ(image.value[r * 12 + c], 0);
        }
      }
    const RegisteredImage aligned = Registration(h, 10, 10, lattice).Apply(frame, kUnitScale, {});
    EXPECT_EQ(aligned.mask[6 * 12 + 6], 0u);
    EXPECT_NE(aligned.value[6 * 12 + 6], 0);
  }
}

TEST(Registration, FillsALesserDefectFromTheRestOfItsTexel) {
  MergedFrame frame = Frame(4, 4);
  for (std::size_t p = 0; p < 16; ++p) frame.sigma_e_per_s[p] = 0.5f;
  // The texel of pixels (0,0) (0,1) (1,0) (1,1): the last one is hot, the others read 1, 2, 6.
  frame.rate_e_per_s[0] = 1;
  frame.rate_e_per_s[1] = 2;
  frame.rate_e_per_s[4] = 6;
  frame.rate_e_per_s[5] = 1e6f;
  frame.mask[5] = lightfield::kDefect;
  const RegisteredImage image =
      Registration(Centred(4, 4, 1e-4), 4, 4, {2, 2, -2e-4, 2e-4, 2e-4, 2e-4})
          .Apply(frame, kUnitScale, {});
  EXPECT_EQ(image.mask[0], lightfield::kPartlyDefect);
  EXPECT_FLOAT_EQ(image.value[0], 3);
  // Three independent sigmas of 1/2, and a quarter missing of pixels that spread by sqrt(14/3).
  EXPECT_NEAR(image.sigma[0], std::sqrt(0.25 / 3 + 2 * 14.0 / 3 / 16), 1e-6);
  EXPECT_EQ(image.mask[1], 0u);
}

TEST(Registration, MovesWithTheFilter) {
  const MergedFrame frame = Frame(30, 30);
  const Lattice lattice{10, 10, -5e-4, 5e-4, 1e-4, 1e-4};
  const Registration registration(Centred(30, 30, 1e-4), 30, 30, lattice);
  const RegisteredImage at_zero = registration.Apply(frame, kUnitScale, {});
  const RegisteredImage moved = registration.Apply(frame, kUnitScale, {3e-4, 2e-4});
  // s = c + q: the light at q appears 3 columns further right and 2 rows further up.
  for (int r = 0; r < 8; ++r)
    for (int c = 3; c < 10; ++c)
      EXPECT_EQ(moved.value[r * 10 + c], at_zero.value[(r + 2) * 10 + c - 3]);
}

TEST(Registration, RefusesMappingsThatAreNone) {
  const Lattice lattice{4, 4, -1, 1, 0.5, 0.5};
  std::array<double, 9> h = Centred(10, 10, 1e-4);
  const auto make = [&] { Registration(h, 10, 10, lattice); };
  EXPECT_NO_THROW(make());
  h[0] = NAN;
  EXPECT_THROW(make(), InputError);
  h[0] = 0;
  EXPECT_THROW(make(), InputError);  // singular
  h = Centred(10, 10, 1e-4);
  h[6] = -0.2;  // w = 1 - 0.2 column changes sign
  EXPECT_THROW(make(), InputError);
}

}  // namespace
}  // namespace luxfield::reconstruct
