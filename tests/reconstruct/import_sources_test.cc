// Ray files of sources that are known in closed form, imported as light fields: their flux, far
// field and irradiance nearby against the source itself, never against the rays' own fit.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>

#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/reconstruct/solve/import_rays.h"

namespace luxfield::reconstruct {
namespace {

using formats::RayFile;
using lightfield::Normalized;
using lightfield::Vec2;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 825;
constexpr double kPi = std::numbers::pi;

// Equal rays of total flux 1; draw gives position and direction of one.
RayFile Rays(int count, std::uint64_t stream,
             const std::function<std::pair<Vec3, Vec3>(core::Random&)>& draw,
             std::uint64_t seed = kSeed) {
  RayFile file;
  core::Random random(seed, stream);
  for (int n = 0; n < count; ++n) {
    const auto [position, direction] = draw(random);
    file.rays.push_back({position, direction, 1.0 / count, {}});
  }
  return file;
}

// Lambertian about `normal` (one of the frame's axes x, y, normal).
Vec3 Lambertian(core::Random& random, Vec3 x, Vec3 y, Vec3 normal) {
  const double sine2 = random.Uniform(), turn = 2 * kPi * random.Uniform();
  const double sine = std::sqrt(sine2);
  return sine * std::cos(turn) * x + sine * std::sin(turn) * y + std::sqrt(1 - sine2) * normal;
}

constexpr double kRadius_m = 0.02;

std::pair<Vec3, Vec3> FromDisc(core::Random& random) {
  const double r = kRadius_m * std::sqrt(random.Uniform()), turn = 2 * kPi * random.Uniform();
  return {{r * std::cos(turn), r * std::sin(turn), 0},
          Lambertian(random, {1, 0, 0}, {0, 1, 0}, {0, 0, 1})};
}

std::pair<Vec3, Vec3> FromSphere(core::Random& random) {
  const double z = 2 * random.Uniform() - 1, turn = 2 * kPi * random.Uniform(),
               r = std::sqrt(1 - z * z);
  const Vec3 normal{r * std::cos(turn), r * std::sin(turn), z};
  const Vec3 x = Normalized(Cross(normal, std::abs(z) < 0.7 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}));
  return {kRadius_m * normal, Lambertian(random, x, Cross(normal, x), normal)};
}

// The side of a cylinder along z, without caps, five radii long.
constexpr double kLength_m = 5 * kRadius_m;
std::pair<Vec3, Vec3> FromCylinder(core::Random& random) {
  const double turn = 2 * kPi * random.Uniform();
  const Vec3 normal{std::cos(turn), std::sin(turn), 0}, z{0, 0, 1};
  return {kRadius_m * normal + kLength_m * (random.Uniform() - 0.5) * z,
          Lambertian(random, z, Cross(normal, z), normal)};
}

// A lens of 20 mm radius whose points send a Gaussian beam of 2 degrees.
constexpr double kBeam = 0.035;
std::pair<Vec3, Vec3> FromLens(core::Random& random) {
  const auto [position, ignored] = FromDisc(random);
  return {position, Normalized(Vec3{kBeam * random.Normal(), kBeam * random.Normal(), 1})};
}

// Flux within `theta` of +z.
double DiscWithin(double theta) { return std::pow(std::sin(std::min(theta, kPi / 2)), 2); }
double SphereWithin(double theta) { return (1 - std::cos(theta)) / 2; }
// Intensity sin(theta) / pi^2.
double CylinderWithin(double theta) { return (theta - std::sin(theta) * std::cos(theta)) / kPi; }

// Of the light fields, between two angles from +z: midpoint rule over cos(theta) and phi.
double FluxBetween(const std::vector<lightfield::PosedLightField>& fields, double from, double to) {
  constexpr int kThetas = 6, kPhis = 40;
  double sum = 0;
  for (int i = 0; i < kThetas; ++i)
    for (int k = 0; k < kPhis; ++k) {
      const double cosine = std::cos(from) + (std::cos(to) - std::cos(from)) * (i + 0.5) / kThetas;
      const double sine = std::sqrt(1 - cosine * cosine), phi = 2 * kPi * (k + 0.37) / kPhis;
      sum += FarFieldIntensity(fields, {sine * std::cos(phi), sine * std::sin(phi), cosine})[0];
    }
  return sum * 2 * kPi * (std::cos(from) - std::cos(to)) / (kThetas * kPhis);
}

std::uint64_t Unknowns(const RayImport& result) {
  std::uint64_t sum = 0;
  for (const auto& posed : result.coefficients) {
    const auto& g = posed.field.geometry;  // without the dark functions around the window
    sum += g.plane_size() * (g.grid.width - 4) * (g.grid.height - 4);
  }
  return sum;
}

struct Source {
  const char* name;
  std::pair<Vec3, Vec3> (*draw)(core::Random&);
  double (*within)(double);
  std::size_t fields;
};

class FarField : public testing::TestWithParam<Source> {};

// Light within 10-degree rings: the rays' own counting noise, and what a texel of some 5 degrees
// smears over the rings' borders: at most 0.8 % of the flux, of the 9 % that a ring near the
// largest holds.
TEST_P(FarField, FollowsTheClosedFormInAllDirections) {
  const Source& source = GetParam();
  constexpr int kRays = 40000, kRings = 18;
  const RayImport result = ImportRays(Rays(kRays, 1, source.draw));
  EXPECT_EQ(result.coefficients.size(), source.fields);
  EXPECT_EQ(result.report.used.rays, std::uint64_t{kRays});
  EXPECT_NEAR(result.report.fitted_flux, 1, 1e-5);
  EXPECT_NEAR(lightfield::TotalFlux(result.coefficients)[0], 1, 1e-5);
  EXPECT_LT(Unknowns(result), kRays);
  EXPECT_TRUE(Warnings(result).empty()) << Warnings(result).front();
  double sum = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double from = ring * kPi / kRings, to = (ring + 1) * kPi / kRings;
    const double truth = source.within(to) - source.within(from),
                 found = FluxBetween(result.coefficients, from, to);
    const double sigma = std::sqrt(truth * (1 - truth) / kRays);
    std::printf("%-9s %3d to %3d degrees: %8.5f of %8.5f, %+6.2f %%, counting noise %4.2f %%\n",
                source.name, ring * 10, ring * 10 + 10, found, truth,
                truth > 0 ? 100 * (found / truth - 1) : 0.0, truth > 0 ? 100 * sigma / truth : 0.0);
    EXPECT_NEAR(found, truth, 4 * sigma + 0.008) << source.name << ", ring " << ring;
    sum += found;
  }
  EXPECT_NEAR(sum, 1, 0.002);  // the rule's own error at the seams of the cube
}

