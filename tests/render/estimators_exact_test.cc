// `exact` on the OpenCL device against brute-force quadrature in double and against lightfield's
// closed form.
#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/lightfield/light_vector.h"
#include "luxfield/render/estimators/exact.h"
#include "tests/render/brute_force.h"
#include "tests/render/estimator_fixture.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

using lightfield::BasisKind;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 20140101;

Vec3 RandomDirection(core::Random& random) {
  const double z = 2 * random.Uniform() - 1, angle = 2 * std::numbers::pi * random.Uniform();
  const double radius = std::sqrt(1 - z * z);
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

// A receiver at a distance of 0.05 to 100 m in front of I, seen within 60 degrees of the axis, any
// normal.
SurfacePoint RandomReceiver(core::Random& random, double delta_m) {
  const double distance = 0.05 * std::pow(2000.0, random.Uniform());
  Vec3 direction;
  do direction = RandomDirection(random);
  while (direction.z < 0.5);
  Vec3 p = distance * direction;
  // Windows meet the images for every direction within the field of view; keep most receivers
  // inside it.
  if (random.Uniform() < 0.7) p = {0.3 * p.x, 0.3 * p.y, p.z};
  p.z += delta_m;
  return RoundToFloat({p, RandomDirection(random)});
}

TEST(Exact, MatchesBruteForceAtAThousandReceivers) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const auto exact = MakeEstimator("exact", device);
  double worst = 0, worst_cut = 0, worst_closed = 0;
  int lit = 0, cut = 0;
  for (const char* kind : {"rings", "facets", "filament", "noise"}) {
    LuminaireShape shape;
    shape.width = 37;
    shape.height = 29;
    const auto field = StructuredLuminaire(kind, shape, kSeed);
    const LuminaireOnDevice luminaire(device, field);
    core::Random random(kSeed, 1);
    std::vector<SurfacePoint> points(250);
    for (auto& point : points) point = RandomReceiver(random, shape.delta_m);
    // A fifth of the receivers have a horizon through the lamp.
    for (std::size_t k = 0; k < points.size(); k += 5) {
      const Vec3 u{0.02 * (random.Uniform() - 0.5), 0.02 * (random.Uniform() - 0.5), 0};
      const Vec3 ray = Normalized(points[k].p - u);
      points[k] = RoundToFloat({points[k].p, Normalized(Cross(ray, RandomDirection(random)))});
    }
    const Lit result = LightGBuffer(device, *exact, MakeGBuffer(device, points), luminaire);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto [p, n] = points[k];
      const BruteForce judge = BruteForceIrradiance(field, p, n);
      const double size = Length(judge.j);
      const double value = result.irradiance[k].s[0];
      if (size == 0) {
        EXPECT_EQ(value, 0);
        continue;
      }
      ++lit;
      const double closed = lightfield::ExactIrradiance(field, p, n)[0];
      worst_closed = std::max(worst_closed, std::abs(value - closed) / size);
      if (lightfield::HorizonCutsSupport(field.geometry, p, n)) {
        if (closed == 0) continue;
        ++cut;
        // The judge's nodes do not follow the horizon: it is good to about 1e-3 here, the closed
        // form is the judge.
        worst_cut = std::max(worst_cut, std::abs(value - closed) / size);
        EXPECT_NEAR(closed, judge.irradiance, 2e-3 * size);
      } else {
        worst = std::max(worst, std::abs(value - judge.irradiance) / size);
      }
    }
  }
  std::printf(
      "%d lit receivers, %d with a cut horizon; worst error / |J|: %.2e, cut %.2e, to the closed "
      "form %.2e\n",
      lit, cut, worst, worst_cut, worst_closed);
  EXPECT_GT(lit, 600);
  EXPECT_GT(cut, 50);
  EXPECT_LT(worst, 1e-5);
  EXPECT_LT(worst_cut, 1e-5);
}

// Largest error / |J| over `points`, judged by lightfield's closed form; also checks that dark
// points are dark.
double WorstError(const Device& device, const lightfield::LightField& field,
                  const std::vector<SurfacePoint>& points, int* lit = nullptr) {
  const auto exact = MakeExact(device);
  const LuminaireOnDevice luminaire(device, field);
  const Lit result = LightGBuffer(device, *exact, MakeGBuffer(device, points), luminaire);
  double worst = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto judge = lightfield::ExactIrradiance(field, points[k].p, points[k].n);
    const auto j = lightfield::ClosedFormLightVector(field, points[k].p);
    for (int channel = 0; channel < 3; ++channel) {
      const double size = Length(j.j[channel]), value = result.irradiance[k].s[channel];
      EXPECT_TRUE(std::isfinite(value)) << "point " << k;
      if (size == 0) {
        EXPECT_EQ(value, 0) << "point " << k;
        continue;
      }
      if (lit) ++*lit;
      worst = std::max(worst, std::abs(value - judge[channel]) / size);
    }
  }
  return worst;
}

