// The volume of a web page against the closed form in double precision, its codes, and the error
// that is stated of it.
#include "luxfield/web/lamp_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/web/lamp_volume_fit.h"
#include "tests/seed.h"
#include "tests/web/lamp.h"

namespace luxfield::web {
namespace {

using lightfield::LightField;
using lightfield::Vec2;
using lightfield::Vec3;

LampVolume VolumeOf(const LightField& field) {
  LampVolume volume = EmptyLampVolume(field, "lamp");
  volume.tables = {BuildLampTable(field, volume, Side::kBetween, 0.1, 0.7, {40, 36, 20}, "lamp"),
                   BuildLampTable(field, volume, Side::kFront, 0, 0.8, {44, 40, 14}, "lamp")};
  return volume;
}

// The largest |J*| of all channels at a height.
double BrightestAt(const LampVolume& volume, const LightField& field, double z_m) {
  double brightest = 0;
  for (int k = 0; k < 31 * 31; ++k) {
    const Vec2 q{(k % 31 - 15) / 15.0, (k / 31 - 15) / 15.0};
    const auto judge = lightfield::ClosedFormLightVector(field, PointAt(volume, q, z_m));
    for (const Vec3& j : judge.j) brightest = std::max(brightest, lightfield::Length(j));
  }
  return brightest;
}

// The largest |J - J*| over the largest |J*|, of all channels, at random receivers of a height.
double WorstAt(const LampVolume& volume, const LightField& field, double z_m,
               core::Random& random) {
  double worst = 0;
  for (int k = 0; k < 60; ++k) {
    const Vec2 q{2 * random.Uniform() - 1, 2 * random.Uniform() - 1};
    const Vec3 p = PointAt(volume, q, z_m);
    const auto judge = lightfield::ClosedFormLightVector(field, p), j = LightVectorAt(volume, p);
    for (int channel = 0; channel < 3; ++channel)
      worst = std::max(worst, lightfield::Length(j.j[channel] - judge.j[channel]));
  }
  return worst / BrightestAt(volume, field, z_m);
}

// At every q that is asked for, the last of a row and of a column among them. Moments are float sums.
TEST(LampVolume, SlicesAreTheClosedForm) {
  const LightField field = SmallLamp(3);
  const LampVolume volume = EmptyLampVolume(field, "lamp");
  const std::vector<double> q_x{-0.6, 0.05, 0.3, 0.45}, q_y{-0.4, 0.1, 0.5};
  for (const double z : {0.1, 0.9}) {
    const bool front = z >= volume.delta_m;
    const double w = front ? volume.delta_m / z : z / volume.delta_m;
    const std::vector<float> slice =
        ExactSlice(field, volume.bounds, front ? Side::kFront : Side::kBetween, w, q_x, q_y);
    ASSERT_EQ(slice.size(), q_x.size() * q_y.size() * 9);
    const double scale = front ? w * w : 1, brightest = BrightestAt(volume, field, z);
    for (std::size_t y = 0; y < q_y.size(); ++y)
      for (std::size_t x = 0; x < q_x.size(); ++x) {
        const auto judge =
            lightfield::ClosedFormLightVector(field, PointAt(volume, {q_x[x], q_y[y]}, z));
        const float* k = &slice[(y * q_x.size() + x) * 9];
        for (int channel = 0; channel < 3; ++channel, k += 3)
          EXPECT_LT(lightfield::Length(scale * Vec3{k[0], k[1], k[2]} - judge.j[channel]),
                    1e-4 * brightest)
              << z << ' ' << x << ' ' << y << ' ' << channel;
        EXPECT_GT(lightfield::Length(judge.j[0]), 1e-4 * brightest);
      }
  }
}

// A step of the codes is asinh(100) / 2047 = 0.26 %. Rounding is half of one in each of three
// components, sqrt(3) / 2 of one in length; the spline of a smooth field adds less than one at these
// spacings (a tenth of a blob's width).
TEST(LampVolume, IsTheClosedFormAtAnyDistance) {
  const std::uint64_t seed = TestSeed(7);
  core::Random random(seed, 0);
  for (const int channels : {1, 3}) {
    const LightField field = SmallLamp(channels);
    const LampVolume volume = VolumeOf(field);
    for (const double z : {0.032, 0.06, 0.1, 0.2, 0.38, 0.5, 1.0, 5.0, 20.0, 1e5})
      EXPECT_LT(WorstAt(volume, field, z, random), (std::sqrt(3.0) / 2 + 1) * 2.6e-3)
          << "z " << z << ' ' << channels;
  }
}

// The light that is seen has |q| <= 1: on the box's rim and beyond it is dark, and inside some is lit.
TEST(LampVolume, ItsBoxHoldsAllLight) {
  const LightField field = SmallLamp();
  const LampVolume volume = VolumeOf(field);
  core::Random random(TestSeed(8), 0);
  for (const double z : {0.05, 0.15, 0.45, 3.0}) {
    for (int k = 0; k < 50; ++k) {
      const double side = random.Uniform() < 0.5 ? -1.0001 : 1.0001,
                   other = 3 * random.Uniform() - 1.5;
      const Vec2 q = k % 2 ? Vec2{side, other} : Vec2{other, side};
      const Vec3 p = PointAt(volume, q, z);
      EXPECT_EQ(lightfield::Length(lightfield::ClosedFormLightVector(field, p).j[0]), 0) << z;
      EXPECT_EQ(lightfield::Length(LightVectorAt(volume, p).j[0]), 0) << z;
    }
    // The corners of both rectangles meet at the rim.
    const Vec3 rim = PointAt(volume, {0.999, 0}, z);
    EXPECT_GT(lightfield::Length(lightfield::ClosedFormLightVector(field, rim).j[0]), 0) << z;
  }
}

TEST(LampVolume, LeavesOutWhatHoldsNoLight) {
  LightField field = SmallLamp();
  const auto& g = field.geometry;
  std::fill(field.data.begin(), field.data.end(), 0.0f);
  EXPECT_THROW(BoundsOfLight(field, "dark.lf.exr"), InputError);
  field.image(g.grid.index(2, 1), 0)[5 * g.lattice.width + 7] = 1;
  field.image(g.grid.index(2, 1), 0)[9 * g.lattice.width + 11] = 1;
  const LightBounds bounds = BoundsOfLight(field, "lamp");
  EXPECT_NEAR(bounds.on_f.middle.x, g.grid.centre(2, 1).x, 1e-15);
  EXPECT_NEAR(bounds.on_f.half.y, 1.5 * g.grid.spacing_m, 1e-15);
  EXPECT_NEAR(bounds.on_i.middle.x - bounds.on_i.half.x, g.lattice.s_of_column(7), 1e-15);
  EXPECT_NEAR(bounds.on_i.middle.x + bounds.on_i.half.x, g.lattice.s_of_column(12), 1e-15);
  EXPECT_NEAR(bounds.on_i.middle.y + bounds.on_i.half.y, g.lattice.t_of_row(5), 1e-15);
  EXPECT_NEAR(bounds.on_i.middle.y - bounds.on_i.half.y, g.lattice.t_of_row(10), 1e-15);
}

TEST(LampVolume, IlluminanceKnowsTheHorizon) {
  const LightField field = SmallLamp();
  const LampVolume volume = VolumeOf(field);
  const Vec3 p = PointAt(volume, {0.1, 0.05}, 0.6);
  EXPECT_EQ(HorizonOf(volume, p, {0, 0, -1}), Horizon::kBefore);
  EXPECT_GT(IlluminanceAt(volume, p, {0, 0, -1}), 0);
  EXPECT_EQ(HorizonOf(volume, p, {0, 0, 1}), Horizon::kBehind);
  EXPECT_EQ(IlluminanceAt(volume, p, {0, 0, 1}), 0);
  const Vec3 beside{volume.bounds.on_f.middle.x, volume.bounds.on_f.middle.y, 0.5};
  EXPECT_EQ(HorizonOf(volume, beside, {1, 0, 0}), Horizon::kCut);
  EXPECT_GE(IlluminanceAt(volume, beside, {1, 0, 0}), 0);
  EXPECT_EQ(IlluminanceAt(volume, {0, 0, 0.001}, {0, 0, -1}), 0);  // nearer than the tables
}

// The order of the bytes is stated in docs/web.md; a stranger's reader relies on it.
TEST(LampVolume, CodesAreOfTwelveBitsAndComeBack) {
  const LightField field = SmallLamp();
  const LampVolume empty = EmptyLampVolume(field, "lamp");
  const TableSize size{11, 9, 5};
  const LampTable table = BuildLampTable(field, empty, Side::kFront, 0, 1, size, "lamp");
  ASSERT_EQ(table.codes.size(), 3 * size.coefficients());
  const auto [least, most] = std::minmax_element(table.codes.begin(), table.codes.end());
  EXPECT_GE(*least, -2047);
  EXPECT_LE(*most, 2047);
  EXPECT_TRUE(*least == -2047 || *most == 2047);
  auto packed = PackCodes(table, 1);
  EXPECT_EQ(UnpackCodes(packed, size, 1), table.codes);
  EXPECT_THROW(UnpackCodes(packed, {12, 9, 5}, 1), InputError);
  packed.resize(packed.size() / 2);
  EXPECT_THROW(UnpackCodes(packed, size, 1), InputError);
}

// What is stated holds at other receivers than those that it was measured at.
TEST(LampVolume, StatedErrorHoldsElsewhere) {
  const std::uint64_t seed = TestSeed(9);
  const LightField field = SmallLamp();
  FitOptions options;
  options.max_bytes = 60000;
  options.max_error = 0.01;
  options.receivers = 400;
  const FittedVolume fitted = FitLampVolume(field, options, "lamp");
  EXPECT_LE(fitted.packed_bytes(), options.max_bytes);
  ASSERT_EQ(fitted.zones.size(), 5u);
  EXPECT_DOUBLE_EQ(fitted.zones.front().z_first_m, 0.02);
  EXPECT_DOUBLE_EQ(fitted.zones.back().z_last_m, 20);
  for (std::size_t k = 0; k + 1 < fitted.zones.size(); ++k)
    EXPECT_NEAR(fitted.zones[k].z_last_m, fitted.zones[k + 1].z_first_m, 1e-12);
  for (const ErrorZone& zone : fitted.zones) {
    const auto receivers =
        LitReceivers(field, fitted.volume, zone.z_first_m, zone.z_last_m, 200, seed + 100);
    double largest = 0, squares = 0, sum = 0;
    for (const auto& [p, n] : receivers) {
      const double exact = core::Luminance(lightfield::ExactIrradiance(field, p, n));
      const double error = std::abs(IlluminanceAt(fitted.volume, p, n) - exact);
      largest = std::max(largest, error / std::max(std::abs(exact),
                                                   kFloorShare * BrightestAt(fitted.volume, p.z)));
      squares += error * error;
      sum += exact;
    }
    const double rmse = std::sqrt(squares * double(receivers.size())) / sum;
    std::printf("z %.3f to %.3f m: stated %.4f, found %.4f; rel_rmse %.5f, found %.5f\n",
                zone.z_first_m, zone.z_last_m, zone.stated_error, largest, zone.rel_rmse, rmse);
    EXPECT_LE(largest, zone.stated_error);
    EXPECT_GT(zone.stated_error, 0);
    EXPECT_LT(rmse, 3 * zone.rel_rmse + 1e-6);
  }
  EXPECT_LT(fitted.zones.back().rel_rmse, 0.01);
}

}  // namespace
}  // namespace luxfield::web