INSTANTIATE_TEST_SUITE_P(Sources, FarField,
                         testing::Values(Source{"disc", FromDisc, DiscWithin, 5},
                                         Source{"sphere", FromSphere, SphereWithin, 6},
                                         Source{"cylinder", FromCylinder, CylinderWithin, 6}),
                         [](const auto& source) { return std::string(source.param.name); });

// A sphere sends as much everywhere, so that its cube of fields shows what its seams add: over
// several sets of rays, the rings from 40 to 50 degrees off +z and -z, of which most lies near a
// seam. Texels of 0.27 delta add 4 %; those of half a delta, which are of least risk, would 10 %.
TEST(ImportSources, SeamsOfACubeAddLittle) {
  constexpr int kRays = 40000, kSets = 4;
  const double truth = SphereWithin(50 * kPi / 180) - SphereWithin(40 * kPi / 180);
  double found = 0;
  for (int set = 0; set < kSets; ++set) {
    const RayImport result = ImportRays(Rays(kRays, 1, FromSphere, kSeed + 1 + set));
    for (const auto& posed : result.coefficients) {
      const auto& g = posed.field.geometry;
      EXPECT_LE(std::max(g.lattice.ds_m, g.lattice.dt_m), 0.3 * g.delta_m);
    }
    for (const double from : {40.0, 130.0})
      found +=
          FluxBetween(result.coefficients, from * kPi / 180, (from + 10) * kPi / 180) / (2 * kSets);
  }
  const double sigma = std::sqrt(truth * (1 - truth) / (2.0 * kSets * kRays));
  std::printf("sphere, rings of 40 to 50 degrees (seed %d): %+.2f %%, counting noise %.2f %%\n",
              static_cast<int>(kSeed), 100 * (found / truth - 1), 100 * sigma / truth);
  EXPECT_NEAR(found, truth, 0.05 * truth + 3 * sigma);
}