// Every other four of them are neighbours, which share loads of texels; the others see different
// windows.
std::vector<SurfacePoint> ReceiversAtDistance(double D, double delta, double spread, int count,
                                              std::uint64_t seed) {
  core::Random random(seed, 2);
  std::vector<SurfacePoint> points;
  Vec3 p;
  for (int k = 0; k < count; ++k) {
    const double x = spread * (random.Uniform() - 0.5), y = spread * (random.Uniform() - 0.5);
    if (k % 8 < 5)
      p = {x, y, delta + D};
    else
      p = {p.x + 1e-3 * x, p.y + 1e-3 * y, delta + D * (1 + 1e-3 * random.Uniform())};
    points.push_back(RoundToFloat({p, RandomDirection(random)}));
  }
  return points;
}

TEST(Exact, AllBasesAndColour) {
  const Device device = Device::Open();
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2})
    for (const double a : {-1.0, 0.5, 1.0}) {
      if (kind != BasisKind::kQuadratic && a != 0.5) continue;
      LuminaireShape shape;
      shape.basis = lightfield::Basis::Make(kind, a);
      shape.channels = 3;
      const auto field = StructuredLuminaire("noise", shape, 3);
      int lit = 0;
      std::vector<SurfacePoint> points = ReceiversAtDistance(0.4, shape.delta_m, 0.3, 40, 4);
      EXPECT_LT(WorstError(device, field, points, &lit), 1e-5);
      EXPECT_GT(lit, 60);
      // The closed form itself is judged once per basis by quadrature.
      const BruteForce judge = BruteForceIrradiance(field, points[0].p, points[0].n);
      EXPECT_NEAR(Length(lightfield::ClosedFormLightVector(field, points[0].p).j[0] - judge.j), 0,
                  1e-10 * Length(judge.j));
    }
}

TEST(Exact, DistancesFromOneNanometreToAThousandKilometres) {
  const Device device = Device::Open();
  for (const double delta : {0.001, 0.3, 10.0})
    for (const double D : {1e-9, 1e-6, 1e-3, 0.05, 1.0, 1e3, 1e6}) {
      LuminaireShape shape;
      shape.delta_m = delta;
      const auto field = StructuredLuminaire("noise", shape, 5);
      // Float32 receivers cannot lie nearer to I than an ulp of delta; RoundToFloat moves them
      // there.
      int lit = 0;
      const double worst =
          WorstError(device, field, ReceiversAtDistance(D, delta, 0.2, 60, 6), &lit);
      std::printf("delta %g m, D %g m: worst error / |J| %.1e, %d lit\n", delta, D, worst, lit);
      EXPECT_LT(worst, 1e-5);
      EXPECT_GT(lit, 60);
    }
}

TEST(Exact, BetweenThePlanesOnThemAndBehind) {
  const Device device = Device::Open();
  LuminaireShape shape;
  shape.delta_m = 0.25;  // a float: receivers lie on I exactly
  const auto field = StructuredLuminaire("noise", shape, 7);
  for (const double z : {0.25, 0.2499, 0.2, 0.1, 0.01, 0.001}) {
    int lit = 0;
    const double worst =
        WorstError(device, field, ReceiversAtDistance(z - 0.25, 0.25, 0.1, 60, 8), &lit);
    std::printf("z %g m: worst error / |J| %.1e, %d lit\n", z, worst, lit);
    EXPECT_LT(worst, 1e-5);
    EXPECT_GT(lit, 60);
  }
  for (const double z : {0.0, -1e-6, -1.0, -100.0})
    EXPECT_EQ(WorstError(device, field, ReceiversAtDistance(z - 0.25, 0.25, 0.1, 20, 9)), 0);
  // Nearer to F than min_z (some 1e-7 m) only finiteness is promised.
  const auto exact = MakeEstimator("exact", device);
  const LuminaireOnDevice luminaire(device, field);
  for (const double z : {1e-8, 1e-20, 1e-40})
    for (const auto& value :
         LightGBuffer(device, *exact,
                      MakeGBuffer(device, ReceiversAtDistance(z - 0.25, 0.25, 0.1, 20, 9)),
                      luminaire)
             .irradiance)
      EXPECT_TRUE(std::isfinite(value.s[0]));
}

