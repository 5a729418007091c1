// The rim of a ball in photographs of a cluttered place: found where it is, refused where none is.
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_fit.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/probe.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_picture.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_search.h"
#include "luxfield/reconstruct/calibrate/response/merge_stack.h"

namespace luxfield::reconstruct {
namespace {

constexpr int kWidth = 480, kHeight = 360;

struct Scene {
  std::uint64_t seed = 1;
  std::optional<Circle> ball;
  double hidden_below = 2;  // of the ball: what lies so many radii under its centre
};

double Brightness(std::uint64_t seed, int n, int m) {
  core::Random random(seed, static_cast<std::uint64_t>(n + 1000), static_cast<std::uint32_t>(m));
  return random.Uniform();
}

// Bricks of 46 x 15 pixels with mortar, three windows a hundred times as bright with bars, a table.
double Wall(std::uint64_t seed, double x, double y) {
  for (int k = 0; k < 3; ++k) {
    const double left = 40 + 150 * k + 60 * Brightness(seed, 500 + k, 0),
                 top = 20 + 60 * Brightness(seed, 500 + k, 1);
    if (x > left && x < left + 60 && y > top && y < top + 80)
      return std::fmod(x - left, 20) < 3 || std::fmod(y - top, 27) < 3 ? 0.2 : 60;
  }
  if (y > 300) return 0.8 + 0.3 * std::sin(0.05 * x);
  const int row = static_cast<int>(y / 15);
  const double shifted = x + (row % 2) * 23;
  if (std::fmod(y, 15) < 2 || std::fmod(shifted, 46) < 2) return 1.1;
  return 0.25 + 0.5 * Brightness(seed, row, static_cast<int>(shifted / 46));
}

// What the ball mirrors: floor, walls in panels and two lamps.
double Room(std::uint64_t seed, const lightfield::Vec3& w) {
  const double azimuth = std::atan2(w.x, w.z);
  if (w.y > 0.6 && std::abs(std::sin(2 * azimuth)) > 0.9) return 200;
  if (w.y < -0.3) return 0.35 + 0.2 * std::sin(9 * w.x);
  return 0.3 + 1.5 * Brightness(seed, 900, static_cast<int>(5 * (azimuth + 4)));
}

double Seen(const Scene& scene, double x, double y) {
  if (scene.ball) {
    const double p = (x - scene.ball->x) / scene.ball->radius,
                 q = (scene.ball->y - y) / scene.ball->radius, square = p * p + q * q;
    if (-q > scene.hidden_below && std::abs(p) < 1.2) return 0.15 + 0.1 * std::sin(0.4 * x);
    if (square < 1) {
      const double n = std::sqrt(1 - square);
      return 0.6 * Room(scene.seed, {2 * n * p, 2 * n * q, 2 * n * n - 1});
    }
  }
  return Wall(scene.seed, x, y);
}

core::Image Photograph(const Scene& scene) {
  constexpr int kSide = 4;
  core::Image picture(kWidth, kHeight, 1);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      double sum = 0;
      for (int k = 0; k < kSide * kSide; ++k)
        sum += Seen(scene, column + (k % kSide + 0.5) / kSide, row + (k / kSide + 0.5) / kSide);
      core::Random random(scene.seed, 77, static_cast<std::uint32_t>(row * kWidth + column));
      picture.at(0, row, column) =
          static_cast<float>(sum / (kSide * kSide) * (1 + 0.01 * random.Normal()));
    }
  return picture;
}

Scene BallSomewhere(std::uint64_t seed, double hidden_below) {
  core::Random random(seed, 3, 0);
  const double radius = 40 + 48 * random.Uniform();
  return {seed,
          Circle{radius + 20 + (kWidth - 2 * radius - 40) * random.Uniform(),
                 radius + 20 + (kHeight - 2 * radius - 40) * random.Uniform(), radius},
          hidden_below};
}

std::string Refusal(const RimFit& fit) {
  try {
    RequireRim(fit, "wall.exr");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

// What the ball mirrors makes rings just within its rim, one of which may be taken for it: the
// place is right to so many of its radii.
constexpr double kRings = 0.06, kRingsHalfHidden = 0.1;

TEST(RimFit, FindsTheBallBeforeBricksAndWindows) {
  int refused = 0;
  for (const double hidden_below : {2.0, 0.6})
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", hidden below " << hidden_below);
      const Scene scene = BallSomewhere(seed, hidden_below);
      const Circle& truth = *scene.ball;
      const RimFit fit = FitRim(Photograph(scene), {}, {}, "picture");
      const Circle off{fit.circle.x - truth.x, fit.circle.y - truth.y,
                       fit.circle.radius - truth.radius};
      std::cout << fmt::format(
          "seed {}, radius {:.1f}, hidden below {}: off by {:.2f} {:.2f} {:.2f}, sigma {:.2f} "
          "{:.2f} {:.2f}, edges along {:.0f} % of its rim, by chance {:.0f} %, stands out {:.1f}\n",
          seed, truth.radius, hidden_below, off.x, off.y, off.radius, fit.sigma.x, fit.sigma.y,
          fit.sigma.radius, 100 * fit.evidence.share, 100 * fit.evidence.by_chance,
          fit.evidence.standing);
      const bool hidden = hidden_below < 1;
      if (hidden && !Refusal(fit).empty()) {
        ++refused;
        continue;
      }
      EXPECT_EQ(Refusal(fit), "");
      const double most = (hidden ? kRingsHalfHidden : kRings) * truth.radius;
      EXPECT_LT(std::hypot(off.x, off.y), most);
      EXPECT_LT(std::abs(off.radius), most);
      EXPECT_LT(fit.sigma.x + fit.sigma.y + fit.sigma.radius, 2);
    }
  EXPECT_LE(refused, 2);
}

// Two circles about one another in a plain picture: the inner one has the clearer edge.
TEST(RimSearch, GoesOutFromARingToTheRim) {
  const Circle ring{120, 100, 60}, rim{121, 101, 64.5};
  core::Image picture(240, 200, 1);
  for (int row = 0; row < picture.height; ++row)
    for (int column = 0; column < picture.width; ++column) {
      double sum = 0;
      for (int k = 0; k < 16; ++k) {
        const double x = column + (k % 4 + 0.5) / 4, y = row + (k / 4 + 0.5) / 4;
        sum += std::hypot(x - ring.x, y - ring.y) < ring.radius ? 40
               : std::hypot(x - rim.x, y - rim.y) < rim.radius  ? 1.3
                                                                : 1;
      }
      picture.at(0, row, column) = static_cast<float>(sum / 16);
    }
  const EdgeField edges = FindEdges(picture, 1);
  const auto outer = OuterCircle(edges, {}, ring);
  ASSERT_TRUE(outer);
  EXPECT_NEAR(outer->x, rim.x, 1);
  EXPECT_NEAR(outer->y, rim.y, 1);
  EXPECT_NEAR(outer->radius, rim.radius, 1);
  EXPECT_FALSE(OuterCircle(edges, {}, *outer));
  // Edges of the ring count for the ring, and not besides it.
  EXPECT_GT(ShareOnEdge(edges, {}, ring), 0.9);
  EXPECT_EQ(ShareOnEdge(edges, {}, ring, 1, &ring), 0);
  // On a picture that is reduced circles keep the picture's own pixels.
  EXPECT_GT(ShareOnEdge(FindEdges(picture, 0.5), {}, ring), 0.9);
}

TEST(RimFit, RefusesPicturesWithoutABall) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const core::Image picture = Photograph({seed, {}, 2});
    // Searched for, and where a user says that there is one.
    for (const std::optional<Circle> start :
         {std::optional<Circle>{}, std::optional<Circle>{{240, 180, 60}}}) {
      try {
        const RimFit fit = FitRim(picture, {}, start, "wall.exr");
        std::cout << fmt::format("seed {}: ({:.1f}, {:.1f}) {:.1f} stands out {:.1f}\n", seed,
                                 fit.circle.x, fit.circle.y, fit.circle.radius,
                                 fit.evidence.standing);
        EXPECT_THAT(Refusal(fit), testing::HasSubstr("wall.exr"));
        EXPECT_THAT(Refusal(fit), testing::HasSubstr(start ? "correct [rim]" : "give its place"));
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("wall.exr"));
      }
    }
  }
}