TEST(ImportSources, ABeamStaysOneFieldAndSharp) {
  const RayImport result = ImportRays(Rays(40000, 2, FromLens));
  ASSERT_EQ(result.coefficients.size(), 1u);
  EXPECT_EQ(result.report.lost_share(), 0);
  EXPECT_NEAR(result.report.fitted_flux, 1, 1e-5);
  // Flux within the cone: 1 - exp(-m^2 / (2 sigma^2)), slopes Gaussian.
  for (const double cone : {0.5, 1.0, 2.0, 3.0}) {
    const double truth = 1 - std::exp(-cone * cone / 2);
    const double found = FluxBetween(result.coefficients, 0, std::atan(cone * kBeam));
    std::printf("beam within %.1f sigma: %.4f of %.4f\n", cone, found, truth);
    EXPECT_NEAR(found, truth, 4 * std::sqrt(truth * (1 - truth) / 40000) + 0.03);
  }
}

// Irradiance of the disc at p, normal n, by a midpoint rule in polar coordinates.
double DiscIrradiance(Vec3 p, Vec3 n) {
  constexpr int kRadii = 60, kTurns = 120;
  const double radiance = 1 / (kPi * kPi * kRadius_m * kRadius_m);
  double sum = 0;
  for (int i = 0; i < kRadii; ++i)
    for (int k = 0; k < kTurns; ++k) {
      const double r = kRadius_m * (i + 0.5) / kRadii, turn = 2 * kPi * (k + 0.5) / kTurns;
      const Vec3 to = Vec3{r * std::cos(turn), r * std::sin(turn), 0} - p;
      const double d2 = Dot(to, to), d = std::sqrt(d2);
      sum += r * std::max(0.0, p.z / d) * std::max(0.0, Dot(n, to) / d) / d2;
    }
  return radiance * sum * (kRadius_m / kRadii) * (2 * kPi / kTurns);
}

double Irradiance(const std::vector<lightfield::PosedLightField>& fields, Vec3 p, Vec3 n) {
  double sum = 0;
  for (const auto& [name, pose, field] : fields) {
    const auto inverse = pose.Inverse();
    sum += ExactIrradiance(field, inverse.Point(p), inverse.Direction(n))[0];
  }
  return sum;
}

TEST(ImportSources, ADiscLightsNearReceivers) {
  constexpr double kCentre = 1 / (kPi * kRadius_m * kRadius_m);
  EXPECT_NEAR(DiscIrradiance({0, 0, 2 * kRadius_m}, {0, 0, -1}), kCentre / 5, 1e-3 * kCentre / 5);
  const RayFile rays = Rays(60000, 3, FromDisc);
  for (const RaySigns signs : {RaySigns::kSigned, RaySigns::kAuto}) {
    ImportRaysOptions options;
    options.signs = signs;
    const RayImport result = ImportRays(rays, options);
    double squares = 0, sum = 0;
    int count = 0;
    for (const double distance : {2.0, 4.0, 10.0, 40.0})
      for (const double angle : {0.0, 20.0, 40.0, 50.0, 60.0, 75.0}) {
        const double theta = angle * kPi / 180, turn = 0.3 + angle;
        const Vec3 way{std::sin(theta) * std::cos(turn), std::sin(theta) * std::sin(turn),
                       std::cos(theta)};
        const Vec3 p = distance * kRadius_m * way, n = -1.0 * way;
        const double truth = DiscIrradiance(p, n), found = Irradiance(result.coefficients, p, n);
        const double error = found / truth - 1;
        if (signs == RaySigns::kAuto)
          std::printf("disc, %4.0f radii, %2.0f degrees: %+6.2f %%\n", distance, angle,
                      100 * error);
        squares += error * error;
        sum += error;
        ++count;
      }
    std::printf("%s: rms %.2f %%, mean %+.2f %%, negative in the fit %.1f %%\n",
                signs == RaySigns::kSigned ? "signed" : "non-negative",
                100 * std::sqrt(squares / count), 100 * sum / count,
                100 * result.report.negative_energy);
    EXPECT_LT(std::sqrt(squares / count), 0.08);
    EXPECT_LT(std::abs(sum / count), 0.03);
  }
}