TEST(Exact, WindowsOfEverySize) {
  const Device device = Device::Open();
  struct Case {
    const char* what;
    int width, height;
    double spacing_m;
  };
  for (const Case& c :
       {Case{"window smaller than a texel", 3, 2, 0.001}, Case{"one texel", 1, 1, 0.0165},
        Case{"hundreds of texels", 700, 300, 0.05}, Case{"thousands", 5000, 3, 0.05}}) {
    LuminaireShape shape;
    shape.width = c.width;
    shape.height = c.height;
    shape.spacing_m = c.spacing_m;
    const auto field = StructuredLuminaire("noise", shape, 10);
    int lit = 0;
    const double worst =
        WorstError(device, field, ReceiversAtDistance(0.7, shape.delta_m, 0.2, 24, 11), &lit);
    std::printf("%s: worst error / |J| %.1e, %d lit\n", c.what, worst, lit);
    EXPECT_LT(worst, 1e-5);
    EXPECT_GT(lit, 20);
  }
}

TEST(Exact, WindowsOffTheImageAndOnTexelBorders) {
  const Device device = Device::Open();
  LuminaireShape shape;
  // Powers of two: knots project exactly onto texel borders at D = delta.
  shape.delta_m = 0.5;
  shape.spacing_m = 0.0625;
  shape.image_m = 1;
  shape.width = shape.height = 32;
  const auto field = StructuredLuminaire("facets", shape, 12);
  std::vector<SurfacePoint> points;
  for (int k = -40; k <= 40; ++k) points.push_back({{k / 16.0, k / 32.0, 1.0}, {0, 0, -1}});
  int lit = 0;
  EXPECT_LT(WorstError(device, field, points, &lit), 1e-5);
  EXPECT_GT(lit, 30);
  EXPECT_LT(lit, 3 * 81);  // some windows lie wholly off the image
  // Every window does: no light, exactly.
  for (auto& point : points) point.p.x += 40;
  lit = 0;
  EXPECT_EQ(WorstError(device, field, points, &lit), 0);
  EXPECT_EQ(lit, 0);
}

TEST(Exact, GrazingNormals) {
  const Device device = Device::Open();
  LuminaireShape shape;
  const auto field = StructuredLuminaire("rings", shape, 13);
  std::vector<SurfacePoint> points;
  core::Random random(14, 0);
  for (int k = 0; k < 200; ++k) {
    const Vec3 p{0.1 * (random.Uniform() - 0.5), 0.1 * (random.Uniform() - 0.5), 1.3};
    const Vec3 ray =
        Normalized(p - Vec3{0.05 * (random.Uniform() - 0.5), 0.05 * (random.Uniform() - 0.5), 0});
    const Vec3 side = Normalized(Cross(ray, RandomDirection(random)));
    const double tilt = 1e-3 * std::pow(10.0, -4 * random.Uniform()) * (k % 2 ? 1 : -1);
    points.push_back(RoundToFloat({p, Normalized(side + tilt * ray)}));
  }
  EXPECT_LT(WorstError(device, field, points), 1e-5);
}

// Receivers along a scan line with steps in depth, as a picture has them; every 13th normal has a
// horizon through the lamp.
std::vector<SurfacePoint> ScanLine(int count, double delta) {
  core::Random random(19, 0);
  std::vector<SurfacePoint> points;
  for (int k = 0; k < count; ++k) {
    const double depth = delta + (k % 30 < 18 ? 0.4 : 2.1) + 1e-3 * k;
    const Vec3 p{0.002 * k - 0.1, 0.03, depth};
    Vec3 n = Normalized(Vec3{0.1 * random.Uniform(), 0.3, -1});
    if (k % 13 == 0) n = Normalized(Cross(p, RandomDirection(random)));
    points.push_back(RoundToFloat({p, n}));
  }
  return points;
}

