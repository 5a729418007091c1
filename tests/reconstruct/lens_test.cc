// The lens against OpenCV, and images registered through it.
#include "luxfield/rig/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "luxfield/core/random.h"
#include "luxfield/reconstruct/bracket/register_images.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;
using rig::Lens;

const Lens kLens{{600, 610}, {240.5, 199}, {-0.2, 0.05, 1e-3, -2e-3}};

TEST(Lens, AgreesWithOpenCv) {
  core::Random random(1, 0);
  const cv::Matx33d matrix(600, 0, 240.5, 0, 610, 199, 0, 0, 1);
  const cv::Vec4d distortion(-0.2, 0.05, 1e-3, -2e-3);
  for (int k = 0; k < 100; ++k) {
    const Vec2 ray{0.8 * (random.Uniform() - 0.5), 0.7 * (random.Uniform() - 0.5)};
    std::vector<cv::Point3d> points{{2 * ray.x, 2 * ray.y, 2}};
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix, distortion, pixels);
    const Vec2 pixel = kLens.PixelOf(ray);
    EXPECT_NEAR(pixel.x, pixels[0].x, 1e-9);
    EXPECT_NEAR(pixel.y, pixels[0].y, 1e-9);
    const Vec2 back = kLens.RayOf(pixel);
    EXPECT_NEAR(back.x, ray.x, 1e-11);
    EXPECT_NEAR(back.y, ray.y, 1e-11);
    const Vec2 bent = kLens.Bent(kLens.Straight(pixel));
    EXPECT_NEAR(std::hypot(bent.x - pixel.x, bent.y - pixel.y), 0, 1e-8);
  }
}

// A linear image, as every pixel has it in its middle: a texel holds its value at its own middle,
// to what a mean over whole pixels leaves.
TEST(Lens, RegistrationStraightensPixels) {
  constexpr int kWidth = 480, kHeight = 400;
  constexpr double kPitch_m = 1e-3;
  const std::array<double, 9> image_from_sensor{kPitch_m, 0, -0.24, 0, -kPitch_m, 0.2, 0, 0, 1};
  const lightfield::Lattice lattice{30, 24, -0.15, 0.12, 0.01, 0.01};
  MergedFrame merged;
  merged.width = kWidth;
  merged.height = kHeight;
  const std::size_t count = static_cast<std::size_t>(kWidth) * kHeight;
  merged.rate_e_per_s.resize(count);
  merged.sigma_e_per_s.assign(count, 1e-3f);
  merged.count.assign(count, 1);
  merged.mask.assign(count, 0);
  const auto value = [](double s, double t) { return 10 + 20 * s - 15 * t; };
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const Vec2 straight = kLens.Straight({column + 0.5, row + 0.5});
      merged.rate_e_per_s[static_cast<std::size_t>(row) * kWidth + column] =
          static_cast<float>(value(kPitch_m * straight.x - 0.24, 0.2 - kPitch_m * straight.y));
    }
  const std::vector<float> unity{1};
  const auto worst = [&](const std::optional<Lens>& lens) {
    const Registration registration(image_from_sensor, kWidth, kHeight, lattice, lens);
    const RegisteredImage image = registration.Apply(merged, unity, {0, 0});
    double error = 0;
    for (int row = 0; row < lattice.height; ++row)
      for (int column = 0; column < lattice.width; ++column) {
        const std::size_t k = static_cast<std::size_t>(row) * lattice.width + column;
        EXPECT_EQ(image.mask[k], 0u) << row << ", " << column;
        const Vec2 at = lattice.centre(row, column);
        error = std::max(error, std::abs(image.value[k] - value(at.x, at.y)));
      }
    return error;
  };
  // A tenth of a pixel's step of 0.02 + 0.015, and what 20 px of distortion would do.
  EXPECT_LT(worst(kLens), 0.0035);
  EXPECT_GT(worst({}), 0.05);
}

}  // namespace
}  // namespace luxfield::reconstruct
