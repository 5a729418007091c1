#include "luxfield/preprocess/reduction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LightField;
using lightfield::Vec3;

// Facets: each image a bright spot on a floor, at its own place.
LightField Facets(int grid_width, int grid_height, int size) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.2;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          grid_width, grid_height, 0.015);
  g.lattice = {size, size, -0.2, 0.2, 0.4 / size, 0.4 / size};
  g.channels = 3;
  LightField field(g);
  core::Random random(41, 0);
  for (int m = 0; m < g.grid.count(); ++m) {
    const double s0 = 0.1 * (random.Uniform() - 0.5), t0 = 0.1 * (random.Uniform() - 0.5);
    for (int row = 0; row < size; ++row)
      for (int column = 0; column < size; ++column) {
        const auto s = g.lattice.centre(row, column);
        const double r2 = (s.x - s0) * (s.x - s0) + (s.y - t0) * (s.y - t0);
        const auto value = static_cast<float>(0.01 + std::exp(-r2 / 0.001));
        for (int channel = 0; channel < 3; ++channel)
          field.image(m, channel)[static_cast<std::size_t>(row) * size + column] =
              value * (1.0f + 0.1f * static_cast<float>(channel));
      }
  }
  return field;
}

// Receivers on a disc of radius `radius_m` at depth z, facing the lamp.
std::vector<Receiver> Disc(double z, double radius_m, int count, std::uint64_t seed) {
  core::Random random(seed, 1);
  std::vector<Receiver> receivers;
  for (int k = 0; k < count; ++k) {
    const double r = radius_m * std::sqrt(random.Uniform()), phi = 6.2831853 * random.Uniform();
    receivers.push_back({{r * std::cos(phi), r * std::sin(phi), z}, {0, 0, -1}});
  }
  return receivers;
}

SeenRectangle Everything() { return {-1e3, 1e3, -1e3, 1e3}; }

// Asked for an error at every depth: the judge is the closed form at receivers that the reduction
// has not seen.
TEST(Reduction, KeepsTheErrorAtEveryDepth) {
  const LightField field = Facets(5, 4, 48);
  for (const double z : {0.15, 0.6, 3.0, 300.0}) {
    const auto reduction = ReduceLightField(field, Everything(), Disc(z, 0.5 * z, 300, 1),
                                            Disc(z, 0.5 * z, 300, 2), 0.02);
    const auto fresh = Disc(z, 0.5 * z, 300, 3);
    double squares = 0, sum = 0;
    for (const auto& receiver : fresh) {
      const auto e = lightfield::ExactIrradiance(reduction.field, receiver.p, receiver.n);
      const auto truth = lightfield::ExactIrradiance(field, receiver.p, receiver.n);
      squares += (e[1] - truth[1]) * (e[1] - truth[1]);
      sum += truth[1];
    }
    const double error = std::sqrt(squares / 300) / (sum / 300);
    std::printf("z = %5.1f m: %s of %s, %.0f of %.0f bytes, error %.4f measured %.4f bound %.4f\n",
                z, reduction.steps[2].setting.c_str(), "5 x 4 images", reduction.steps.back().bytes,
                reduction.steps.front().bytes, error, reduction.measured_error,
                reduction.error_bound);
    EXPECT_LE(error, 0.02);
    EXPECT_LE(reduction.error_bound, 0.02);
    if (z > 0.5) {
      EXPECT_LT(reduction.steps.back().bytes, 0.1 * reduction.steps.front().bytes);
    }
  }
}

// A scene far away needs one image, the far field: intensity over distance squared.
TEST(Reduction, FarAwayOneImageIsLeft) {
  const LightField field = Facets(4, 4, 64);
  const auto reduction =
      ReduceLightField(field, Everything(), Disc(1e3, 400, 200, 1), Disc(1e3, 400, 200, 2), 0.03);
  EXPECT_EQ(reduction.field.geometry.grid.count(), 1);
  const Vec3 p{100, 50, 1e3};
  const double r2 = Dot(p, p);
  const auto intensity = lightfield::FarFieldIntensity(field, p);
  const auto e = lightfield::ExactIrradiance(reduction.field, p, -1 / std::sqrt(r2) * p);
  EXPECT_NEAR(e[1] * r2, intensity[1], 0.03 * intensity[1]);
}

