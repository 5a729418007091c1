// The closed form against quadrature of the physics: E = integral of radiance x solid angle x
// receiver cosine, radiance from its definition, Gauss-Legendre between every knot and texel border
// in double. No formula is shared with the closed form.
#include "luxfield/lightfield/light_vector.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support.h"

namespace luxfield::lightfield {
namespace {

LuminaireGeometry TinyGeometry(const Basis& basis) {
  LuminaireGeometry g = SmallGeometry(basis);
  g.grid = BasisGrid::Centred(basis, 3, 2, 0.021);
  g.grid.u0_m += 0.004;
  g.lattice = {7, 6, -0.11, 0.095, 0.031, 0.029};
  return g;
}

// A receiver that sees light: on the line through a random point of the supports and one of the
// lattice, at z.
Vec3 LitPoint(const LuminaireGeometry& g, core::Random& random, double z) {
  const double cells_u = g.grid.width + g.grid.basis.cells - 1;
  const double cells_v = g.grid.height + g.grid.basis.cells - 1;
  const Vec2 u{g.grid.u0_m + g.grid.spacing_m * cells_u * random.Uniform(),
               g.grid.v0_m + g.grid.spacing_m * cells_v * random.Uniform()};
  const Vec2 s{g.lattice.s0_m + g.lattice.extent_s_m() * random.Uniform(),
               g.lattice.t1_m - g.lattice.extent_t_m() * random.Uniform()};
  const Vec2 p = u + (z / g.delta_m) * (s - u);
  return {p.x, p.y, z};
}

Vec3 RandomDirection(core::Random& random) {
  const double z = 2 * random.Uniform() - 1, phi = 2 * std::numbers::pi * random.Uniform();
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// Radiance towards p from u, times the solid angle per du at p, and the unit vector from p to u.
struct Arrival {
  double radiance_solid_angle;
  Vec3 w;
};
Arrival Arriving(const LightField& field, Vec2 u, Vec3 p) {
  const double delta = field.geometry.delta_m, distance = p.z - delta;
  const Vec2 s{(u.x * distance + p.x * delta) / p.z, (u.y * distance + p.y * delta) / p.z};
  const Vec3 to_lamp = Vec3{u.x, u.y, 0} - p;
  const double r = Length(to_lamp);
  return {Radiance(field, u, s)[0] * (p.z / r) / (r * r), (1 / r) * to_lamp};
}

double OnF(double s, double p, double z, double delta) { return s + (s - p) * delta / (z - delta); }

Vec3 QuadratureVector(const LightField& field, Vec3 p) {
  const LuminaireGeometry& g = field.geometry;
  const auto us =
      GaussNodes(BreakpointsU(g, [&](double s) { return OnF(s, p.x, p.z, g.delta_m); }));
  const auto vs =
      GaussNodes(BreakpointsV(g, [&](double t) { return OnF(t, p.y, p.z, g.delta_m); }));
  Vec3 sum;
  for (const Node& v : vs)
    for (const Node& u : us) {
      const Arrival a = Arriving(field, {u.x, v.x}, p);
      sum = sum + (u.weight * v.weight * a.radiance_solid_angle) * a.w;
    }
  return sum;
}

// With the receiver's horizon: nested integrals whose limits follow the horizon n . (u - p) = 0.
double QuadratureIrradiance(const LightField& field, Vec3 p, Vec3 n) {
  const LuminaireGeometry& g = field.geometry;
  auto xs = BreakpointsU(g, [&](double s) { return OnF(s, p.x, p.z, g.delta_m); });
  const auto ys = BreakpointsV(g, [&](double t) { return OnF(t, p.y, p.z, g.delta_m); });
  const double x_lo = xs.front(), x_hi = xs.back();
  for (const double y : ys)
    if (n.x != 0) xs.push_back(std::clamp(p.x + (n.z * p.z - n.y * (y - p.y)) / n.x, x_lo, x_hi));
  std::sort(xs.begin(), xs.end());
  double sum = 0;
  for (const Node& u : GaussNodes(xs)) {
    auto inner = ys;
    if (n.y != 0)
      inner.push_back(
          std::clamp(p.y + (n.z * p.z - n.x * (u.x - p.x)) / n.y, ys.front(), ys.back()));
    std::sort(inner.begin(), inner.end());
    for (const Node& v : GaussNodes(inner)) {
      const Arrival a = Arriving(field, {u.x, v.x}, p);
      sum += u.weight * v.weight * a.radiance_solid_angle * std::max(0.0, Dot(n, a.w));
    }
  }
  return sum;
}

double LogUniform(core::Random& random, double lo, double hi) {
  return lo * std::pow(hi / lo, random.Uniform());
}

TEST(LightVector, MatchesQuadratureAt1000RandomReceivers) {
  constexpr std::uint64_t kSeed = 41;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  double worst = 0;
  int cut = 0;
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    const LightField field = RandomField(TinyGeometry(Basis::Make(kind)), kSeed);
    for (int k = 0; k < 250; ++k) {
      const double z = field.geometry.delta_m + LogUniform(random, 0.05, 100);
      const Vec3 p = LitPoint(field.geometry, random, z);
      const Vec3 expected = QuadratureVector(field, p);
      const Vec3 j = ClosedFormLightVector(field, p).j[0];
      const double error = Length(j - expected) / Length(expected);
      worst = std::max(worst, error);
      EXPECT_LT(error, 1e-11) << "p = " << p.x << ' ' << p.y << ' ' << p.z;
      // The irradiance of a random normal that sees the whole luminaire.
      const Vec3 n = RandomDirection(random);
      if (HorizonCutsSupport(field.geometry, p, n)) {
        ++cut;
        continue;
      }
      EXPECT_NEAR(ExactIrradiance(field, p, n)[0], Dot(n, expected), 1e-11 * Length(expected));
    }
  }
  RecordProperty("worst_relative_error", fmt::format("{:.2e}", worst));
  EXPECT_LT(cut, 700);
}

TEST(LightVector, ReceiversWhoseHorizonCutsTheLuminaire) {
  constexpr std::uint64_t kSeed = 42;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  double worst = 0;
  for (const BasisKind kind : {BasisKind::kBox, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    const LightField field = RandomField(TinyGeometry(Basis::Make(kind)), kSeed);
    for (int k = 0; k < 100; ++k) {
      // Every fourth between the planes.
      const double delta = field.geometry.delta_m;
      const double z = k % 4 == 0 ? delta * (0.1 + 0.8 * random.Uniform())
                                  : delta + LogUniform(random, 0.05, 100);
      const Vec3 p = LitPoint(field.geometry, random, z);
      // A normal whose horizon passes through a random point of the supports.
      const Vec3 on_f{0.05 * random.Uniform() - 0.02, 0.04 * random.Uniform() - 0.02, 0};
      const Vec3 n = Normalized(Cross(on_f - p, RandomDirection(random)));
      ASSERT_TRUE(HorizonCutsSupport(field.geometry, p, n));
      const double expected = QuadratureIrradiance(field, p, n);
      const double scale = Length(QuadratureVector(field, p));
      const double error = std::abs(ExactIrradiance(field, p, n)[0] - expected) / scale;
      worst = std::max(worst, error);
      EXPECT_LT(error, 1e-11) << "p = " << p.x << ' ' << p.y << ' ' << p.z << " n = " << n.x << ' '
                              << n.y << ' ' << n.z;
      // Both sides of a horizon together are the whole light vector.
      const double other = ExactIrradiance(field, p, -1 * n)[0];
      EXPECT_NEAR(ExactIrradiance(field, p, n)[0] - other,
                  Dot(n, ClosedFormLightVector(field, p).j[0]), 1e-11 * scale);
    }
  }
  RecordProperty("worst_relative_error", fmt::format("{:.2e}", worst));
}

TEST(LightVector, BetweenThePlanesAndJustBeforeAndBehindI) {
  constexpr std::uint64_t kSeed = 43;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  const LightField field =
      RandomField(TinyGeometry(Basis::Make(BasisKind::kBspline2)), kSeed, -0.3, 1);
  const double delta = field.geometry.delta_m;
  for (const double z : {0.01 * delta, 0.3 * delta, 0.9 * delta, delta - 1e-3, delta - 1e-6,
                         delta - 1e-9, delta + 1e-9, delta + 1e-6, delta + 1e-3, delta + 0.02})
    for (int k = 0; k < 20; ++k) {
      const Vec3 p = LitPoint(field.geometry, random, z);
      const Vec3 expected = QuadratureVector(field, p);
      // Both sides place texel borders on F with an error of |s| ulp delta/D; at 1 nm that is 2e-8
      // of a knot.
      const double tolerance = 1e-11 + 1e-17 / std::abs(z - delta);
      EXPECT_LT(Length(ClosedFormLightVector(field, p).j[0] - expected),
                tolerance * Length(expected) + 1e-300)
          << "z = " << z;
    }
}

TEST(LightVector, OnIOneTexelIsSeen) {
  const LightField field = RandomField(TinyGeometry(Basis::Make(BasisKind::kBspline2)), 44);
  const LuminaireGeometry& g = field.geometry;
  const Vec2 s = g.lattice.centre(2, 3) + Vec2{0.003, -0.002};
  const Vec3 p{s.x, s.y, g.delta_m};
  // D = 0: C is a constant of the receiver, and the moments of a B-spline are its integral and
  // centre.
  Vec3 expected;
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i) {
      const Vec2 c = g.grid.centre(i, j);
      expected = expected + (field.image(g.grid.index(i, j), 0)[2 * 7 + 3] * 0.021 * 0.021) *
                                (Vec3{c.x, c.y, 0} - p);
    }
  expected = (1 / g.delta_m) * expected;
  EXPECT_LT(Length(ClosedFormLightVector(field, p).j[0] - expected), 1e-13 * Length(expected));
  for (const double d : {1e-9, -1e-9, 1e-12, -1e-12})
    EXPECT_LT(Length(ClosedFormLightVector(field, {p.x, p.y, p.z + d}).j[0] - expected),
              1e-7 * Length(expected));
}

// A micrometre in front of F only u = p is seen; quadrature over I instead of F, where nothing is
// small.
TEST(LightVector, JustInFrontOfF) {
  const LightField field = RandomField(TinyGeometry(Basis::Make(BasisKind::kBspline2)), 45);
  const LuminaireGeometry& g = field.geometry;
  for (const double z : {1e-3, 1e-6, 1e-9, 1e-12}) {
    const Vec3 p{0.0071, 0.0033, z};
    std::vector<double> xs, ys;
    for (int c = 0; c <= 7; ++c)
      for (int part = 0; part < 8; ++part) xs.push_back(g.lattice.s_of_column(c + part / 8.0));
    for (int r = 6; r >= 0; --r)
      for (int part = 0; part < 8; ++part) ys.push_back(g.lattice.t_of_row(r - part / 8.0));
    xs.resize(7 * 8 + 1);
    ys.resize(6 * 8 + 1);
    Vec3 expected;
    for (const Node& t : GaussNodes(ys))
      for (const Node& s : GaussNodes(xs)) {
        const Vec3 to_i = Vec3{s.x, t.x, g.delta_m} - p;
        const double r = Length(to_i), k = z / (g.delta_m - z);
        const Vec2 u{p.x - k * (s.x - p.x), p.y - k * (t.x - p.y)};
        const double solid_angle = to_i.z / (r * r * r);
        expected =
            expected +
            (-s.weight * t.weight * solid_angle * Radiance(field, u, {s.x, t.x})[0] / r) * to_i;
      }
    // Knots are not broken at: at 1 mm the kinks of Phi pass through the windows.
    EXPECT_LT(Length(ClosedFormLightVector(field, p).j[0] - expected),
              (z > 1e-4 ? 1e-6 : 1e-11) * Length(expected))
        << z;
  }
}

TEST(LightVector, ExtremeDistancesAndPlanes) {
  constexpr std::uint64_t kSeed = 46;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  for (const double scale : {1e-3 / 0.12, 1.0, 10 / 0.12}) {  // delta of 1 mm, 12 cm, 10 m
    LuminaireGeometry g = TinyGeometry(Basis::Make(BasisKind::kBspline2));
    g.delta_m *= scale;
    const LightField field = RandomField(g, kSeed);
    for (const double distance : {1e-2, 1.0, 1e3, 1e6})
      for (int k = 0; k < 10; ++k) {
        const Vec3 p = LitPoint(g, random, g.delta_m + distance);
        const Vec3 expected = QuadratureVector(field, p);
        EXPECT_LT(Length(ClosedFormLightVector(field, p).j[0] - expected), 1e-10 * Length(expected))
            << g.delta_m << ' ' << distance;
      }
  }
}

TEST(LightVector, BehindOutsideAndNotANumberSeeNothing) {
  const LightField field = RandomField(TinyGeometry(Basis::Make(BasisKind::kBspline2)), 47);
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{0, 0, -1}, Vec3{100, 0, 1}, Vec3{0, -1e9, 1},
                       Vec3{0, 0, NAN}, Vec3{NAN, 0, 1}}) {
    EXPECT_EQ(Length(ClosedFormLightVector(field, p).j[0]), 0);
    EXPECT_EQ(ExactIrradiance(field, p, {0, 0, -1})[0], 0);
  }
  const Vec3 p{0, 0, 1};
  EXPECT_GT(ExactIrradiance(field, p, {0, 0, -1})[0], 0);
  EXPECT_EQ(ExactIrradiance(field, p, {0, 0, 1})[0], 0);  // turned away
}

