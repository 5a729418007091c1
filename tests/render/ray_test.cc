// Rays of devices against double precision and against Embree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/render/scene/device_scene.h"
#include "tests/render/triangle_soup.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using scene::Geometry;
using scene::Vec3;

using scene::PackedHit;
using scene::PackedRay;
using scene::RayRange;

// Rays traced by the host and by kernels.
struct TracedBy {
  const char* name;
  bool host;
};
constexpr TracedBy kHost{"host", true}, kKernel{"kernel", false};

Device DeviceThatTraces(const TracedBy& by, int group = 64) {
  const Device device = Device::Open();
  DeviceTuning tuning = device.tuning();
  tuning.host_rays = by.host;
  tuning.group_size = group;
  return device.WithTuning(tuning);
}

struct Answers {
  std::vector<PackedHit> hits;
  std::vector<cl_uchar> hidden;
};

Answers Trace(const Device& device, const Geometry& geometry, const std::vector<PackedRay>& rays) {
  const auto scene = MakeRayScene(device, geometry);
  const Buffer input = Buffer::From(device, rays), hits(device, rays.size() * sizeof(PackedHit)),
               hidden(device, rays.size());
  const RayBuffers batch{.rays = input, .group_count = rays.size()};
  scene->Intersect(batch, hits);
  scene->Occluded(batch, hidden);
  return {hits.Download<PackedHit>(), hidden.Download<cl_uchar>()};
}

Vec3 ToVec3(const float (&v)[3]) { return {v[0], v[1], v[2]}; }
Vec3 ToVec3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

PackedRay MakeRay(Vec3 origin, Vec3 direction, double t_max = std::numeric_limits<float>::max()) {
  PackedRay ray{};
  const Vec3 parts[2] = {origin, direction};
  float* out[2] = {ray.origin, ray.direction};
  for (int i = 0; i < 2; ++i) {
    out[i][0] = static_cast<float>(parts[i].x);
    out[i][1] = static_cast<float>(parts[i].y);
    out[i][2] = static_cast<float>(parts[i].z);
  }
  ray.t_max = static_cast<float>(t_max);
  return ray;
}

// All triangles in double precision. `sure` is false where rounding in float32 may decide: the ray
// passes within `margin` of an edge, or a hit lies that near to an end of the ray.
struct Truth {
  double t = std::numeric_limits<double>::infinity();
  bool sure = true;
};

Truth BruteForce(const Geometry& geometry, const PackedRay& ray, double margin) {
  Truth truth;
  const Vec3 o = ToVec3(ray.origin), d = ToVec3(ray.direction);
  for (std::size_t i = 0; i < geometry.triangles.size(); ++i) {
    const Vec3 a = ToVec3(geometry.corner(i, 0)) - o, b = ToVec3(geometry.corner(i, 1)) - o,
               c = ToVec3(geometry.corner(i, 2)) - o;
    const Vec3 normal = Cross(b - a, c - a);
    const double area2 = Length(normal), slope = Dot(normal, d);
    if (area2 == 0) continue;
    // Within `margin` of the plane over the whole triangle's extent: grazing.
    const double sine = std::abs(slope) / (area2 * Length(d));
    if (sine < 1e-5) {
      if (std::abs(Dot(a, normal)) / area2 < 1e-3) truth.sure = false;
      continue;
    }
    const double t = Dot(a, normal) / slope;
    const Vec3 p = t * d;
    const auto distance = [&](Vec3 from, Vec3 to) {  // to the edge's line, positive inside
      return Dot(Cross(to - from, p - from), normal) / (area2 * Length(to - from));
    };
    const double inside = std::min({distance(a, b), distance(b, c), distance(c, a)});
    const double slack = margin / sine;
    if (std::abs(inside) < slack && t * Length(d) > -slack) truth.sure = false;
    if (inside < 0) continue;
    if (std::abs(t) * Length(d) < slack || std::abs(t - ray.t_max) * Length(d) < slack)
      truth.sure = false;
    if (t > 0 && t < ray.t_max) truth.t = std::min(truth.t, t);
  }
  return truth;
}

