// What guides the samples of a picture: how many images light a point, and who follows the light.
#include "luxfield/render/feedback.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/random.h"
#include "luxfield/render/image_shares.h"
#include "tests/render/small_scene.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

using lightfield::LightField;
using lightfield::Vec3;

// Of texels that p sees through a support on F, by the line from each border through p.
bool Sees(double p, double z, double delta, double u_lo, double u_hi, double s_a, double s_b) {
  const auto on_image_plane = [&](double u) { return (u * (z - delta) + p * delta) / z; };
  const double a = on_image_plane(u_lo), b = on_image_plane(u_hi);
  return std::max(s_a, s_b) > std::min(a, b) && std::min(s_a, s_b) < std::max(a, b);
}

double ShareByTexels(const LightField& field, Vec3 p) {
  const auto& [delta, grid, lattice, channels, unit] = field.geometry;
  const double h = grid.spacing_m, support = grid.basis.cells * h;
  double sum = 0, squares = 0;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      double a = 0;
      for (int row = 0; row < lattice.height; ++row)
        for (int column = 0; column < lattice.width; ++column)
          if (Sees(p.x, p.z, delta, grid.u0_m + i * h, grid.u0_m + i * h + support,
                   lattice.s_of_column(column), lattice.s_of_column(column + 1)) &&
              Sees(p.y, p.z, delta, grid.v0_m + j * h, grid.v0_m + j * h + support,
                   lattice.t_of_row(row), lattice.t_of_row(row + 1)))
            a += std::abs(double{field.image(
                grid.index(i, j), 0)[static_cast<std::size_t>(row) * lattice.width + column]});
      sum += a;
      squares += a * a;
    }
  return squares > 0 ? sum * sum / (squares * grid.count()) : 0;
}

TEST(ImageShares, AreThoseOfTheTexelsThatAPointSees) {
  LightField field = SoftLamp();
  core::Random random(TestSeed(5), 0);
  for (float& value : field.data)
    value *= static_cast<float>(random.Uniform() < 0.5 ? 0 : 2 * random.Uniform() - 1);
  for (float& value : field.image(7, 0)) value = 0;
  const ImageShares shares(field);
  int lit = 0;
  for (int k = 0; k < 60; ++k) {
    const Vec3 p{2 * random.Uniform() - 1, 2 * random.Uniform() - 1,
                 std::pow(10, 2 * random.Uniform() - 1.5)};
    const double truth = ShareByTexels(field, p);
    const auto share = shares.At(p);
    EXPECT_EQ(share.has_value(), truth > 0);
    if (!share) continue;
    ++lit;
    EXPECT_NEAR(*share, truth, 1e-6 * truth);
    EXPECT_LE(*share, 11.0 / 12 * (1 + 1e-6));
  }
  EXPECT_GT(lit, 10);
  EXPECT_FALSE(shares.At({0, 0, -1}));
}

// Samples of a matt floor that follow a lamp of a few degrees are worth more than those of the cosine.
TEST(Feedback, AMattFloorFollowsTheLamp) {
  LitScene scene(Device::Open(), LampOverFloor());
  scene.Require({.cells = true});
  const int width = scene.camera().width;
  const Feedback feedback = MeasureFeedback(scene, {.most_pixels = 300, .seed = TestSeed(3)});
  EXPECT_EQ(scene.camera().width, width);
  EXPECT_EQ(feedback.light_share.width, 20);
  EXPECT_EQ(feedback.light_share.height, 15);
  EXPECT_EQ(feedback.image_share.height, 15);
  double sum = 0;
  int hit = 0, missed = 0, lit = 0;
  for (std::size_t k = 0; k < feedback.light_share.data.size(); ++k) {
    const float alpha = feedback.light_share.data[k], images = feedback.image_share.data[k];
    if (std::isnan(alpha)) {
      EXPECT_TRUE(std::isnan(images));
      ++missed;
      continue;
    }
    EXPECT_GE(alpha, 0.02);
    EXPECT_LE(alpha, 0.98);
    if (!std::isnan(images)) {
      EXPECT_GE(images, 1.0f / 12);
      EXPECT_LE(images, 1.0f);
      ++lit;
      sum += alpha;
    }
    ++hit;
  }
  EXPECT_GT(hit, 100);
  EXPECT_GT(missed, 10);
  ASSERT_GT(lit, 50);
  EXPECT_GT(sum / lit, 0.8);
}

}  // namespace
}  // namespace luxfield::render
