#include "luxfield/reconstruct/bracket/register_mosaic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Lattice;
using lightfield::Vec2;
using rig::Lens;

constexpr int kWidth = 41, kHeight = 34;  // odd too: the last column has one of two sites
constexpr double kPitch_m = 1e-3;

// Every channel a slope of its own.
double Light(int channel, Vec2 q) { return 20 + channel + (300 - 500 * channel) * q.x + 700 * q.y; }

MergedFrame Mosaic(const std::string& cfa, const std::function<Vec2(double, double)>& q_of) {
  MergedFrame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column)
      frame.rate_e_per_s.push_back(static_cast<float>(
          Light(rig::CfaChannel(cfa, row, column), q_of(column + 0.5, row + 0.5))));
  frame.sigma_e_per_s.assign(frame.rate_e_per_s.size(), 1);
  frame.count.assign(frame.rate_e_per_s.size(), 2);
  frame.mask.assign(frame.rate_e_per_s.size(), 0);
  return frame;
}

const std::vector<std::vector<float>> kRaw = {{1}, {1}, {1}};
const std::array<double, 9> kUpright = {kPitch_m, 0, -20 * kPitch_m, 0, -kPitch_m, 17 * kPitch_m, 0,
                                        0,        1};

TEST(MosaicRegistration, EveryColourLandsWhereItWasSeen) {
  // A mean over texels of two or four pixels is exact for light that grows linearly, wherever the
  // sites lie in the cell; half a pixel of error would show as 0.15 to 0.6.
  for (const char* cfa : {"RGGB", "BGGR", "GRBG", "GBRG"})
    for (const int texel : {2, 4}) {
      const Lattice lattice{8, 6, -8 * kPitch_m, 8 * kPitch_m, texel * kPitch_m, texel * kPitch_m};
      const MosaicRegistration registration(kUpright, kWidth, kHeight, lattice, {}, cfa, kRaw);
      const MergedFrame frame = Mosaic(cfa, [](double column, double row) {
        return Vec2{(column - 20) * kPitch_m, (17 - row) * kPitch_m};
      });
      const Vec2 centre{3e-3, -1e-3};
      for (int channel = 0; channel < 3; ++channel) {
        const RegisteredImage image = registration.Apply(frame, channel, centre);
        for (int r = 0; r < lattice.height; ++r)
          for (int c = 0; c < lattice.width; ++c) {
            const std::size_t p = r * lattice.width + c;
            if (image.mask[p]) continue;
            EXPECT_NEAR(image.value[p], Light(channel, lattice.centre(r, c) - centre), 1e-5)
                << cfa << " channel " << channel << " texel (" << r << ", " << c << ")";
          }
        EXPECT_EQ(image.mask[0], 0u);
      }
    }
}

TEST(MosaicRegistration, FollowsTheLensAndAnObliqueView) {
  Lens lens;
  lens.focal_px = {50, 50};
  lens.centre_px = {20, 17};
  lens.distortion = {-0.1, 0.02, 1e-3, -1e-3};
  const std::array<double, 9> oblique = {kPitch_m,
                                         0.05 * kPitch_m,
                                         -20.85 * kPitch_m,
                                         0.05 * kPitch_m,
                                         -kPitch_m,
                                         16 * kPitch_m,
                                         1e-3,
                                         0,
                                         0.98};
  const auto q_of = [&](double column, double row) {
    const Vec2 ray = lens.RayOf({column, row});
    const double x = 50 * ray.x + 20, y = 50 * ray.y + 17;
    const double w = oblique[6] * x + oblique[7] * y + oblique[8];
    return Vec2{(oblique[0] * x + oblique[1] * y + oblique[2]) / w,
                (oblique[3] * x + oblique[4] * y + oblique[5]) / w};
  };
  const MergedFrame frame = Mosaic("RGGB", q_of);
  const Lattice lattice{2, 2, -8 * kPitch_m, 8 * kPitch_m, 8 * kPitch_m, 8 * kPitch_m};
  const MosaicRegistration registration(oblique, kWidth, kHeight, lattice, lens, "RGGB", kRaw);
  for (int channel = 0; channel < 3; ++channel) {
    const RegisteredImage image = registration.Apply(frame, channel, {});
    for (int p = 0; p < 4; ++p) {
      ASSERT_EQ(image.mask[p], 0u);
      // Edges of 8-pixel texels cut cells of two: below a tenth of a pixel times the slope.
      EXPECT_NEAR(image.value[p], Light(channel, lattice.centre(p / 2, p % 2)), 0.07);
    }
  }
}

TEST(MosaicRegistration, GreenIsTheMeanOfTwoSitesAndUnknownIfOneIs) {
  const Lattice lattice{4, 4, -4 * kPitch_m, 4 * kPitch_m, 2 * kPitch_m, 2 * kPitch_m};
  const MosaicRegistration registration(kUpright, kWidth, kHeight, lattice, {}, "RGGB", kRaw);
  MergedFrame frame = Mosaic("RGGB", [](double, double) { return Vec2{}; });
  const RegisteredImage red = registration.Apply(frame, 0, {}),
                        green = registration.Apply(frame, 1, {});
  EXPECT_NEAR(green.sigma[5] / red.sigma[5], std::sqrt(0.5), 1e-6);
  // Row 16, column 19 is a green pixel, of the first site.
  frame.mask[16 * kWidth + 19] = lightfield::kSaturated;
  const RegisteredImage bright = registration.Apply(frame, 1, {});
  int unknown = 0;
  for (std::size_t p = 0; p < 16; ++p)
    if (bright.mask[p] & lightfield::kUnknownMask) {
      ++unknown;
      EXPECT_EQ(bright.value[p], 0);
    }
  EXPECT_EQ(unknown, 4);  // its two pixels' width straddles two texels each way
  EXPECT_EQ(registration.Apply(frame, 0, {}).mask, red.mask);
}

}  // namespace
}  // namespace luxfield::reconstruct
