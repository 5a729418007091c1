// Classical lights: irradiance of every strategy against closed forms and quadrature, with
// occluders, the sampler of lines, what the tree over lights takes of them, extremes.
#include "luxfield/render/lights/classical_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/render/kernels/sample/sampling_types.clh"
#include "luxfield/render/lights/light_tree.h"
#include "tests/render/area_light_fixture.h"
#include "tests/render/chi_squared.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

using formats::Photometry;
using formats::PhotometryType;
using lightfield::Vec3;
using scene::ClassicalModel;
using std::numbers::pi;

const scene::Pose kTilted =
    scene::Translation({0.3, -0.2, 1.5}) * scene::RotationXyz({170, 20, 35});

std::vector<double> Angles(double first, double last, int count) {
  std::vector<double> angles;
  for (int k = 0; k < count; ++k) angles.push_back(first + (last - first) * k / (count - 1));
  return angles;
}

// I = peak cos gamma, to 3e-6.
Photometry Lambertian(double peak_cd) {
  Photometry photometry;
  photometry.planes_deg = {0};
  photometry.angles_deg = Angles(0, 90, 361);
  for (const double gamma : photometry.angles_deg)
    photometry.intensity_cd.push_back(peak_cd * std::cos(gamma * pi / 180));
  return photometry;
}

Photometry AnyTable(PhotometryType type, core::Random& random) {
  Photometry photometry;
  photometry.type = type;
  photometry.planes_deg = type == PhotometryType::kC   ? std::vector<double>{10, 50, 140, 300}
                          : type == PhotometryType::kB ? Angles(-90, 90, 7)
                                                       : Angles(-180, 180, 9);
  photometry.angles_deg = type == PhotometryType::kC   ? Angles(0, 180, 10)
                          : type == PhotometryType::kB ? Angles(-180, 180, 9)
                                                       : Angles(-90, 90, 8);
  const std::size_t count = photometry.planes_deg.size() * photometry.angles_deg.size();
  for (std::size_t k = 0; k < count; ++k) photometry.intensity_cd.push_back(random.Uniform());
  return photometry;
}

scene::ClassicalLight Light(ClassicalModel model, double x, double y,
                            const scene::Pose& pose = kTilted) {
  return {"light", model, "lamp.ies", std::array{x, y}, pose, 2};
}

ClassicalLightSource Source(const Device& device, const scene::ClassicalLight& light,
                            Photometry photometry) {
  return MakeClassicalLight(light,
                            std::make_shared<const Distribution>(device, std::move(photometry)));
}

Lit LightBy(const Device& device, MisEstimator& estimator, const GBuffer& gbuffer,
            const ClassicalLightSource& source, const EstimatorOptions& options,
            const RayScene* rays = nullptr) {
  Lighting lighting(device, gbuffer);
  estimator.Light({gbuffer, {.rays = rays}}, source, options, lighting);
  return {lighting.irradiance.Download<cl_float4>(),
          {},
          lighting.variance.Download<float>(),
          lighting.samples.Download<cl_uint>()};
}

// Of the point x of a light that sends the intensity I / measure.
double FromPoint(const scene::ClassicalLight& light, const Photometry& photometry, Vec3 local,
                 const SurfacePoint& receiver) {
  const Vec3 to_light = light.world_from_light.Point(local) - receiver.p;
  const double square = Dot(to_light, to_light), cosine = Dot(receiver.n, to_light);
  if (!(cosine > 0)) return 0;
  const Vec3 away = light.world_from_light.Inverse().Vector((-1 / std::sqrt(square)) * to_light);
  return light.scale * formats::Intensity(photometry, away) * cosine / (square * std::sqrt(square));
}

// Midpoints over a rectangle of the light.
double ByQuadrature(const scene::ClassicalLight& light, const Photometry& photometry, int columns,
                    int rows, const SurfacePoint& receiver) {
  double sum = 0;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      sum += FromPoint(light, photometry,
                       {((i + 0.5) / columns - 0.5) * (*light.size_m)[0],
                        ((j + 0.5) / rows - 0.5) * (*light.size_m)[1], 0},
                       receiver);
  return sum / (columns * rows);
}

