// The light-vector volume against the closed form in double: at its nodes, between them, at the
// extremes of docs/theory.md 12, and for an error target.
#include "luxfield/preprocess/light_vector_volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "tests/seed.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 72;
constexpr double kAnyTau = std::numeric_limits<double>::infinity();

// Off the axis and with no two lengths alike, so that a swapped axis or a lost centre shows.
lightfield::LuminaireGeometry Geometry(int channels = 1, BasisKind kind = BasisKind::kBspline2) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(Basis::Make(kind), 4, 3, 0.0165);
  g.grid.u0_m += 0.011;
  g.grid.v0_m -= 0.007;
  g.lattice = {40, 36, -0.14, 0.13, 0.007, 0.0065};
  g.channels = channels;
  return g;
}

// Independent texels in [lo, hi).
LightField Grain(const lightfield::LuminaireGeometry& geometry, double lo = 0.1, double hi = 1) {
  LightField field(geometry);
  core::Random random(kSeed, 1);
  for (float& c : field.data) c = static_cast<float>(lo + (hi - lo) * random.Uniform());
  return field;
}

// A blob per image, wide against texels and knots.
LightField Smooth() {
  auto g = Geometry();
  g.lattice = {160, 144, -0.14, 0.13, 0.00175, 0.001625};
  LightField field(g);
  for (int m = 0; m < g.grid.count(); ++m)
    for (int r = 0; r < g.lattice.height; ++r)
      for (int c = 0; c < g.lattice.width; ++c) {
        const auto s = g.lattice.centre(r, c);
        const double x = (s.x - 0.005 * m) / 0.04, y = (s.y + 0.004 * m) / 0.035;
        field.image(m, 0)[r * g.lattice.width + c] =
            static_cast<float>(std::exp(-0.5 * (x * x + y * y)));
      }
  return field;
}

Vec3 AtNode(const LightVectorVolume& volume, int x, int y, int k) {
  const double tau = volume.tau.first + k * volume.tau.spacing;
  const auto centre = SupportCentre(volume.geometry);
  return {centre.x + (volume.a_x.first + x * volume.a_x.spacing) / tau,
          centre.y + (volume.a_y.first + y * volume.a_y.spacing) / tau,
          volume.geometry.delta_m / tau};
}

// Largest |J - J*| of an inner node over the largest |J*| of its slice.
double WorstAtNodes(const LightVectorVolume& volume, const LightField& field) {
  double worst = 0;
  for (int k = 0; k < volume.tau.nodes; ++k) {
    double error = 0, brightest = 0;
    for (int y = 1; y + 1 < volume.a_y.nodes; ++y)
      for (int x = 1; x + 1 < volume.a_x.nodes; ++x) {
        const Vec3 p = AtNode(volume, x, y, k);
        const auto judge = lightfield::ClosedFormLightVector(field, p);
        // The outermost nodes may round to the far side of the range.
        const double inward = k == 0 ? 1 - 1e-9 : k + 1 == volume.tau.nodes ? 1 + 1e-9 : 1;
        const auto vector = InterpolateLightVector(volume, {p.x, p.y, p.z * inward});
        if (!vector) {
          ADD_FAILURE() << "node " << x << ' ' << y << ' ' << k << " is not covered";
          return 0;
        }
        for (int channel = 0; channel < 3; ++channel) {
          error = std::max(error, Length(vector->j[channel] - judge.j[channel]));
          brightest = std::max(brightest, Length(judge.j[channel]));
        }
      }
    worst = std::max(worst, error / brightest);
  }
  return worst;
}

const Reach kFront{{-0.05, 0.06}, {-0.04, 0.05}, {0.05, 0.6}};

// Float32 rounds each of 6 coefficients in a row of the spline, and the weights and sums of a
// window: about 1e-6 in all.
TEST(LightVectorVolume, NodesAreTheClosedForm) {
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2})
    for (const int channels : {1, 3}) {
      const LightField field = Grain(Geometry(channels, kind));
      const auto volume = BuildLightVectorVolume(field, kFront, {9, 8, 5});
      EXPECT_EQ(volume.bytes(), VolumeBytes({9, 8, 5}, channels));
      const double worst = WorstAtNodes(volume, field);
      EXPECT_LT(worst, 2e-6) << field.geometry.grid.basis.name() << ' ' << channels;
    }
}