TEST(RimPicture, ShowsTheCircleAndItsEdges) {
  const Scene scene = BallSomewhere(2, 2);
  const core::Image photograph = Photograph(scene);
  const RimFit fit = FitRim(photograph, {}, scene.ball, "picture");
  const core::Image drawn = DrawRim(photograph, fit);
  int green = 0, far = 0;
  for (std::size_t k = 0; k < drawn.plane_size(); ++k) {
    if (!(drawn.plane(0)[k] == 0 && drawn.plane(1)[k] == 1 && drawn.plane(2)[k] == 0)) continue;
    const double x = static_cast<double>(k % kWidth), y = static_cast<double>(k / kWidth);
    far += std::abs(std::hypot(x - scene.ball->x, y - scene.ball->y) - scene.ball->radius) > 4;
    ++green;
  }
  EXPECT_EQ(far, 0);
  EXPECT_GT(green, fit.on_rim);
}

class MergedProbe : public testing::Test {
 protected:
  MergedProbe() { std::filesystem::create_directories(folder_); }
  ~MergedProbe() override { std::filesystem::remove_all(folder_); }

  ProbeDescription Describe(const std::string& probe, const std::string& rest = "") const {
    std::ofstream(folder_ / "probe.toml") << "[probe]\nkind = \"mirror-ball\"\n" << probe << rest;
    return ReadProbeDescription(folder_ / "probe.toml");
  }