// Of a Lambertian line along x, wholly above the horizon: with D the distance of its axis, z of its
// plane,
//
//   E = I z / l integral (n . f + n_x t) / (D^2 + t^2)^2 dt
double LambertianLine(const scene::ClassicalLight& light, double peak_cd,
                      const SurfacePoint& receiver) {
  const scene::Pose local = light.world_from_light.Inverse();
  const Vec3 p = local.Point(receiver.p), n = local.Vector(receiver.n), foot{0, -p.y, -p.z};
  const double length = (*light.size_m)[0], d = std::hypot(p.y, p.z);
  const auto even = [&](double t) {
    return t / (2 * d * d * (d * d + t * t)) + std::atan(t / d) / (2 * d * d * d);
  };
  const auto odd = [&](double t) { return -1 / (2 * (d * d + t * t)); };
  const double a = -p.x - length / 2, b = -p.x + length / 2;
  return light.scale * peak_cd * p.z / length *
         (Dot(n, foot) * (even(b) - even(a)) + n.x * (odd(b) - odd(a)));
}

// In front of a light, up to `far` away, facing about its middle.
std::vector<SurfacePoint> Receivers(double near, double far, int count, bool both_sides = false) {
  core::Random random(kSamplingSeed, 18);
  std::vector<SurfacePoint> points;
  while (points.size() < static_cast<std::size_t>(count)) {
    const Vec3 away = Normalized(Vec3{random.Normal(), random.Normal(), random.Normal()});
    const double distance = near * std::pow(far / near, random.Uniform());
    if (std::abs(away.z) < 0.1 || (!both_sides && away.z < 0)) continue;
    const Vec3 p = kTilted.Point(distance * away), to_light = Normalized(kTilted.translation - p);
    points.push_back(
        RoundToFloat({p, Normalized(to_light + 0.3 * Vec3{random.Normal(), random.Normal(), 0})}));
  }
  return points;
}

void ExpectIrradiance(const Device& device, const ClassicalLightSource& source,
                      const std::vector<SurfacePoint>& points, const std::vector<double>& exact,
                      Strategies strategies, int samples, double rounding = 1e-5) {
  constexpr int kCopies = 256;
  MisEstimator estimator(device);
  const EstimatorOptions options = WithStrategies(strategies, samples);
  const Lit lit =
      LightBy(device, estimator, MakeGBuffer(device, Repeated(points, kCopies)), source, options);
  auto statistics = OverCopies(lit.irradiance, lit.variance, kCopies);
  for (std::size_t k = 0; k < exact.size(); ++k)
    statistics.standard_error[k] = std::hypot(statistics.standard_error[k], rounding * exact[k]);
  ExpectUnbiased(
      statistics, exact, kCopies, options.knobs.strategies.Text().c_str(),
      strategies == Strategies::kBrdf ? 20.0 / (kCopies * samples) : 2.0 / (kCopies * samples));
  for (const cl_uint count : lit.samples) EXPECT_EQ(count, static_cast<cl_uint>(samples));
}

TEST(ClassicalLight, PointsAreExactForTablesOfEveryType) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  core::Random random(TestSeed(20261127), 0);
  for (const auto type : {PhotometryType::kA, PhotometryType::kB, PhotometryType::kC}) {
    const Photometry photometry = AnyTable(type, random);
    const scene::ClassicalLight light = Light(ClassicalModel::kPoint, 0, 0);
    std::vector<SurfacePoint> points;
    for (int k = 0; k < 2000; ++k)
      points.push_back(RoundToFloat(
          {kTilted.Point((0.1 + random.Uniform()) *
                         Normalized(Vec3{random.Normal(), random.Normal(), random.Normal()})),
           Normalized(Vec3{random.Normal(), random.Normal(), random.Normal()})}));
    const Lit lit =
        LightBy(device, estimator, MakeGBuffer(device, points), Source(device, light, photometry),
                WithStrategies(Strategies::kLobe, 64));
    EXPECT_THAT(lit.samples, testing::Each(2u));
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double exact = FromPoint(light, photometry, {}, points[k]);
      // Of float32 directions the table's slope makes the most next to its poles, where planes of
      // 40 degrees meet.
      ASSERT_NEAR(lit.irradiance[k].s[1], exact, 1e-4 * exact + 2e-4) << int(type) << " " << k;
      ASSERT_EQ(lit.irradiance[k].s[0], lit.irradiance[k].s[2]);
      // Both samples are the same; their squares are rounded once more or once less than their sum's.
      const float shown = lit.irradiance[k].s[1];
      ASSERT_LE(lit.variance[k], 4 * std::numeric_limits<float>::epsilon() * shown * shown);
    }
  }
}