std::vector<PackedRay> Rays(int count, std::uint64_t seed) {
  core::Random random(seed, 2);
  std::vector<PackedRay> queries;
  for (int i = 0; i < count; ++i) {
    const Vec3 origin = 6.0 * Vec3{random.Normal(), random.Normal(), random.Normal()};
    Vec3 direction{random.Normal(), random.Normal(), random.Normal()};
    switch (i % 5) {
      case 0:
        direction = {i % 2 ? 1.0 : -1.0, 0, 0};
        break;
      case 1:
        direction = {0, 0, i % 2 ? -3.0 : 3.0};
        break;
      case 2:
        direction.y = i % 2 ? 0.0 : -0.0;
        break;
      case 3:  // grazing the floor's top at z = -5.75
        direction.z = 1e-4 * random.Normal();
        break;
      default:
        break;
    }
    queries.push_back(MakeRay(origin, direction,
                              i % 3 ? 5 * random.Uniform() : std::numeric_limits<float>::max()));
  }
  return queries;
}

class Traversal : public testing::TestWithParam<TracedBy> {};

INSTANTIATE_TEST_SUITE_P(By, Traversal, testing::Values(kHost, kKernel),
                         [](const auto& by) { return std::string(by.param.name); });

TEST_P(Traversal, AgreesWithDoublePrecision) {
  const std::uint64_t seed = TestSeed(20);
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  const Geometry geometry = TriangleSoup(150, seed);
  const auto rays = Rays(20000, seed);
  const auto [hits, hidden] = Trace(DeviceThatTraces(GetParam()), geometry, rays);
  int sure = 0, hit_count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    // Coordinates reach 30 m, where float32 steps are 2e-6 m.
    const auto truth = BruteForce(geometry, rays[i], 1e-4);
    if (!truth.sure) continue;
    ++sure;
    const bool hit = std::isfinite(truth.t);
    hit_count += hit;
    ASSERT_EQ(hits[i].triangle >= 0, hit) << "ray " << i;
    ASSERT_EQ(hidden[i], hit) << "ray " << i;
    if (!hit) {
      EXPECT_TRUE(std::isinf(hits[i].t));
      continue;
    }
    EXPECT_NEAR(hits[i].t, truth.t, 1e-4 * (1 + truth.t)) << "ray " << i;
    const auto triangle = static_cast<std::size_t>(hits[i].triangle);
    const Vec3 a = ToVec3(geometry.corner(triangle, 0)), b = ToVec3(geometry.corner(triangle, 1)),
               c = ToVec3(geometry.corner(triangle, 2));
    const Vec3 at = a + hits[i].b * (b - a) + hits[i].c * (c - a),
               expected = ToVec3(rays[i].origin) + truth.t * ToVec3(rays[i].direction);
    // What rounding moves a hit by grows with 1 / sine of the angle that the ray meets the plane at.
    const Vec3 normal = Normalized(Cross(b - a, c - a));
    const double sine = std::abs(Dot(normal, Normalized(ToVec3(rays[i].direction))));
    EXPECT_LT(Length(at - expected), 2e-5 / sine) << "ray " << i;
  }
  EXPECT_GT(sure, 19000);
  EXPECT_GT(hit_count, 3000);
}

TEST_P(Traversal, DoesNotDependOnTheWorkGroup) {
  const Geometry geometry = TriangleSoup(50, 3);
  const auto rays = Rays(1000, 3);
  const auto one = Trace(DeviceThatTraces(GetParam(), 1), geometry, rays),
             many = Trace(DeviceThatTraces(GetParam(), 250), geometry, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(one.hits[i].triangle, many.hits[i].triangle);
    EXPECT_EQ(one.hits[i].t, many.hits[i].t);
    EXPECT_EQ(one.hidden[i], many.hidden[i]);
  }
}

// A ray ends before t_max and starts behind t_min: a quad at either is not on it.
TEST_P(Traversal, RaysAreOpenIntervals) {
  Geometry geometry;
  for (const double z : {1.0, 2.0})
    scene::AppendQuad({-1, -1, z}, {2, 0, 0}, {0, 2, 0}, 0, geometry);
  const double inside = std::nextafter(2.0f, 3.0f);
  std::vector<PackedRay> rays;
  for (const auto& [t_min, t_max] : std::vector<std::pair<double, double>>{
           {0, 1}, {0, 1.5}, {1, 2}, {1, inside}, {2, 3}, {0, 0}, {0, -1}}) {
    rays.push_back(MakeRay({0.25, 0.125, 0}, {0, 0, 1}, t_max));
    rays.back().t_min = static_cast<float>(t_min);
  }
  const auto [hits, hidden] = Trace(DeviceThatTraces(GetParam()), geometry, rays);
  EXPECT_THAT(hidden, testing::ElementsAre(0, 1, 0, 1, 0, 0, 0));
  for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(hits[i].triangle >= 0, hidden[i]);
}