// One pixel per work-item is what GPUs run; neighbours share loads on CPUs. Each is judged by the
// closed form, so that both are tested on whatever device is here.
TEST(Exact, EveryCutGivesTheClosedForm) {
  const Device device = Device::Open();
  for (const int channels : {1, 3}) {
    LuminaireShape shape;
    shape.grid_width = 14;  // more than a block of basis functions
    shape.grid_height = 5;
    shape.width = 90;  // windows longer than a chunk of texels
    shape.height = 70;
    shape.channels = channels;
    const auto field = StructuredLuminaire("noise", shape, 20);
    const LuminaireOnDevice luminaire(device, field);
    const auto points = ScanLine(131, shape.delta_m);
    GBuffer gbuffer = MakeGBuffer(device, points);
    auto position = gbuffer.position.Download<cl_float4>();
    for (std::size_t k = 5; k < position.size(); k += 11) position[k].s[3] = 0;  // nothing hit
    gbuffer.position.Upload(std::span<const cl_float4>(position));
    int lit = 0;
    double worst = 0, worst_spread = 0;
    std::vector<cl_float4> first;
    for (const char* cut :
         {"group=32,pixels=1,shared=1", "group=1,pixels=1,shared=1", "group=32,pixels=4,shared=4",
          "group=7,pixels=8,shared=4", "group=1,pixels=32,shared=2", "pixels=1,shared=1,lanes=4",
          "pixels=8,shared=4,lanes=8", "pixels=8,shared=4,lanes=16"}) {
      const auto exact = MakeExact(device.WithTuning(ParseTuning(cut, device.tuning())));
      const auto result = LightGBuffer(device, *exact, gbuffer, luminaire).irradiance;
      if (first.empty()) first = result;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const auto judge = lightfield::ExactIrradiance(field, points[k].p, points[k].n);
        const auto j = lightfield::ClosedFormLightVector(field, points[k].p);
        for (int channel = 0; channel < channels; ++channel) {
          const double size = Length(j.j[channel]), value = result[k].s[channel];
          if (position[k].s[3] == 0) {
            EXPECT_EQ(value, 0);
            continue;
          }
          lit += value > 0;
          worst = std::max(worst, std::abs(value - judge[channel]) / size);
          worst_spread = std::max(worst_spread, std::abs(value - first[k].s[channel]) / size);
        }
      }
    }
    std::printf("%d channels: worst error / |J| %.1e, between cuts %.1e\n", channels, worst,
                worst_spread);
    EXPECT_LT(worst, 1e-5);
    // Only the order of some 500 terms and the chunks' borders differ.
    EXPECT_LT(worst_spread, 2e-6);
    EXPECT_GT(lit, 450 * channels);
  }
}

TEST(Exact, SplittingThePictureChangesRoundingOnly) {
  const Device device = Device::Open();
  LuminaireShape shape;
  const auto field = StructuredLuminaire("facets", shape, 21);
  const LuminaireOnDevice luminaire(device, field);
  const auto exact = MakeExact(device);
  const auto points = ScanLine(101, shape.delta_m);
  const auto whole = LightGBuffer(device, *exact, MakeGBuffer(device, points), luminaire);
  for (const std::size_t cut : {1, 2, 3, 50}) {
    const std::vector<SurfacePoint> parts[2] = {{points.begin(), points.begin() + cut},
                                                {points.begin() + cut, points.end()}};
    std::vector<cl_float4> joined;
    for (const auto& part : parts) {
      const auto lit = LightGBuffer(device, *exact, MakeGBuffer(device, part), luminaire);
      joined.insert(joined.end(), lit.irradiance.begin(), lit.irradiance.end());
    }
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double size = Length(lightfield::ClosedFormLightVector(field, points[k].p).j[0]);
      EXPECT_NEAR(joined[k].s[0], whole.irradiance[k].s[0], 2e-6 * size) << cut << " " << k;
    }
  }
}

// docs/theory.md 12: an all-zero image gives nothing, one lit texel is seen as precisely as any
// light, also through the rim of a basis function, where its weight is a small part of the others',
// and eight decades in one window lose nothing.
TEST(Exact, ImagesAtTheExtremes) {
  const Device device = Device::Open();
  LuminaireShape shape;
  const auto points = ReceiversAtDistance(0.6, shape.delta_m, 0.2, 64, 22);
  lightfield::LightField field = EmptyLuminaire(shape);
  EXPECT_EQ(WorstError(device, field, points), 0);
  int lit = 0;
  double worst = 0;
  for (int texel = 0; texel < 40 * 30; texel += 7) {
    std::fill(field.data.begin(), field.data.end(), 0.0f);
    field.image(2, 0)[texel] = 1;
    worst = std::max(worst, WorstError(device, field, points, &lit));
  }
  std::printf("one lit texel: worst error / |J| %.1e, %d lit\n", worst, lit);
  EXPECT_LT(worst, 1e-5);
  EXPECT_GT(lit, 500);
  core::Random random(23, 0);
  for (float& c : field.data)
    c = random.Uniform() < 0.02 ? 1e8f : static_cast<float>(random.Uniform());
  EXPECT_LT(WorstError(device, field, points), 1e-5);
  for (float& c : field.data) c *= 1e-30f;
  EXPECT_LT(WorstError(device, field, points), 1e-5);
  // Denormals may be taken as 0, nothing worse.
  std::fill(field.data.begin(), field.data.end(), 1e-40f);
  EXPECT_LE(WorstError(device, field, points), 1);
}