  // The ball of seed 4; one of its pixels is saturated, and one too dark.
  MergedPicture Write() const {
    const core::Image radiance = Photograph(scene_);
    MergedPicture merged{radiance, radiance, radiance, {}, {1, 2}, {}};
    for (float& sigma : merged.sigma.data) sigma *= 0.01f;
    merged.mask.assign(radiance.data.size(), 0);
    merged.mask[Middle()] = lightfield::kSaturated;
    merged.mask[Middle() + 2] = lightfield::kTooDark;
    merged.sigma.data[Middle() + 2] = 50;
    WriteMergedPicture(folder_ / "merged.exr", merged, {});
    return merged;
  }
  std::size_t Middle() const {
    return static_cast<std::size_t>(scene_.ball->y) * kWidth +
           static_cast<std::size_t>(scene_.ball->x);
  }

  const Scene scene_ = BallSomewhere(4, 2);
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / "luxfield_merged_probe";
};

TEST_F(MergedProbe, TakesMaskAndSigmaOfAMergedPicture) {
  const MergedPicture merged = Write();
  const auto strict = Describe("merged = \"merged.exr\"\n");
  const ProbePicture refused = MergeProbe(strict);
  EXPECT_EQ(refused.unknown.data[Middle()], 1);
  EXPECT_EQ(refused.unknown.data[Middle() + 2], 0);
  const RimFit rim = FindRim(refused, strict);
  EXPECT_THROW(MakeProbe(refused, strict, rim), InputError);

  const auto lenient =
      Describe("merged = \"merged.exr\"\nradiance_per_rate = [2]\nsaturated = \"lower-bound\"\n");
  const ProbePicture picture = MergeProbe(lenient);
  EXPECT_EQ(picture.lower_bounds, 1u);
  for (const std::size_t p : {Middle(), Middle() + 2, Middle() + 40}) {
    EXPECT_EQ(picture.radiance.data[p], 2 * merged.radiance.data[p]);
    EXPECT_EQ(picture.sigma.data[p], 2 * merged.sigma.data[p]);
  }
  const Probe probe = MakeProbe(picture, lenient, rim, {});
  // The pixel of sigma 50 is one of a few in its texel.
  EXPECT_GT(*std::max_element(probe.sigma.data.begin(), probe.sigma.data.end()), 5);
}

TEST_F(MergedProbe, RefusesWhatCannotBeAndSaysWhatToDo) {
  Write();
  const std::string camera = "[camera]\ngain_dn_per_e = 1\nsaturation_dn = 1e9\n";
  const auto refusal = [&](const std::string& file) -> std::string {
    try {
      MergeProbe(Describe("", camera + "[[exposure]]\nexposure_s = 1\nfile = \"" + file + "\"\n"));
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal("merged.exr"), testing::HasSubstr("[probe] merged"));
  std::ofstream(folder_ / "a.jpg") << "\xFF\xD8\xFF\xE1 and so on";
  EXPECT_THAT(refusal("a.jpg"), testing::HasSubstr("calibrate response"));
  EXPECT_THAT(refusal("a.jpg"), testing::Not(testing::HasSubstr("salvage")));
  std::ofstream(folder_ / "a.txt") << "text";
  EXPECT_THAT(refusal("a.txt"), testing::HasSubstr("neither TIFF nor OpenEXR"));
  EXPECT_THROW(
      Describe("merged = \"merged.exr\"\n", "[[exposure]]\nfile = \"a\"\nexposure_s = 1\n"),
      InputError);
}

}  // namespace
}  // namespace luxfield::reconstruct
