// Rectangles and spheres as lights: their samplers, and the irradiance of every strategy against
// closed forms.
#include "luxfield/render/lights/area_light.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/render/kernels/sample/sampling_types.clh"
#include "tests/render/area_light_fixture.h"
#include "tests/render/chi_squared.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;
using std::numbers::pi;

const scene::Pose kTilted =
    scene::Translation({0.3, -0.2, 1.5}) * scene::RotationXyz({170, 20, 35});

// From 5 cm to 30 m away, whole and cut by the horizon.
std::vector<SurfacePoint> Receivers(const scene::AreaLight& light, double near, double far,
                                    int count) {
  core::Random random(kSamplingSeed, 17);
  const bool sphere = light.kind == scene::AreaLightKind::kSphere;
  std::vector<SurfacePoint> points;
  while (points.size() < static_cast<std::size_t>(count)) {
    const Vec3 away = Normalized(Vec3{random.Normal(), random.Normal(), random.Normal()});
    const double distance = near * std::pow(far / near, random.Uniform());
    const Vec3 local = (sphere ? light.radius_m + distance : distance) * away;
    const Vec3 p = light.world_from_light.Point(local);
    const Vec3 to_light = Normalized(light.world_from_light.translation - p);
    const Vec3 n =
        Normalized(to_light + 0.8 * Vec3{random.Normal(), random.Normal(), random.Normal()});
    const SurfacePoint point = RoundToFloat({p, n});
    // Not seen under too steep an angle: float32 positions leave 1e-7 m.
    if (!sphere && local.z < 0.02 * distance) continue;
    const SurfacePoint facing{point.p, to_light};
    if (ExactIrradiance(light, point) > 0.1 * ExactIrradiance(light, facing))
      points.push_back(point);
  }
  return points;
}

void ExpectIrradiance(const Device& device, MisEstimator& estimator, const scene::AreaLight& light,
                      const std::vector<SurfacePoint>& points, Strategies strategies, int samples,
                      int copies, double unseen = 0) {
  const EstimatorOptions options = WithStrategies(strategies, samples);
  const Lit lit =
      LightByArea(device, estimator, MakeGBuffer(device, Repeated(points, copies)), light, options);
  std::vector<double> exact;
  for (const auto& point : points) exact.push_back(ExactIrradiance(light, point));
  auto statistics = OverCopies(lit.irradiance, lit.variance, copies);
  // float32 of the solid angle and of the sum.
  for (std::size_t k = 0; k < exact.size(); ++k)
    statistics.standard_error[k] = std::hypot(statistics.standard_error[k], 1e-5 * exact[k]);
  ExpectUnbiased(statistics, exact, copies,
                 (options.knobs.strategies.Text() + ", " + std::to_string(samples)).c_str(),
                 unseen);
  for (const cl_uint count : lit.samples) EXPECT_EQ(count, static_cast<cl_uint>(samples));
}

TEST(AreaLight, IrradianceOfEveryStrategyIsTheClosedForm) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSamplingSeed));
  const Device device = Device::Open();
  MisEstimator estimator(device);
  const scene::AreaLight rectangle = Rectangle(0.8, 0.5, kTilted),
                         sphere = Sphere(0.4, {0.3, 0.2, 2});
  for (const scene::AreaLight* light : {&rectangle, &sphere}) {
    const auto points = Receivers(*light, 0.05, 1.5, 32);
    for (const Strategies strategies : AllStrategies())
      for (const int samples : {1, 5, 33})
        // A strategy alone, or nearly, may see some light once in thousands of samples.
        ExpectIrradiance(
            device, estimator, *light, points, strategies, samples, 512,
            strategies == Strategies::kBrdf ? 20.0 / (512 * samples) : 2.0 / (512 * samples));
  }
}