// On I and between the planes, where windows shrink to texels and turn round.
TEST(LightVectorVolume, NodesOnAndBehindTheImagePlane) {
  const LightField field = Grain(Geometry());
  const Reach reach{{-0.041, 0.043}, {-0.042, 0.039}, {0.8, 1.2}};
  const auto volume = BuildLightVectorVolume(field, reach, {8, 7, 5});
  EXPECT_NEAR(volume.tau.first + 2 * volume.tau.spacing, 1, 1e-12);
  EXPECT_LT(WorstAtNodes(volume, field), 2e-6);
  const auto near = BuildLightVectorVolume(field, {{-0.2, 0.2}, {-0.2, 0.2}, {2, 40}}, {8, 7, 5});
  EXPECT_LT(WorstAtNodes(near, field), 2e-6);
}

double ErrorAt(const LightField& field, const Reach& reach, const VolumeResolution& resolution) {
  const auto volume = BuildLightVectorVolume(field, reach, resolution);
  return VolumeError(volume, field, RandomReceivers(field.geometry, reach, 400, kSeed));
}

TEST(LightVectorVolume, SmoothImagesConvergeInFourthOrder) {
  const LightField field = Smooth();
  const Reach reach{{-0.1, 0.1}, {-0.1, 0.1}, {0.05, 0.4}};
  const double coarse = ErrorAt(field, reach, {8, 8, 5}), fine = ErrorAt(field, reach, {15, 15, 9});
  std::printf("relative RMSE %.2e, %.2e\n", coarse, fine);
  EXPECT_GT(coarse / fine, 12);
}

// Nodes closer than texels: the jumps of bspline2's third derivative at texel edges show.
TEST(LightVectorVolume, RoughImagesConvergeInThirdOrder) {
  const LightField field = Grain(Geometry());
  const Reach reach{{-0.01, 0.012}, {-0.009, 0.01}, {0.1, 0.15}};
  const double coarse = ErrorAt(field, reach, {17, 17, 17}),
               fine = ErrorAt(field, reach, {33, 33, 33});
  std::printf("relative RMSE %.2e, %.2e\n", coarse, fine);
  EXPECT_GT(coarse / fine, 6);
  EXPECT_LT(coarse / fine, 11);
}

// VolumeError against the same sums over ExactIrradiance.
TEST(LightVectorVolume, ErrorIsTheRelativeRmse) {
  const LightField field = Grain(Geometry(3));
  const auto volume = BuildLightVectorVolume(field, kFront, {9, 9, 5});
  auto receivers = RandomReceivers(field.geometry, kFront, 300, kSeed);
  ASSERT_EQ(receivers.size(), 300u);
  double squares = 0, sum = 0;
  for (const auto& [p, n] : receivers) {
    const auto judge = lightfield::ExactIrradiance(field, p, n);
    const auto vector = InterpolateLightVector(volume, p);
    ASSERT_TRUE(vector);
    for (int channel = 0; channel < 3; ++channel) {
      squares += std::pow(Dot(n, vector->j[channel]) - judge[channel], 2);
      sum += judge[channel];
    }
  }
  const double rmse = std::sqrt(squares / 900), mean = sum / 900;
  EXPECT_NEAR(VolumeError(volume, field, receivers), rmse / mean, 1e-12);
  EXPECT_GT(rmse, 0);
  // The closed form's receivers are right, but count: dim ones, cut by their horizon, make the same
  // error a larger share of the mean. What sees no light does not.
  double count = 900;
  for (int k = 0; k < 200; ++k) {
    receivers.push_back({{-0.01 - 0.0002 * k, 0, 3}, Normalized(Vec3{1, 0, -0.002})});
    const auto judge = lightfield::ExactIrradiance(field, receivers.back().p, receivers.back().n);
    ASSERT_GT(judge[0], 0) << k;
    for (const double e : judge) sum += e;
    count += 3;
  }
  receivers.push_back({{0, 0, -1}, {0, 0, -1}});
  receivers.push_back({{90, 0, 1}, {0, 0, -1}});
  const double among_all = std::sqrt(squares / count) / (sum / count);
  EXPECT_GT(among_all, 1.1 * rmse / mean);
  EXPECT_NEAR(VolumeError(volume, field, receivers), among_all, 1e-8 * among_all);
}

// Bright receivers that the volume does not light do not hide what it errs by.
TEST(LightVectorVolume, ErrorIsNotHiddenByTheClosedForm) {
  const LightField field = Grain(Geometry());
  const auto volume = BuildLightVectorVolume(field, kFront, {9, 9, 5});
  std::vector<Receiver> receivers;
  for (const Receiver& receiver : RandomReceivers(field.geometry, kFront, 300, kSeed))
    if (receiver.p.z > 2) receivers.push_back(receiver);
  ASSERT_GT(receivers.size(), 20u);
  const double alone = VolumeError(volume, field, receivers);
  for (int k = 0; k < 100; ++k) receivers.push_back({{0.02, 0.01, 0.31}, {0, 0, -1}});
  EXPECT_NEAR(VolumeError(volume, field, receivers), alone, 1e-12);
  EXPECT_GT(alone, 0);
}