TEST(ClassicalLight, LambertianRectangleIsThatOfEvenRadiance) {
  const Device device = Device::Open();
  const scene::ClassicalLight light = Light(ClassicalModel::kArea, 0.8, 0.5);
  const ClassicalLightSource source = Source(device, light, Lambertian(100));
  scene::AreaLight even = Rectangle(0.8, 0.5, kTilted);
  even.radiance.fill(light.scale * 100 / (0.8 * 0.5));
  const auto points = Receivers(0.05, 3, 32);
  std::vector<double> exact;
  for (const auto& point : points) exact.push_back(ExactIrradiance(even, point));
  for (const Strategies strategies : AllStrategies())
    ExpectIrradiance(device, source, points, exact, strategies, 16);
}

TEST(ClassicalLight, LambertianLineIsTheClosedForm) {
  const Device device = Device::Open();
  const scene::ClassicalLight along_x = Light(ClassicalModel::kLinear, 1.2, 0);
  // The same line, its light turned about the axis z.
  const scene::ClassicalLight along_y =
      Light(ClassicalModel::kLinear, 0, 1.2, kTilted * scene::RotationXyz({0, 0, 90}));
  std::vector<SurfacePoint> points;
  std::vector<double> exact;
  for (auto point : Receivers(0.02, 4, 64)) {
    point.n =
        RoundToFloat({{}, kTilted.Vector({0, 0, -1})}).n;  // all of the line above the horizon
    points.push_back(point);
    exact.push_back(LambertianLine(along_x, 100, point));
  }
  for (const scene::ClassicalLight* light : {&along_x, &along_y})
    for (const Strategies strategies : {Strategies::kLobe, Strategies::kNewton})
      ExpectIrradiance(device, Source(device, *light, Lambertian(100)), points, exact, strategies,
                       8);
}

TEST(ClassicalLight, AnyTableIsTheQuadrature) {
  const Device device = Device::Open();
  core::Random random(kSamplingSeed, 19);
  for (const auto type : {PhotometryType::kC, PhotometryType::kB}) {
    const Photometry photometry = AnyTable(type, random);
    const auto points = Receivers(0.2, 1.5, 24, /*both_sides=*/true);
    const scene::ClassicalLight area = Light(ClassicalModel::kArea, 0.4, 0.25),
                                line = Light(ClassicalModel::kLinear, 0, 0.4);
    std::vector<double> of_area, of_line;
    for (const auto& point : points) {
      of_area.push_back(ByQuadrature(area, photometry, 200, 125, point));
      of_line.push_back(ByQuadrature(line, photometry, 1, 10000, point));
    }
    for (const Strategies strategies : {Strategies::kLobe, Strategies::kBalance})
      ExpectIrradiance(device, Source(device, area, photometry), points, of_area, strategies, 16,
                       1e-4);
    ExpectIrradiance(device, Source(device, line, photometry), points, of_line, Strategies::kLobe,
                     16, 1e-4);
  }
}