// Where samples that follow the BRDF hardly ever meet the light.
TEST(AreaLight, FarAndNarrowLights) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  const scene::AreaLight strip = Rectangle(2, 0.01, kTilted), dot = Rectangle(1e-3, 1e-3, kTilted),
                         bulb = Sphere(0.01, {0.3, 0.2, 2});
  for (const scene::AreaLight* light : {&strip, &dot, &bulb}) {
    const auto points = Receivers(*light, 0.3, 30, 32);
    for (const Strategies strategies :
         {Strategies::kBalance, Strategies::kLight, Strategies::kNewton})
      ExpectIrradiance(device, estimator, *light, points, strategies, 32, 256,
                       strategies == Strategies::kLight ? 0 : 4.0 / (256 * 32));
  }
}

// After the light.
const char* const kKernel = R"(
// One draw an item, of its own random numbers.
__kernel void Draw(LIGHT_ARGUMENTS, SURFACE_ARGUMENTS, int count, __global float4* directions,
                   __global float4* along) {
  const int k = get_global_id(0);
  Light light;
  if (k >= count || !MakeLight(LIGHT, 0, SURFACE(0), &light)) return;
  LightDraws draws = StartLightDraws(&light, 1, PixelWords(sampling, (uint)k));
  const LightSample drawn = NextLightDraw(&light, &draws);
  directions[k] = (float4)(drawn.direction, drawn.density);
  const LightSample again = LightAlong(&light, drawn.direction);
  along[k] = (float4)(again.density, again.distance, drawn.distance, 0.0f);
}
)";

// Directions in the light's frame with their densities; what LightAlong finds there is the same.
std::vector<cl_float4> Draw(const Device& device, const scene::AreaLight& light,
                            const SurfacePoint& receiver, int count) {
  const bool sphere = light.kind == scene::AreaLightKind::kSphere;
  const std::string text = std::string("#define GLOSSY 0\n#include \"kernels/mis/light_") +
                           (sphere ? "sphere" : "rectangle") + ".clh\"\n" + kKernel;
  const Program program = Program::BuildText(device, text, "area_light_test.cl");
  const GBuffer gbuffer = MakeGBuffer(device, {receiver});
  SamplingParams sampling{};
  sampling.seed_lo = static_cast<std::uint32_t>(kSamplingSeed);
  const Buffer params = Buffer::From(device, std::span<const SamplingParams>(&sampling, 1));
  const AreaLightSource source = MakeAreaLight(light);
  const Buffer light_params = Buffer::From(device, std::span(&source.params, 1));
  Buffer directions(device, count * sizeof(cl_float4)), along(device, count * sizeof(cl_float4));
  Kernel(program, "Draw")
      .Set(light_params, params, gbuffer.position, gbuffer.normal, gbuffer.albedo, gbuffer.gloss,
           gbuffer.eye, static_cast<cl_int>(count), directions, along)
      .Enqueue(static_cast<std::size_t>(count));
  const auto drawn = directions.Download<cl_float4>();
  int missed = 0;
  const auto found = along.Download<cl_float4>();
  for (int k = 0; k < count; ++k) {
    const Vec3 w{drawn[k].s[0], drawn[k].s[1], drawn[k].s[2]};
    EXPECT_NEAR(Length(w), 1, 1e-6);
    EXPECT_GT(drawn[k].s[3], 0);
    if (found[k].s[0] == 0) {
      ++missed;  // by rounding, at the rim
      continue;
    }
    EXPECT_NEAR(found[k].s[0], drawn[k].s[3], 1e-5 * drawn[k].s[3]);
    EXPECT_NEAR(found[k].s[1], found[k].s[2], 2e-3 * found[k].s[2]);
  }
  EXPECT_LT(missed, count / 500);
  return drawn;
}