// Images are merged as far as the error asked for allows: all of them, some, none.
TEST(Reduction, TheErrorAskedForSaysHowFarImagesAreMerged) {
  const LightField field = Facets(12, 12, 16);
  const auto images = [&](double target) {
    const ReductionStep merged = ReduceLightField(field, Everything(), Disc(0.3, 0.15, 100, 1),
                                                  Disc(0.3, 0.15, 100, 2), target)
                                     .steps[2];
    std::printf("%s within %.2f: %s\n", merged.name.c_str(), target, merged.setting.c_str());
    return merged.grid_width * merged.grid_height;
  };
  EXPECT_EQ(images(0.2), 1);
  const int some = images(0.1);
  EXPECT_GT(some, 1);
  EXPECT_LT(some, 12 * 12);
  EXPECT_EQ(images(0.05), 12 * 12);
}

// Merging and pooling keep the flux to float32's rounding.
TEST(Reduction, FluxIsKept) {
  const LightField field = Facets(4, 4, 31);
  const auto reduction =
      ReduceLightField(field, Everything(), Disc(1e3, 400, 100, 1), Disc(1e3, 400, 100, 2), 0.05);
  const auto before = lightfield::TotalFlux(field), after = lightfield::TotalFlux(reduction.field);
  for (int channel = 0; channel < 3; ++channel)
    EXPECT_NEAR(after[channel], before[channel], 0.05 * before[channel]);
  // What was neither dropped nor rounded away by the last two steps is exact.
  EXPECT_GT(after[1], 0.97 * before[1]);
}

// One image of blocks of 16 x 16 texels, each a number of two bits after the leading one: pooling
// and rounding lose nothing of it.
TEST(Reduction, BlocksOfTexelsBecomeOneEach) {
  lightfield::LuminaireGeometry g = Facets(1, 1, 64).geometry;
  g.channels = 1;
  LightField field(g);
  for (int row = 0; row < 64; ++row)
    for (int column = 0; column < 64; ++column)
      field.image(0, 0)[row * 64 + column] =
          1 + 0.25f * static_cast<float>((row / 16 + 2 * (column / 16)) % 4);
  const auto receivers = Disc(0.5, 0.2, 100, 1);
  const auto reduction = ReduceLightField(field, Everything(), receivers, receivers, 1e-5);
  EXPECT_EQ(reduction.steps[3].setting, "16 x 16 texels");
  EXPECT_EQ(reduction.steps[3].width, 4);
  EXPECT_EQ(reduction.steps[3].height, 4);
  EXPECT_EQ(reduction.steps[5].setting, "mantissa of 3 bits");
  EXPECT_LT(reduction.steps[5].rel_error, 1e-12);
  for (int k = 0; k < 16; ++k)
    EXPECT_EQ(reduction.field.image(0, 0)[k], field.image(0, 0)[k / 4 * 16 * 64 + k % 4 * 16]);
}

// Light that is a small difference of large coefficients: losing the last bit of a float32, 6e-8 of
// a coefficient and 1e-3 of the light, is more than was allowed, and all 23 bits stay.
TEST(Reduction, AllBitsStayWhereEveryOneCounts) {
  lightfield::LuminaireGeometry g = Facets(1, 1, 11).geometry;
  g.grid = lightfield::BasisGrid::Centred(g.grid.basis, 1, 1, 0.15);  // a window of all texels
  g.channels = 1;
  LightField field(g);
  core::Random random(43, 0);
  for (std::size_t k = 0; k < field.data.size(); ++k) {
    const double value = (k % 2 == 0 ? 1.0001 : -1) * (1 + 2e-4 * random.Uniform());
    field.data[k] = static_cast<float>(value);
  }
  const auto receivers = Disc(1e3, 300, 50, 1);
  const auto reduction = ReduceLightField(field, Everything(), receivers, receivers, 1e-5);
  EXPECT_EQ(reduction.steps[5].setting, "mantissa of 23 bits");
  EXPECT_EQ(reduction.field.data, field.data);
}