// A Lambertian disc of radius R on its axis: E = pi L R^2 / (R^2 + z^2).
TEST(ClassicalLight, EllipsesAreFlatOpenings) {
  const Device device = Device::Open();
  scene::ClassicalLight light = Light(ClassicalModel::kArea, 0, 0);
  light.size_m.reset();
  Photometry photometry = Lambertian(100);
  photometry.opening = {formats::Opening::Shape::kEllipse, 0.6, 0.6, 0};
  const ClassicalLightSource source = Source(device, light, photometry);
  std::vector<SurfacePoint> points;
  std::vector<double> exact;
  for (const double z : {0.1, 0.3, 1.0, 4.0}) {
    points.push_back(RoundToFloat({kTilted.Point({0, 0, z}), kTilted.Vector({0, 0, -1})}));
    exact.push_back(light.scale * 100 / (0.09 + z * z));
  }
  for (const Strategies strategies : {Strategies::kLobe, Strategies::kBalance})
    ExpectIrradiance(device, source, points, exact, strategies, 32);
}

// From ten of its radii on, a disc has at most twice the noise of the square around it.
TEST(ClassicalLight, RoundOnesAreAsQuietAsSquares) {
  constexpr int kCopies = 256;
  const Device device = Device::Open();
  MisEstimator estimator(device);
  const auto lit = [&](formats::Opening::Shape shape, const std::vector<SurfacePoint>& points) {
    scene::ClassicalLight light = Light(ClassicalModel::kArea, 0, 0);
    light.size_m.reset();
    Photometry photometry = Lambertian(100);
    photometry.opening = {shape, 0.15, 0.15, 0};
    const auto options = WithStrategies(Strategies::kLobe, 16);
    return LightBy(device, estimator, MakeGBuffer(device, Repeated(points, kCopies)),
                   Source(device, light, photometry), options);
  };
  const std::vector<SurfacePoint> points = Receivers(1.5, 6, 24);
  const auto round = lit(formats::Opening::Shape::kEllipse, points),
             square = lit(formats::Opening::Shape::kBox, points);
  const auto of_round = OverCopies(round.irradiance, round.variance, kCopies),
             of_square = OverCopies(square.irradiance, square.variance, kCopies);
  double round_sum = 0, square_sum = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    round_sum += std::pow(of_round.standard_error[k] / of_round.mean[k], 2);
    square_sum += std::pow(of_square.standard_error[k] / of_square.mean[k], 2);
  }
  std::printf("relative noise of a pixel: disc %.2g, square %.2g\n",
              std::sqrt(kCopies * round_sum / double(points.size())),
              std::sqrt(kCopies * square_sum / double(points.size())));
  EXPECT_LT(round_sum, 4 * square_sum);
}

TEST(ClassicalLight, EllipsesAreTheQuadratureAtEveryDistance) {
  const Device device = Device::Open();
  core::Random random(kSamplingSeed, 31);
  const scene::ClassicalLight light = [] {
    scene::ClassicalLight made = Light(ClassicalModel::kArea, 0, 0);
    made.size_m.reset();
    return made;
  }();
  Photometry photometry = AnyTable(PhotometryType::kC, random);
  photometry.opening = {formats::Opening::Shape::kEllipse, 0.5, 0.2, 0};
  const std::vector<SurfacePoint> points = Receivers(0.3, 3, 16);  // even from 0.75 m on
  std::vector<double> exact;
  for (const SurfacePoint& point : points) {
    constexpr int kRings = 200, kPlaces = 800;  // of equal areas
    double sum = 0;
    for (int r = 0; r < kRings; ++r)
      for (int a = 0; a < kPlaces; ++a) {
        const double radius = std::sqrt((r + 0.5) / kRings), angle = 2 * pi * (a + 0.5) / kPlaces;
        sum +=
            FromPoint(light, photometry,
                      {0.25 * radius * std::cos(angle), 0.1 * radius * std::sin(angle), 0}, point);
      }
    exact.push_back(sum / (kRings * kPlaces));
  }
  for (const Strategies strategies :
       {Strategies::kLobe, Strategies::kLight, Strategies::kBrdf, Strategies::kBalance})
    ExpectIrradiance(device, Source(device, light, photometry), points, exact, strategies, 32,
                     1e-4);
}