// Of a group only the rays in its range are traced, whatever lies in the other slots.
TEST_P(Traversal, TracesTheRangesOfGroups) {
  constexpr int kGroups = 301, kSlots = 7;
  const Device device = DeviceThatTraces(GetParam());
  const Geometry geometry = TriangleSoup(60, 4);
  auto rays = Rays(kGroups * kSlots, 4);
  const auto [hits, hidden] = Trace(device, geometry, rays);
  core::Random random(4, 3);
  std::vector<RayRange> ranges;
  for (int g = 0; g < kGroups; ++g) {
    const int begin = static_cast<int>(random() % (kSlots + 1)),
              end = static_cast<int>(random() % (kSlots + 1));
    ranges.push_back({begin, end});
    for (int k = 0; k < kSlots; ++k)
      if (k < begin || k >= end)
        rays[g * kSlots + k].direction[0] = std::numeric_limits<float>::quiet_NaN();
  }
  const auto scene = MakeRayScene(device, geometry);
  const Buffer input = Buffer::From(device, rays), range_buffer = Buffer::From(device, ranges);
  constexpr PackedHit kOther{-5, -7, 0, 0};
  const Buffer some_hits = Buffer::From(device, std::vector<PackedHit>(rays.size(), kOther)),
               some_hidden = Buffer::From(device, std::vector<cl_uchar>(rays.size(), 9));
  const RayBuffers batch{
      .rays = input, .group_count = kGroups, .group_size = kSlots, .ranges = &range_buffer};
  scene->Intersect(batch, some_hits);
  scene->Occluded(batch, some_hidden);
  const auto got_hits = some_hits.Download<PackedHit>();
  const auto got_hidden = some_hidden.Download<cl_uchar>();
  for (int i = 0; i < kGroups * kSlots; ++i) {
    const RayRange range = ranges[i / kSlots];
    const bool traced = i % kSlots >= range.begin && i % kSlots < range.end;
    ASSERT_EQ(got_hits[i].triangle, traced ? hits[i].triangle : kOther.triangle) << i;
    ASSERT_EQ(got_hidden[i], traced ? hidden[i] : 9) << i;
  }
}

// A closed surface seen from inside has no gaps: every ray hits, also those through its edges.
TEST_P(Traversal, LeavesNoGapBetweenNeighbours) {
  constexpr int kRings = 24;
  Geometry sphere;
  const auto point = [](int i, int j) {
    const double theta = M_PI * i / kRings, phi = 2 * M_PI * j / kRings;
    return scene::Vertex{
        {static_cast<float>(std::sin(theta) * std::cos(phi)),
         static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))},
        {},
        {}};
  };
  const auto index = [](int i, int j) {
    // One vertex per pole and one at the seam, so that neighbours share them bit by bit.
    if (i == 0) return 0u;
    if (i == kRings) return 1u;
    return static_cast<std::uint32_t>(2 + (i - 1) * kRings + j % kRings);
  };
  sphere.vertices = {point(0, 0), point(kRings, 0)};
  for (int i = 1; i < kRings; ++i)
    for (int j = 0; j < kRings; ++j) sphere.vertices.push_back(point(i, j));
  for (int i = 0; i < kRings; ++i)
    for (int j = 0; j < kRings; ++j) {
      sphere.triangles.push_back({{index(i, j), index(i + 1, j), index(i + 1, j + 1)}, 0});
      sphere.triangles.push_back({{index(i, j), index(i + 1, j + 1), index(i, j + 1)}, 0});
    }
  constexpr std::uint64_t kSeed = 5;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  std::vector<PackedRay> rays;
  for (int n = 0; n < 20000; ++n) {
    const Vec3 origin = 0.3 * Vec3{random.Uniform(), random.Uniform(), random.Uniform()};
    const auto& triangle = sphere.triangles[random() % sphere.triangles.size()];
    const auto& a = sphere.vertices[triangle.vertex[n % 3]].position;
    const auto& b = sphere.vertices[triangle.vertex[(n + 1) % 3]].position;
    const double share = n % 10 ? random.Uniform() : 0;  // a point of an edge, or a vertex
    rays.push_back(MakeRay(origin, (1 - share) * ToVec3(a) + share * ToVec3(b) - origin));
  }
  const auto [hits, hidden] = Trace(DeviceThatTraces(GetParam()), sphere, rays);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    EXPECT_GE(hits[i].triangle, 0) << "ray " << i;
    EXPECT_EQ(hidden[i], 1) << "ray " << i;
  }
}

