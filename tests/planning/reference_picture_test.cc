// References: their own noise must not show in what is judged by them.
#include "luxfield/planning/reference_picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "tests/render/small_scene.h"

namespace luxfield::planning {
namespace {

constexpr std::uint64_t kSeed = 7;

core::Image Noisy(double mean, double sigma, std::uint64_t stream) {
  core::Image image(100, 100, 1);
  core::Random random(kSeed, stream);
  for (float& v : image.data) v = static_cast<float>(mean + sigma * random.Normal());
  return image;
}

TEST(ReferencePicture, ItsNoiseAddsNothingToTheErrorOfAPicture) {
  // The halves are off the truth by s = 0.05, x by d = 0.1. Over n = 10^4 pixels the mean of
  // (x - a)(x - b) is d^2 with a standard deviation of sqrt((2 d^2 s^2 + s^4) / n) = 7.5e-5; the
  // mean picture's noise would add s^2 / 2 = 1.25e-3.
  const ReferencePicture reference = MakeReference(Noisy(2, 0.05, 0), Noisy(2, 0.05, 1));
  EXPECT_NEAR(2 * reference.rel_rmse, 0.05 / std::sqrt(2.0), 4 * 2.5e-4);
  core::Image x(100, 100, 1);
  for (float& v : x.data) v = 2.1f;
  EXPECT_NEAR(std::pow(2 * Compare(x, reference).rel_rmse, 2), 0.01, 4 * 7.5e-5);
}

TEST(ReferencePicture, NoErrorBelowItsOwnIsStated) {
  const ReferencePicture reference = MakeReference(Noisy(2, 0.2, 0), Noisy(2, 0.2, 1));
  core::Image truth(100, 100, 1);
  for (float& v : truth.data) v = 2;
  EXPECT_EQ(Compare(truth, reference).rel_rmse, reference.rel_rmse);
}

// Rays that nothing stops: samples must agree with the closed form within the error they state, and
// reach the one they were asked for.
TEST(ReferencePicture, SamplesAgreeWithTheClosedForm) {
  render::LitScene scene(render::Device::Open(), render::LampOverFloor(false));
  render::RenderOptions picture;
  picture.shadows = render::Shadows::kNone;
  const ReferencePicture closed = RenderReference(scene, picture, 64);
  EXPECT_EQ(closed.rel_rmse, 0);
  picture.shadows = render::Shadows::kTraced;
  const ReferencePicture few = RenderReference(scene, picture, 64),
                         asked = RenderReference(scene, picture, 1 << 14, 0.01);
  EXPECT_GT(few.rel_rmse, 0.01);
  EXPECT_LT(asked.rel_rmse, 0.012);
  EXPECT_GT(asked.rel_rmse, 0.001);  // with no more samples than that takes
  for (const auto& sampled : {few, asked}) {
    const double error = core::Compare(sampled.mean, closed.mean).rel_rmse;
    std::printf("stated %.4f, true %.4f\n", sampled.rel_rmse, error);
    // A few dozen pixels hold most of the noise: both scatter by some 15 %.
    EXPECT_GT(error, 0.4 * sampled.rel_rmse);
    EXPECT_LT(error, 2.5 * sampled.rel_rmse);
  }
  picture.shadows = render::Shadows::kMaps;
  EXPECT_THROW(RenderReference(scene, picture, 64), InputError);
}

}  // namespace
}  // namespace luxfield::planning