TEST(Reach, HoldsReceiversAndTriangles) {
  const LightField field = Grain(Geometry());
  const auto& g = field.geometry;
  core::Random random(kSeed, 2);
  const auto point = [&] {
    return Vec3{0.4 * (random.Uniform() - 0.5), 0.4 * (random.Uniform() - 0.5),
                0.5 + 2 * random.Uniform()};
  };
  int lit = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Receiver corners[] = {
        {point(), {0, 0, -1}}, {point(), {0, 0, -1}}, {point(), {0, 0, -1}}};
    const auto all_lit = [&] {
      for (const auto& corner : corners)
        if (!VolumeLights(g, corner, 0.6)) return false;
      return true;
    };
    if (!all_lit()) continue;
    ++lit;
    const Reach reach = ReachOf(g, corners, 0.6);
    const auto volume = BuildLightVectorVolume(field, reach, {4, 4, 4});
    double u = random.Uniform(), v = random.Uniform();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3 p =
        corners[0].p + u * (corners[1].p - corners[0].p) + v * (corners[2].p - corners[0].p);
    EXPECT_TRUE(volume.Covers(CoordinatesOf(g, p)));
    for (const auto& corner : corners) EXPECT_TRUE(volume.Covers(CoordinatesOf(g, corner.p)));
  }
  EXPECT_GT(lit, 50);
}

TEST(Reach, LeavesOutWhatAVolumeDoesNotLight) {
  const auto g = Geometry();
  const Receiver dark[] = {{{0, 0, -1}, {0, 0, -1}},   // behind
                           {{0, 0, 0}, {0, 0, -1}},    // on F
                           {{50, 0, 1}, {0, 0, -1}},   // sees no image
                           {{0, 0, 0.4}, {0, 0, -1}},  // tau above 0.6
                           {{0, 0, 1}, {1, 0, 0}},     // horizon through the lamp
                           {{0, 0, 1}, {0, 0, 1}}};    // back to the lamp
  EXPECT_TRUE(ReachOf(g, dark, 0.6).empty());
  const auto volume = BuildLightVectorVolume(Grain(g), ReachOf(g, dark, 0.6), {4, 4, 4});
  EXPECT_EQ(volume.bytes(), 0u);
  EXPECT_FALSE(InterpolateLightVector(volume, {0, 0, 1}));
  EXPECT_EQ(Length(InterpolateLightVector(volume, {0, 0, -1})->j[0]), 0);
  EXPECT_EQ(Length(InterpolateLightVector(volume, {50, 0, 1})->j[0]), 0);
}

TEST(LightVectorVolume, OneDepthOnePointAndFarAway) {
  const LightField field = Grain(Geometry());
  const auto& g = field.geometry;
  for (const double z : {0.5, 1.0, 1e3, 1e6}) {
    const double spread = 0.05 * z / g.delta_m;
    const std::vector<Receiver> one_depth{{{-spread, -0.02 * z, z}, {0, 0, -1}},
                                          {{spread, 0.03 * z, z}, {0, 0, -1}}};
    const std::vector<Receiver> point{{{0.01 * z, 0.02 * z, z}, {0, 0, -1}}};
    for (const auto& receivers : {one_depth, point}) {
      const Reach reach = ReachOf(g, receivers, kAnyTau);
      ASSERT_FALSE(reach.empty());
      const auto volume = BuildLightVectorVolume(field, reach, {65, 65, 4});
      for (const auto& receiver : receivers) {
        const auto vector = InterpolateLightVector(volume, receiver.p);
        ASSERT_TRUE(vector) << z;
        const auto judge = lightfield::ClosedFormLightVector(field, receiver.p);
        EXPECT_LT(Length(vector->j[0] - judge.j[0]), 1e-4 * Length(judge.j[0])) << z;
      }
    }
  }
}