// Draws over a grid of the rectangle against the solid angles of its cells (against equal areas
// where it is small), and the density against the whole.
TEST(AreaLight, ChiSquaredOfRectangles) {
  const Device device = Device::Open();
  constexpr int kCount = 100000, kGrid = 12;
  struct Case {
    double width, height;
    Vec3 receiver;  // the light's frame
  };
  for (const Case& c : {Case{0.8, 0.5, {0.1, 0.2, 0.05}}, Case{0.8, 0.5, {0.9, -0.7, 0.6}},
                        Case{4, 0.3, {1.5, 0.4, 0.2}}, Case{20, 20, {0.3, 0.1, 0.2}},
                        Case{0.1, 0.2, {0.3, 0.2, 3}}}) {
    const scene::AreaLight light = Rectangle(c.width, c.height, {});
    const SurfacePoint receiver = RoundToFloat({c.receiver, {0, 0, -1}});
    const auto corners = CornersFrom(light, receiver.p);
    const double solid_angle = std::abs(environment::PolygonSolidAngle(corners));
    const bool small = solid_angle < 0.01;
    std::vector<double> expected, observed(kGrid * kGrid, 0.0);
    for (int j = 0; j < kGrid; ++j)
      for (int i = 0; i < kGrid; ++i) {
        std::vector<Vec3> cell;
        for (const auto& [x, y] :
             {std::pair{i, j}, std::pair{i + 1, j}, std::pair{i + 1, j + 1}, std::pair{i, j + 1}})
          cell.push_back(
              Vec3{(double(x) / kGrid - 0.5) * c.width, (double(y) / kGrid - 0.5) * c.height, 0} -
              receiver.p);
        expected.push_back(small ? 1 : std::abs(environment::PolygonSolidAngle(cell)));
      }
    double inverse = 0, inverse_square = 0;
    for (const auto& draw : Draw(device, light, receiver, kCount)) {
      const double t = receiver.p.z / -draw.s[2];
      const auto bin = [&](double at, double size) {
        return std::clamp(static_cast<int>((at / size + 0.5) * kGrid), 0, kGrid - 1);
      };
      ++observed[bin(receiver.p.y + t * draw.s[1], c.height) * kGrid +
                 bin(receiver.p.x + t * draw.s[0], c.width)];
      if (!small) {
        ASSERT_NEAR(draw.s[3] * solid_angle, 1, 1e-5);
      }
      inverse += 1 / draw.s[3] / kCount;
      inverse_square += 1 / draw.s[3] / draw.s[3] / kCount;
    }
    const double scatter = std::sqrt(std::max(0.0, inverse_square - inverse * inverse) / kCount);
    EXPECT_NEAR(inverse, solid_angle, 4 * scatter + 1e-5 * solid_angle);
    EXPECT_LT(ChiSquaredDeviations(expected, observed,
                                   "rectangle of " + std::to_string(solid_angle) + " sr"),
              4);
  }
}

TEST(AreaLight, ChiSquaredOfSpheres) {
  const Device device = Device::Open();
  constexpr int kCount = 100000, kGrid = 10;
  for (const double distance : {0.5005, 0.7, 5.0, 500.0}) {
    const scene::AreaLight light = Sphere(0.5, {0, 0, 0});
    const SurfacePoint receiver = RoundToFloat({{0, 0.6 * distance, -0.8 * distance}, {0, 0, 1}});
    const double d = Length(receiver.p), s = 0.5 / d,
                 below_one = s * s / (1 + std::sqrt(1 - s * s));
    const Vec3 axis = (-1 / d) * receiver.p, tangent{1, 0, 0}, bitangent = Cross(axis, tangent);
    std::vector<double> observed(kGrid * kGrid, 0.0);
    for (const auto& draw : Draw(device, light, receiver, kCount)) {
      const Vec3 w{draw.s[0], draw.s[1], draw.s[2]};
      const double x = Dot(w, tangent), y = Dot(w, bitangent), sine2 = x * x + y * y,
                   part = sine2 / (1 + std::sqrt(1 - sine2)) / below_one,
                   turn = std::atan2(y, x) / (2 * pi) + 0.5;
      ++observed[std::clamp(static_cast<int>(part * kGrid), 0, kGrid - 1) * kGrid +
                 std::clamp(static_cast<int>(turn * kGrid), 0, kGrid - 1)];
      ASSERT_NEAR(draw.s[3] * 2 * pi * below_one, 1, distance < 0.6 ? 1e-4 : 3e-6);
    }
    EXPECT_LT(ChiSquaredDeviations(std::vector<double>(kGrid * kGrid, 1.0), observed,
                                   "sphere at " + std::to_string(distance)),
              4);
  }
}