// A wall hides one half of each.
TEST(ClassicalLight, TracedShadows) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  const scene::Pose down = scene::Translation({0, 0, 1}) * scene::RotationXyz({180, 0, 0}),
                    left = scene::Translation({-0.25, 0, 0}) * down;
  const SurfacePoint receiver{{0, 0, 0}, {0, 0, 1}};
  const GBuffer gbuffer = MakeGBuffer(device, Repeated({receiver}, 2048));
  const auto wall = Blocker(device, 0, 10, 0.5);
  core::Random random(kSamplingSeed, 20);
  const Photometry photometry = AnyTable(PhotometryType::kC, random);
  for (const auto& [model, y] :
       {std::pair{ClassicalModel::kArea, 0.5}, std::pair{ClassicalModel::kLinear, 0.0}}) {
    const scene::ClassicalLight whole = Light(model, 1, y, down), half = Light(model, 0.5, y, left);
    const double exact = ByQuadrature(half, photometry, 400, y > 0 ? 400 : 1, receiver) / 2;
    const Lit lit = LightBy(device, estimator, gbuffer, Source(device, whole, photometry),
                            WithStrategies(Strategies::kLobe, 16), wall.get());
    const auto hidden = OverCopies(lit.irradiance, lit.variance, 2048);
    EXPECT_NEAR(hidden.mean[0], exact, 4.5 * hidden.standard_error[0] + 1e-4 * exact);
  }
  for (const double x : {-0.3, 0.3}) {
    const scene::ClassicalLight point =
        Light(ClassicalModel::kPoint, 0, 0, scene::Translation({x, 0, 0}) * down);
    const Lit lit = LightBy(device, estimator, gbuffer, Source(device, point, photometry),
                            WithStrategies(Strategies::kLobe, 2), wall.get());
    EXPECT_NEAR(lit.irradiance[0].s[0], x < 0 ? FromPoint(point, photometry, {}, receiver) : 0,
                1e-4);
  }
}

TEST(ClassicalLight, NoBrdfSampleMeetsAPointOrALine) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  const GBuffer gbuffer = MakeGBuffer(device, {{{0, 0, 0}, {0, 0, 1}}});
  for (const auto model : {ClassicalModel::kPoint, ClassicalModel::kLinear})
    EXPECT_THAT(
        [&] {
          LightBy(device, estimator, gbuffer, Source(device, Light(model, 1, 0), Lambertian(1)),
                  WithStrategies(Strategies::kBrdf, 4));
        },
        testing::ThrowsMessage<InputError>(testing::HasSubstr("other than brdf")));
}

// After the light.
const char* const kKernel = R"(
// One draw an item, of its own random numbers.
__kernel void Draw(LIGHT_ARGUMENTS, SURFACE_ARGUMENTS, int count, __global float4* directions) {
  const int k = get_global_id(0);
  Light light;
  if (k >= count || !MakeLight(LIGHT, 0, SURFACE(0), &light)) return;
  LightDraws draws = StartLightDraws(&light, 1, PixelWords(sampling, (uint)k));
  const LightSample drawn = NextLightDraw(&light, &draws);
  directions[k] = (float4)(drawn.direction, drawn.density);
}
)";