TEST(LightVector, GrazingReceiverSeesHalfOfASymmetricLamp) {
  LuminaireGeometry g = TinyGeometry(Basis::Make(BasisKind::kBspline2));
  g.grid = BasisGrid::Centred(g.grid.basis, 3, 3, 0.021);
  g.lattice = {9, 9, -0.18, 0.18, 0.04, 0.04};
  LightField field(g);
  for (float& value : field.data) value = 1;
  // On the axis, n across: by symmetry both halves give the same, and their difference is
  // n . J = 0.
  const Vec3 p{0, 0, 0.5};
  const double left = ExactIrradiance(field, p, {1, 0, 0})[0];
  const double right = ExactIrradiance(field, p, {-1, 0, 0})[0];
  EXPECT_GT(left, 0);
  EXPECT_NEAR(left, right, 1e-13 * left);
  EXPECT_NEAR(left, QuadratureIrradiance(field, p, {1, 0, 0}), 1e-12 * left);
}

TEST(LightVector, IsLinearAlsoWithNegativeCoefficients) {
  const LuminaireGeometry g = TinyGeometry(Basis::Make(BasisKind::kBspline2));
  const LightField a = RandomField(g, 48);
  LightField b = a;
  for (float& value : b.data) value = -value;
  const Vec3 p{0.03, -0.02, 0.4}, n = Normalized({0.9, 0.2, -0.03});
  ASSERT_TRUE(HorizonCutsSupport(g, p, n));
  EXPECT_GT(ExactIrradiance(a, p, n)[0], 0);
  EXPECT_EQ(ExactIrradiance(b, p, n)[0], -ExactIrradiance(a, p, n)[0]);
}

TEST(LightVector, ChannelsAreIndependent) {
  LuminaireGeometry g = TinyGeometry(Basis::Make(BasisKind::kBspline2));
  const LightField grey = RandomField(g, 49);
  g.channels = 3;
  LightField colour(g);
  for (int m = 0; m < g.grid.count(); ++m)
    std::copy(grey.image(m, 0).begin(), grey.image(m, 0).end(), colour.image(m, 1).begin());
  const Vec3 p{0.03, -0.02, 0.4};
  for (const Vec3 n : {Vec3{0, 0, -1}, Normalized({0.9, 0.2, -0.03})}) {
    const auto one = ExactIrradiance(grey, p, n), three = ExactIrradiance(colour, p, n);
    EXPECT_EQ(three[0], 0);
    EXPECT_EQ(three[1], one[0]);
    EXPECT_EQ(one[2], one[0]);
  }
}

}  // namespace
}  // namespace luxfield::lightfield