// A wall hides one of two halves of a rectangle; a light on a wall is not hidden by it.
TEST(AreaLight, TracedShadows) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  const scene::Pose down = scene::Translation({0, 0, 1}) * scene::RotationXyz({180, 0, 0});
  const scene::AreaLight whole = Rectangle(1, 1, down),
                         half = Rectangle(0.5, 1, scene::Translation({-0.25, 0, 0}) * down);
  const SurfacePoint receiver{{0, 0, 0}, {0, 0, 1}};
  const double exact = ExactIrradiance(half, receiver);
  const GBuffer gbuffer = MakeGBuffer(device, Repeated({receiver}, 2048));
  const auto wall = Blocker(device, 0, 10, 0.5), ceiling = Blocker(device, -10, 10, 1);
  for (const Strategies strategies : AllStrategies()) {
    const EstimatorOptions options = WithStrategies(strategies, 16);
    const Lit lit = LightByArea(device, estimator, gbuffer, whole, options, wall.get());
    const auto hidden = OverCopies(lit.irradiance, lit.variance, 2048);
    EXPECT_NEAR(hidden.mean[0], exact, 4.5 * hidden.standard_error[0]);
    const Lit open = LightByArea(device, estimator, gbuffer, whole, options),
              under = LightByArea(device, estimator, gbuffer, whole, options, ceiling.get());
    for (std::size_t k = 0; k < open.irradiance.size(); ++k)
      ASSERT_EQ(open.irradiance[k].s[0], under.irradiance[k].s[0]);
  }
}

// Behind a rectangle, inside a sphere, facing away, black: nothing, and nothing that is no number.
TEST(AreaLight, ExtremesHaveTheirAnswers) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  const scene::AreaLight rectangle = Rectangle(1, 1, {}), sphere = Sphere(1, {});
  scene::AreaLight black = rectangle;
  black.radiance = {0, 0, 0};
  const std::vector<SurfacePoint> in_front{{{0, 0, 0.5}, {0, 0, -1}}};
  const std::vector<std::pair<scene::AreaLight, std::vector<SurfacePoint>>> dark{
      {rectangle, {{{0, 0, -1}, {0, 0, 1}}, {{0, 0, 0}, {0, 0, -1}}, {{0.1, 0.2, 1}, {0, 0, 1}}}},
      {sphere, {{{0.5, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {0, 0, 1}}, {{0, 0, 3}, {0, 0, 1}}}},
      {black, in_front}};
  for (const Strategies strategies : AllStrategies())
    for (const auto& [light, points] : dark)
      for (const auto& e : LightByArea(device, estimator, MakeGBuffer(device, points), light,
                                       WithStrategies(strategies, 64))
                               .irradiance)
        for (int c = 0; c < 3; ++c) ASSERT_EQ(e.s[c], 0);
  // On the rectangle all but, and far from everything.
  for (const double z : {1e-6, 1e-3, 1e3, 1e6}) {
    const std::vector<SurfacePoint> points =
        Repeated({RoundToFloat({{0.1, 0.2, z}, {0, 0, -1}})}, 256);
    const Lit lit = LightByArea(device, estimator, MakeGBuffer(device, points), rectangle,
                                WithStrategies(Strategies::kNewton, 64));
    const auto statistics = OverCopies(lit.irradiance, lit.variance, 256);
    const double exact = ExactIrradiance(rectangle, points[0]);
    EXPECT_NEAR(statistics.mean[0], exact, 5 * statistics.standard_error[0] + 1e-4 * exact) << z;
  }
}

}  // namespace
}  // namespace luxfield::render