// Draws over the line against the angles that its parts are seen under; from beside it, near it, and
// from all but its axis.
TEST(ClassicalLight, ChiSquaredOfLines) {
  const Device device = Device::Open();
  const Program program = Program::BuildText(
      device,
      std::string("#define GLOSSY 0\n#include \"kernels/mis/light_classical_line.clh\"\n") +
          kKernel,
      "classical_light_test.cl");
  constexpr int kCount = 100000, kBins = 100;
  const scene::ClassicalLight light = Light(ClassicalModel::kLinear, 2, 0, {});
  const ClassicalLightSource source = Source(device, light, Lambertian(1));
  const Buffer light_params = Buffer::From(device, std::span(&source.params, 1));
  SamplingParams sampling{};
  sampling.seed_lo = static_cast<std::uint32_t>(kSamplingSeed);
  const Buffer params = Buffer::From(device, std::span<const SamplingParams>(&sampling, 1));
  for (const Vec3 p :
       {Vec3{0.3, 0.2, 1}, Vec3{0.5, 0.001, 0.01}, Vec3{1.5, 0.02, 0.03}, Vec3{-30, 20, 10}}) {
    const SurfacePoint receiver = RoundToFloat({p, {0, 0, -1}});
    const GBuffer gbuffer = MakeGBuffer(device, {receiver});
    Buffer directions(device, kCount * sizeof(cl_float4));
    Kernel(program, "Draw")
        .Set(light_params, source.distribution->table, params, gbuffer.position, gbuffer.normal,
             gbuffer.albedo, gbuffer.gloss, gbuffer.eye, static_cast<cl_int>(kCount), directions)
        .Enqueue(kCount);
    const double d = std::hypot(receiver.p.y, receiver.p.z);
    const auto angle = [&](double x) { return std::atan((x - receiver.p.x) / d); };
    std::vector<double> expected, observed(kBins, 0);
    for (int k = 0; k < kBins; ++k)
      expected.push_back(angle(-1 + 2.0 * (k + 1) / kBins) - angle(-1 + 2.0 * k / kBins));
    for (const cl_float4& drawn : directions.Download<cl_float4>()) {
      const double across = std::hypot(drawn.s[1], drawn.s[2]),
                   x = receiver.p.x + d * drawn.s[0] / across;
      ++observed[std::clamp(static_cast<int>((x + 1) / 2 * kBins), 0, kBins - 1)];
      ASSERT_NEAR(drawn.s[3] * (angle(1) - angle(-1)) / d, 1, 1e-4);
    }
    EXPECT_LT(ChiSquaredDeviations(expected, observed, "line from " + std::to_string(p.x)), 4);
  }
}

// The tree's profile is above 0 wherever a table shines, and its flux is the table's.
TEST(ClassicalLight, ProfilesHoldTheLight) {
  core::Random random(TestSeed(20261128), 0);
  for (const auto type : {PhotometryType::kA, PhotometryType::kB, PhotometryType::kC}) {
    Photometry photometry = AnyTable(type, random);
    for (double& value : photometry.intensity_cd)
      if (random.Uniform() < 0.8) value = 0;
    std::array<double, kProfileBins> profile{};
    double flux = 0;
    BoundIntensity(photometry, profile, flux);
    // Midpoints of 64 slices by 64 azimuths, of functions with kinks.
    EXPECT_NEAR(flux, formats::Flux(photometry), 0.05 * flux + 1e-9);
    for (int trial = 0; trial < 20000; ++trial) {
      const Vec3 d = Normalized(Vec3{random.Normal(), random.Normal(), random.Normal()});
      if (formats::Intensity(photometry, d) == 0) continue;
      const double angle = std::acos(std::clamp(d.z, -1.0, 1.0));
      const int bin = std::min(static_cast<int>(int{kProfileBins} * std::sqrt(angle / pi)),
                               int{kProfileBins} - 1);
      ASSERT_GT(profile[bin], 0) << int(type) << " " << angle;
    }
  }
  // Nothing beyond the table's last angle.
  std::array<double, kProfileBins> profile{};
  double flux = 0;
  BoundIntensity(Lambertian(1), profile, flux);
  EXPECT_NEAR(flux, pi, 1e-3);
  EXPECT_EQ(profile[kProfileBins - 1], 0);
}