// What no receiver sees is cut off without any error.
TEST(Reduction, CropLosesNothing) {
  const LightField field = Facets(3, 3, 64);
  scene::Geometry wall;
  wall.materials.emplace_back();
  scene::AppendQuad({-0.1, -0.1, 0.5}, {0.2, 0, 0}, {0, 0.2, 0}, 0, wall);
  const auto seen = SeenByTriangles(wall, field.geometry, {});
  // a = tau x, tau = 0.4; supports end at 2.5 spacings: s = 0.4 * 0.1 + 0.6 * 0.0375.
  EXPECT_NEAR(seen.s1_m, 0.4 * 0.1 + 0.6 * 0.0375, 1e-8);  // float32 corners
  EXPECT_NEAR(seen.t0_m, -seen.s1_m, 1e-12);
  const auto receivers = Disc(0.5, 0.1, 100, 1);
  const auto reduction = ReduceLightField(field, seen, receivers, receivers, 1e-4);
  EXPECT_EQ(reduction.steps[1].name, "crop");
  EXPECT_LT(reduction.steps[1].width, 24);
  EXPECT_LT(reduction.steps[1].rel_error, 1e-12);
}

// A triangle that reaches behind the luminaire is cut where it comes in front.
TEST(Reduction, TrianglesAreClippedAtTheLuminaire) {
  const LightField field = Facets(1, 1, 8);
  scene::Geometry floor;
  floor.materials.emplace_back();
  scene::AppendQuad({-1, -1, -5}, {2, 0, 0}, {0, 0, 15}, 0, floor);
  const auto seen = SeenByTriangles(floor, field.geometry, {});
  // y = -1 at z = 10: a = -0.02, and t falls without bound towards the plane F.
  EXPECT_NEAR(seen.t1_m, -0.02 + 0.98 * 0.0225, 1e-6);
  EXPECT_LT(seen.t0_m, -100);
  scene::Geometry behind;
  behind.materials.emplace_back();
  scene::AppendQuad({-1, -1, -5}, {2, 0, 0}, {0, 0, 4}, 0, behind);
  EXPECT_TRUE(SeenByTriangles(behind, field.geometry, {}).empty());
}

TEST(Reduction, WhatMakesNoSenseIsRefused) {
  const LightField field = Facets(2, 2, 8);
  const auto receivers = Disc(1, 0.3, 10, 1);
  EXPECT_THROW(ReduceLightField(field, Everything(), receivers, receivers, 0), InputError);
  EXPECT_THROW(ReduceLightField(field, Everything(), {}, receivers, 0.01), InputError);
  EXPECT_THROW(ReduceLightField(field, {}, receivers, receivers, 0.01), InputError);
  // Receivers that look away get no light.
  auto away = receivers;
  for (auto& receiver : away) receiver.n = {0, 0, 1};
  EXPECT_THROW(ReduceLightField(field, Everything(), away, receivers, 0.01), InputError);
}

// Texels in windows, against counting them one by one.
TEST(Reduction, TexelsSeenAreThoseOfTheWindows) {
  const LightField field = Facets(3, 2, 40);
  const auto& g = field.geometry;
  const Vec3 p{0.07, -0.11, 0.9};
  const double tau = g.delta_m / p.z;
  double count = 0;
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i)
      for (int row = 0; row < g.lattice.height; ++row)
        for (int column = 0; column < g.lattice.width; ++column) {
          const double s0 = tau * p.x + (1 - tau) * (g.grid.u0_m + i * g.grid.spacing_m);
          const double t0 = tau * p.y + (1 - tau) * (g.grid.v0_m + j * g.grid.spacing_m);
          const double extent = (1 - tau) * 3 * g.grid.spacing_m;
          const bool in_s =
              g.lattice.s_of_column(column + 1) > s0 && g.lattice.s_of_column(column) < s0 + extent;
          const bool in_t =
              g.lattice.t_of_row(row) > t0 && g.lattice.t_of_row(row + 1) < t0 + extent;
          count += in_s && in_t ? 1 : 0;
        }
  EXPECT_EQ(TexelsSeen(g, p), count);
}

}  // namespace
}  // namespace luxfield::preprocess