// Rounding of equal terms does not average out: the longest sums there are.
TEST(Exact, UniformLight) {
  const Device device = Device::Open();
  LuminaireShape shape;
  shape.grid_width = 2;
  shape.grid_height = 24;
  shape.width = 40;
  shape.height = 1000;
  auto field = EmptyLuminaire(shape);
  std::fill(field.data.begin(), field.data.end(), 0.7f);
  const double worst =
      WorstError(device, field, ReceiversAtDistance(1.0, shape.delta_m, 0.3, 40, 24));
  std::printf("uniform light: worst error / |J| %.1e\n", worst);
  EXPECT_LT(worst, 1e-5);
}

TEST(Exact, NegativeCoefficientsAndLinearity) {
  const Device device = Device::Open();
  LuminaireShape shape;
  auto field = StructuredLuminaire("noise", shape, 15);
  const auto points = ReceiversAtDistance(0.5, shape.delta_m, 0.2, 40, 16);
  for (std::size_t k = 0; k < field.data.size(); k += 3) field.data[k] = -field.data[k];
  // Against the size of the light of |C|: sums of both signs cancel.
  auto absolute = field;
  for (float& c : absolute.data) c = std::abs(c);
  const auto exact = MakeEstimator("exact", device);
  const LuminaireOnDevice luminaire(device, field);
  const Lit result = LightGBuffer(device, *exact, MakeGBuffer(device, points), luminaire);
  bool negative = false;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double size = Length(lightfield::ClosedFormLightVector(absolute, points[k].p).j[0]);
    const double judge = lightfield::ExactIrradiance(field, points[k].p, points[k].n)[0];
    EXPECT_NEAR(result.irradiance[k].s[0], judge, 1e-5 * size);
    negative |= judge < 0;
  }
  EXPECT_TRUE(negative);
}

TEST(Exact, PosesAndSeveralLuminairesAdd) {
  const Device device = Device::Open();
  const auto exact = MakeEstimator("exact", device);
  LuminaireShape shape;
  shape.channels = 3;
  const auto field = StructuredLuminaire("filament", shape, 17);
  const LuminaireOnDevice luminaire(device, field);
  const scene::Pose poses[2] = {scene::LookAt({1, 2, 3}, {4, 2.5, 2}, {0, 1, 0}),
                                scene::LookAt({3, -1, 0}, {4, 2.5, 2}, {0, 0, 1})};
  std::vector<SurfacePoint> points;
  core::Random random(18, 0);
  for (int k = 0; k < 30; ++k)
    points.push_back(RoundToFloat(
        {{4 + 0.3 * random.Uniform(), 2.5 + 0.3 * random.Uniform(), 2 + 0.3 * random.Uniform()},
         RandomDirection(random)}));
  const GBuffer gbuffer = MakeGBuffer(device, points);
  Lighting lighting(device, gbuffer);
  for (const auto& pose : poses)
    exact->Light({gbuffer}, PosedLuminaire{luminaire, pose}, {}, lighting);
  const auto result = lighting.irradiance.Download<cl_float4>();
  int lit = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    double judge[3] = {0, 0, 0}, size[3] = {0, 0, 0};
    for (const auto& pose : poses) {
      const auto inverse = pose.Inverse();
      const Vec3 p = inverse.Point(points[k].p), n = inverse.Vector(points[k].n);
      const auto e = lightfield::ExactIrradiance(field, p, n);
      const auto j = lightfield::ClosedFormLightVector(field, p);
      for (int channel = 0; channel < 3; ++channel) {
        judge[channel] += e[channel];
        size[channel] += Length(j.j[channel]);
      }
    }
    lit += judge[1] > 0;
    // Float32 rotations turn a receiver by 1e-7 rad: some 1e-5 texels here, times the contrast of
    // neighbouring texels.
    for (int channel = 0; channel < 3; ++channel)
      EXPECT_NEAR(result[k].s[channel], judge[channel], 1e-4 * size[channel]) << k;
  }
  EXPECT_GT(lit, 10);
}

}  // namespace
}  // namespace luxfield::render