TEST(RayFaces, EveryDirectionHasOneAndIsNearItsAxis) {
  const Vec3 axes[] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  const char* names[] = {"+z", "-z", "+x", "-x", "+y", "-y"};
  for (int face = 0; face < kFaces; ++face) {
    LuminaireFromFace(face).Validate(FaceName(face));
    EXPECT_EQ(Length(LuminaireFromFace(face).Direction({0, 0, 1}) - axes[face]), 0);
    EXPECT_STREQ(FaceName(face), names[face]);
    EXPECT_EQ(FaceOf(axes[face]), face);
  }
  core::Random random(kSeed, 4);
  for (int n = 0; n < 1000; ++n) {
    const Vec3 d{random.Normal(), random.Normal(), random.Normal()};
    const Vec3 in_face = LuminaireFromFace(FaceOf(d)).InverseDirection(d);
    EXPECT_GE(in_face.z, std::max(std::abs(in_face.x), std::abs(in_face.y)));
  }
  EXPECT_EQ(FaceOf({1, 1, 1}), 0);  // the seams belong to one face each
  EXPECT_EQ(FaceOf({-1, 1, 0.5}), 3);
  EXPECT_EQ(FaceOf({0.1, -1, -1}), 1);
}

// The risk from its definition: all pairs of rays through a dense inverse of the Gram matrix.
TEST(LatticeRisk, IsTheSumOverPairs) {
  for (const auto kind : {lightfield::BasisKind::kBspline2, lightfield::BasisKind::kBilinear}) {
    lightfield::LuminaireGeometry g;
    g.delta_m = 0.3;
    g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind), 6, 5, 0.01);
    g.lattice = {3, 2, -0.06, 0.04, 0.04, 0.04};
    std::vector<RayLine> lines;
    core::Random random(kSeed, 5);
    for (int n = 0; n < 200; ++n) {
      const Vec2 u{0.03 * (random.Uniform() - 0.5), 0.02 * (random.Uniform() - 0.5)};
      const Vec2 slope{0.3 * (random.Uniform() - 0.5), 0.2 * (random.Uniform() - 0.5)};
      lines.push_back({u, slope, random.Uniform(), 1});
    }
    const auto inverse = [&](int count) -> Eigen::MatrixXd {
      Eigen::MatrixXd gram(count, count);
      for (int i = 0; i < count; ++i)
        for (int k = 0; k < count; ++k) gram(i, k) = g.grid.spacing_m * g.grid.basis.Gram(i - k);
      return gram.inverse();
    };
    const Eigen::MatrixXd in_u = inverse(6), in_v = inverse(5);
    const auto phi = [&](double x, int count) {
      Eigen::VectorXd values(count);
      for (int i = 0; i < count; ++i) values(i) = g.grid.basis.Value(x - i);
      return values;
    };
    const auto kernel = [&](const RayLine& a, const RayLine& b) {
      const Vec2 s = a.At(g.delta_m), t = b.At(g.delta_m);
      if (std::floor(g.lattice.column_of_s(s.x)) != std::floor(g.lattice.column_of_s(t.x)) ||
          std::floor(g.lattice.row_of_t(s.y)) != std::floor(g.lattice.row_of_t(t.y)))
        return 0.0;
      const auto along = [&](double x, double y, double start, int count,
                             const Eigen::MatrixXd& inverse_gram) {
        return phi((x - start) / g.grid.spacing_m, count)
            .dot(inverse_gram * phi((y - start) / g.grid.spacing_m, count));
      };
      return along(a.at_zero.x, b.at_zero.x, g.grid.u0_m, 6, in_u) *
             along(a.at_zero.y, b.at_zero.y, g.grid.v0_m, 5, in_v) / (0.04 * 0.04);
    };
    double variance = 0, square = 0;
    for (const RayLine& a : lines)
      for (const RayLine& b : lines)
        (&a == &b ? variance : square) += a.flux * b.flux * kernel(a, b);
    for (const double share : {1.0, 0.25})
      EXPECT_NEAR(LatticeRisk(BinRays(lines, g, 0, 1), g, GramSolver(g.grid), share),
                  0.09 * (share * variance - square), 1e-9 * 0.09 * (variance + std::abs(square)));
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