TEST(ClassicalLight, ExtentsOfOpenings) {
  using enum formats::Opening::Shape;
  scene::ClassicalLight area = Light(ClassicalModel::kArea, 0, 0),
                        line = Light(ClassicalModel::kLinear, 0, 0);
  area.size_m.reset();
  line.size_m.reset();
  const Extent rectangle = ExtentOf(area, {kBox, 0.6, 0.3, 0}),
               ellipse = ExtentOf(area, {kEllipse, 0.6, 0.3, 0}),
               along_x = ExtentOf(line, {kBox, 1.2, 0.1, 0}),
               along_y = ExtentOf(line, {kCylinderAlongC90, 0.03, 1.5, 0.03});
  EXPECT_EQ(std::pair(rectangle.x_m, rectangle.y_m), std::pair(0.6, 0.3));
  EXPECT_FALSE(rectangle.is_ellipse);
  EXPECT_TRUE(ellipse.is_ellipse);
  EXPECT_EQ(std::pair(along_x.x_m, along_x.y_m), std::pair(1.2, 0.0));
  EXPECT_EQ(std::pair(along_y.x_m, along_y.y_m), std::pair(0.0, 1.5));
  for (const formats::Opening& opening :
       {formats::Opening{}, formats::Opening{kEllipsoid, 0.1, 0.1, 0.1},
        formats::Opening{kBox, 0.6, 0.3, 0.05}}) {
    for (const scene::ClassicalLight* light : {&area, &line})
      EXPECT_THAT([&] { ExtentOf(*light, opening); },
                  testing::ThrowsMessage<InputError>(testing::AllOf(
                      testing::HasSubstr("lamp.ies"), testing::HasSubstr("state its size"))));
    EXPECT_EQ(ExtentOf(Light(ClassicalModel::kPoint, 0, 0), opening).x_m, 0);
  }
  EXPECT_THROW(ExtentOf(line, {kBox, 0.6, 0.6, 0}), InputError);
  area.size_m = std::array{0.2, 0.1};  // what is stated holds
  EXPECT_EQ(ExtentOf(area, {kEllipsoid, 1, 1, 1}).x_m, 0.2);
}

// In the light's plane, on it, at its point, and by a table that is dark: numbers, and the right ones.
TEST(ClassicalLight, ExtremesHaveTheirAnswers) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  Photometry even;
  even.planes_deg = {0};
  even.angles_deg = {0, 180};
  even.intensity_cd = {1, 1};
  Photometry dark = Lambertian(0);
  const scene::ClassicalLight lights[] = {Light(ClassicalModel::kPoint, 0, 0, {}),
                                          Light(ClassicalModel::kLinear, 1, 0, {}),
                                          Light(ClassicalModel::kArea, 1, 1, {})};
  const std::vector<SurfacePoint> points{{{0, 0, 0}, {0, 0, 1}},      {{0, 0, 0}, {1, 0, 0}},
                                         {{2, 0, 0}, {-1, 0, 0}},     {{0.2, 0, 0}, {0, 0, -1}},
                                         {{0, 0, 1e-6}, {0, 0, -1}},  {{0, 0, -1e-6}, {0, 0, 1}},
                                         {{1e5, 0, 1e5}, {-1, 0, 0}}, {{0.5, 0, 0}, {-1, 0, 0}}};
  const GBuffer gbuffer = MakeGBuffer(device, points);
  for (const scene::ClassicalLight& light : lights)
    for (const Strategies strategies : {Strategies::kLobe, Strategies::kNewton}) {
      const EstimatorOptions options = WithStrategies(strategies, 64);
      for (const auto& e :
           LightBy(device, estimator, gbuffer, Source(device, light, even), options).irradiance)
        ASSERT_TRUE(std::isfinite(e.s[0]) && e.s[0] >= 0) << e.s[0];
      for (const auto& e :
           LightBy(device, estimator, gbuffer, Source(device, light, dark), options).irradiance)
        ASSERT_EQ(e.s[0], 0);
    }
  // In the plane of an area whose intensity does not end there: the limit from beside it.
  const std::vector<SurfacePoint> in_plane = Repeated({{{2, 0.1, 0}, {-1, 0, 0}}}, 256);
  const Lit lit = LightBy(device, estimator, MakeGBuffer(device, in_plane),
                          Source(device, lights[2], even), WithStrategies(Strategies::kLobe, 64));
  const auto statistics = OverCopies(lit.irradiance, lit.variance, 256);
  const double exact = ByQuadrature(lights[2], even, 300, 300, in_plane[0]);
  EXPECT_NEAR(statistics.mean[0], exact, 5 * statistics.standard_error[0] + 1e-3 * exact);
}

}  // namespace
}  // namespace luxfield::render