TEST(LightVectorVolume, DarkImagesOneTexelAndNegativeCoefficients) {
  LightField field(Geometry());
  const auto& g = field.geometry;
  for (const float c : BuildLightVectorVolume(field, kFront, {5, 5, 4}).coefficients)
    EXPECT_EQ(c, 0);
  // One texel is seen by few nodes: its light is the product of three splines there.
  const int m = g.grid.index(2, 1);
  field.image(m, 0)[18 * g.lattice.width + 21] = 1e8f;
  const auto one = BuildLightVectorVolume(field, kFront, {33, 33, 5});
  double largest = 0, worst = 0;
  for (int k = 0; k < one.tau.nodes; ++k) {
    for (int y = 0; y < 33; ++y)
      for (int x = 0; x < 33; ++x) {
        const Vec3 p = AtNode(one, x, y, k);
        const auto judge = lightfield::ClosedFormLightVector(field, p);
        const auto vector = InterpolateLightVector(
            one, {p.x * (1 - 1e-9), p.y * (1 - 1e-9), p.z * (k == 0 ? 1 - 1e-9 : 1)});
        if (!vector) continue;
        const double to_b = p.z * p.z * p.z;  // J / z^2 is comparable between depths
        largest = std::max(largest, to_b * Length(judge.j[0]));
        worst = std::max(worst, to_b * Length(vector->j[0] - judge.j[0]));
      }
  }
  EXPECT_GT(largest, 0);
  EXPECT_LT(worst, 3e-6 * largest);
  // The sum is linear in C.
  const LightField grain = Grain(Geometry(), -1, 1);
  const auto volume = BuildLightVectorVolume(grain, kFront, {9, 9, 5});
  const Vec3 p = AtNode(volume, 4, 5, 2);
  const auto judge = lightfield::ClosedFormLightVector(grain, p),
             bright = lightfield::ClosedFormLightVector(Grain(Geometry(), 1, 1), p);
  EXPECT_LT(Length(InterpolateLightVector(volume, p)->j[0] - judge.j[0]),
            2e-6 * Length(bright.j[0]));
}

TEST(LightVectorVolume, RefusesWhatMakesNoSense) {
  LightField field = Grain(Geometry());
  EXPECT_THROW(BuildLightVectorVolume(field, kFront, {3, 8, 8}), InputError);
  EXPECT_THROW(BuildForError(field, kFront, {}, {.max_rel_error = 0}), InputError);
  EXPECT_THROW(BuildForError(field, kFront, {}, {.max_rel_error = std::nan("")}), InputError);
  field.image(5, 0)[18 * field.geometry.lattice.width + 20] =
      std::numeric_limits<float>::infinity();
  EXPECT_THROW(BuildLightVectorVolume(field, kFront, {9, 9, 5}), InputError);
  field.data.assign(field.data.size(), 3e38f);
  field.geometry.grid.spacing_m = 1e3;
  field.geometry.lattice = {40, 36, -2e3, 2e3, 100, 100};
  EXPECT_THROW(BuildLightVectorVolume(field, {{-1e3, 1e3}, {-1e3, 1e3}, {0.1, 0.2}}, {4, 4, 4}),
               InputError);
}

TEST(BuildForError, MeetsItsTargetAtOtherReceivers) {
  const LightField field = Smooth();
  const Reach reach{{-0.1, 0.1}, {-0.1, 0.1}, {0.2, 0.4}};
  const auto receivers = RandomReceivers(field.geometry, reach, 2000, kSeed),
             others = RandomReceivers(field.geometry, reach, 2000, kSeed + 1);
  std::size_t bytes = 0;
  for (const double target : {3e-2, 1e-4, 1e-6}) {
    const auto fit = BuildForError(field, reach, receivers, {.max_rel_error = target});
    EXPECT_TRUE(fit.met);
    EXPECT_LE(fit.rel_error, target);
    EXPECT_GT(fit.volume.bytes(), bytes);
    bytes = fit.volume.bytes();
    const double other = VolumeError(fit.volume, field, others);
    std::printf("target %.0e: %d builds, %d x %d x %d nodes, error %.2e, elsewhere %.2e\n", target,
                fit.builds, fit.volume.a_x.nodes, fit.volume.a_y.nodes, fit.volume.tau.nodes,
                fit.rel_error, other);
    // An RMS over 2000 receivers of which the brightest tenth decides is known to some 10 %.
    EXPECT_LT(other, 1.4 * fit.rel_error);
    EXPECT_GT(other, fit.rel_error / 1.4);
  }
}

