#include "luxfield/hal/sim/glare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "luxfield/core/random.h"

namespace luxfield::hal::sim {
namespace {

TEST(Glare, IsTheConvolutionItStates) {
  constexpr int kWidth = 13, kHeight = 9;
  const Glare glare{0.07, 2.5};
  const double a = std::exp(-1 / glare.reach_px);
  const auto k = [&](int n) { return (1 - a) / (1 + a) * std::pow(a, std::abs(n)); };
  core::Random random(5, 0);
  std::vector<float> pixels(kWidth * kHeight);
  for (float& pixel : pixels) pixel = static_cast<float>(random.Uniform());
  std::vector<float> veiled = pixels;
  glare.Veil(kWidth, kHeight, veiled);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      double scattered = 0;
      for (int r = 0; r < kHeight; ++r)
        for (int c = 0; c < kWidth; ++c)
          scattered += k(row - r) * k(column - c) * pixels[r * kWidth + c];
      const std::size_t p = row * kWidth + column;
      EXPECT_NEAR(veiled[p], (1 - glare.share) * pixels[p] + glare.share * scattered, 1e-7);
    }
}

}  // namespace
}  // namespace luxfield::hal::sim