TEST_P(Traversal, AnEmptySceneHidesNothing) {
  const auto [hits, hidden] = Trace(DeviceThatTraces(GetParam()), {}, Rays(10, 1));
  EXPECT_THAT(hidden, testing::Each(0));
  for (const PackedHit& hit : hits) EXPECT_EQ(hit.triangle, -1);
}

// Both say the same of a mesh of many small triangles, but for what rounding may decide.
TEST(RayScene, HostAndKernelAgree) {
  const std::uint64_t seed = TestSeed(6);
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Geometry geometry = TriangleSoup(3000, seed);
  for (auto& vertex : geometry.vertices) vertex.position[1] *= 0.25f;
  const auto rays = Rays(20000, seed);
  const auto host = Trace(DeviceThatTraces(kHost), geometry, rays),
             kernel = Trace(DeviceThatTraces(kKernel), geometry, rays);
  int hidden = 0, unsure = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const bool same =
        host.hidden[i] == kernel.hidden[i] && host.hits[i].triangle == kernel.hits[i].triangle;
    hidden += host.hidden[i];
    if (same) continue;
    ++unsure;
    // Two triangles at about one distance, or a hit within rounding of an edge or an end.
    const bool tie = std::abs(host.hits[i].t - kernel.hits[i].t) < 1e-4f * (1 + host.hits[i].t);
    EXPECT_TRUE(tie || !BruteForce(geometry, rays[i], 1e-4).sure) << "ray " << i;
  }
  EXPECT_GT(hidden, 2000);
  EXPECT_LT(unsure, 200);
}

// Kernels that a driver compiles wrongly make such rays, and Embree may end the program at one.
TEST(HostRays, ThatAreNotFiniteAreAnErrorThatNamesTheDevice) {
  const Device device = DeviceThatTraces(kHost);
  const Geometry geometry = TriangleSoup(20, 7);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                  kInfinity = std::numeric_limits<float>::infinity();
  const auto expect_refused = [&](const PackedRay& wrong, const char* what) {
    // In a packet of its own and in the middle of one.
    for (const std::size_t count : {std::size_t{1}, std::size_t{37}}) {
      std::vector<PackedRay> rays(count, MakeRay({0, 0, 5}, {0, 0, -1}));
      rays[count / 2] = wrong;
      EXPECT_THAT([&] { Trace(device, geometry, rays); },
                  testing::ThrowsMessage<DeviceError>(testing::AllOf(
                      testing::StartsWith(device.info().name), testing::HasSubstr("--device"))))
          << what;
    }
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const float value : {kNan, kInfinity, -kInfinity, 1e19f, -1e19f}) {
      PackedRay wrong = MakeRay({0, 0, 5}, {0, 0, -1});
      wrong.origin[axis] = value;
      expect_refused(wrong, "origin");
      wrong = MakeRay({0, 0, 5}, {0, 0, -1});
      wrong.direction[axis] = value;
      expect_refused(wrong, "direction");
    }
  PackedRay wrong = MakeRay({0, 0, 5}, {0, 0, -1});
  wrong.t_min = kNan;
  expect_refused(wrong, "t_min");
  wrong = MakeRay({0, 0, 5}, {0, 0, -1}, kNan);
  expect_refused(wrong, "t_max");
}

// Rays without end, from far away, and of no length, which meet nothing wherever they are.
TEST(HostRays, MayBeLongAndEmpty) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                  kInfinity = std::numeric_limits<float>::infinity();
  Geometry geometry;
  scene::AppendQuad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0, geometry);
  const auto [hits, hidden] =
      Trace(DeviceThatTraces(kHost), geometry,
            {MakeRay({0, 0, 5}, {0, 0, -1}, kInfinity), MakeRay({0, 0, 1e18}, {0, 0, -1}, 2e18),
             MakeRay({kNan, kNan, kNan}, {kNan, kNan, kNan}, 0)});
  EXPECT_THAT(hidden, testing::ElementsAre(1, 1, 0));
  EXPECT_EQ(hits[0].t, 5);
  EXPECT_EQ(hits[1].t, 1e18f);
  EXPECT_EQ(hits[2].triangle, -1);
}

}  // namespace
}  // namespace luxfield::render