// A street far away and, in a hundredth of the picture, a post near the lamp with the beam's upper
// edge on it: splines swing beside the edge, which shows as bands where it is dark.
TEST(BuildForReceivers, AnEdgeOnFewReceiversNearTheLampMakesNoBands) {
  LightField field = Smooth();
  const auto& g = field.geometry;
  for (int m = 0; m < g.grid.count(); ++m)
    for (std::size_t k = 0; k < g.plane_size(); ++k)
      field.image(m, 0)[k] *=
          g.lattice.centre(static_cast<int>(k) / g.lattice.width, 0).y < 0 ? 1 : 1e-4f;
  const std::uint64_t seed = TestSeed(kSeed);
  core::Random random(seed, 2);
  const auto between = [&](double low, double high) {
    return low + (high - low) * random.Uniform();
  };
  std::vector<Receiver> receivers, post;
  for (int k = 0; k < 20000; ++k) {
    const double z = 0.3 / between(0.05, 0.1);
    receivers.push_back({{between(-0.4, 0.4) * z, between(-0.4, 0.4) * z, z}, {0, 0, -1}});
  }
  for (int k = 0; k < 200; ++k)
    post.push_back({{between(-0.02, 0.02), between(-0.1, 0.1), 0.45}, {0, 0, -1}});
  receivers.insert(receivers.end(), post.begin(), post.end());
  const auto fit = BuildForReceivers(field, receivers, {}, 1500, seed);
  EXPECT_TRUE(fit.met);
  double mean = 0, largest = 0;
  for (const JudgedReceiver& one : fit.judges)
    mean += one.irradiance[0] / static_cast<double>(fit.judges.size());
  for (const Receiver& receiver : post) {
    const auto vector = InterpolateLightVector(fit.volume, receiver.p);
    ASSERT_TRUE(vector);
    const double truth = lightfield::ExactIrradiance(field, receiver.p, receiver.n)[0];
    largest = std::max(largest, std::abs(Dot(receiver.n, vector->j[0]) - truth) / (truth + mean));
  }
  std::printf("%d builds, %d x %d x %d nodes, largest error %.4f\n", fit.builds,
              fit.volume.a_x.nodes, fit.volume.a_y.nodes, fit.volume.tau.nodes, largest);
  EXPECT_LT(largest, 0.05);
}

// A volume of one column at a time, and what it is judged by.
TEST(BuildForReceivers, GroupsOfColumnsMakeTheSameVolume) {
  for (const int channels : {1, 3}) {
    const LightField field = Grain(Geometry(channels));
    const lightfield::FieldColumns columns(
        field.geometry, [&](const lightfield::FieldColumns::Visitor& visit) {
          for (const auto& column : lightfield::GroupsOf(field.geometry, 1)) {
            LightField group(column.GeometryIn(field.geometry));
            for (int m = 0; m < group.geometry.grid.count(); ++m)
              for (int c = 0; c < channels; ++c)
                std::ranges::copy(field.image(column.ImageIn(field.geometry, m), c),
                                  group.image(m, c).begin());
            visit(group, column.first);
          }
        });
    const auto receivers = RandomReceivers(field.geometry, kFront, 400, kSeed);
    const auto whole = BuildForReceivers(field, receivers, {.max_rel_error = 0.01}),
               summed = BuildForReceivers(columns, receivers, {.max_rel_error = 0.01});
    ASSERT_GT(whole.volume.bytes(), 0u);
    EXPECT_EQ(summed.volume.coefficients, whole.volume.coefficients);
    EXPECT_EQ(summed.builds, whole.builds);
    EXPECT_NEAR(summed.rel_error, whole.rel_error, 1e-9);
    ASSERT_EQ(summed.judges.size(), whole.judges.size());
    for (std::size_t k = 0; k < whole.judges.size(); ++k)
      EXPECT_NEAR(summed.judges[k].irradiance[0], whole.judges[k].irradiance[0],
                  1e-12 * whole.judges[k].irradiance[0]);
  }
}

TEST(BuildForError, SaysSoWhenBytesRunOut) {
  const LightField field = Grain(Geometry());
  const auto receivers = RandomReceivers(field.geometry, kFront, 100, kSeed);
  const auto fit = BuildForError(field, kFront, receivers,
                                 {.max_rel_error = 1e-7, .max_bytes = std::size_t{1} << 20});
  EXPECT_FALSE(fit.met);
  EXPECT_LE(fit.volume.bytes(), std::size_t{1} << 20);
  EXPECT_GT(fit.rel_error, 1e-7);
  const auto none = BuildForError(field, kFront, receivers, {.max_bytes = 100});
  EXPECT_FALSE(none.met);
  EXPECT_EQ(none.builds, 0);
  EXPECT_EQ(none.volume.bytes(), 0u);
  const auto empty = BuildForError(field, {}, {}, {});
  EXPECT_TRUE(empty.met);
  EXPECT_EQ(empty.volume.bytes(), 0u);
}

}  // namespace
}  // namespace luxfield::preprocess
