// The tree over lights: every light in one leaf, spheres and profiles that hold what is in them, and
// points that draw every light in the stated proportion.
#include "luxfield/render/lights/light_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include "luxfield/core/random.h"
#include "luxfield/render/kernels/sample/sampling_types.clh"
#include "tests/render/renderer_fixture.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

constexpr double kPi = std::numbers::pi;

Vec3 AnyDirection(core::Random& random) {
  const double z = 2 * random.Uniform() - 1, angle = 2 * kPi * random.Uniform();
  return {std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z};
}

Vec3 AnyPoint(core::Random& random, double size) {
  return {size * (random.Uniform() - 0.5), size * (random.Uniform() - 0.5),
          size * (random.Uniform() - 0.5)};
}

// Lamps, rectangles and spheres anywhere in a cube of 4 m; every second lamp looks the same way.
std::vector<BoundedLight> AnyLights(int count, const BoundedTable& table, core::Random& random) {
  const auto lamp = Lamp(1).geometry;
  const Vec3 one_way = AnyDirection(random), one_up = AnyDirection(random);
  std::vector<BoundedLight> lights;
  for (int k = 0; k < count; ++k) {
    const Vec3 position = AnyPoint(random, 4), way = AnyDirection(random),
               up = AnyDirection(random);
    const scene::Pose pose = k % 6 == 0 ? scene::LookAt(position, position + one_way, one_up)
                                        : scene::LookAt(position, position + way, up);
    scene::AreaLight light;
    light.kind = k % 3 == 1 ? scene::AreaLightKind::kRectangle : scene::AreaLightKind::kSphere;
    light.radiance = {1 + random.Uniform(), 1, 1};
    light.world_from_light = pose;
    light.width_m = light.radius_m = 0.2 * random.Uniform() + 0.01;
    light.height_m = 0.1;
    lights.push_back(k % 3 == 0 ? BoundLuminaire(lamp, table, pose, 1 + random.Uniform())
                                : BoundAreaLight(MakeAreaLight(light)));
  }
  return lights;
}

Vec3 CentreOf(const LightNode& node) { return {node.centre[0], node.centre[1], node.centre[2]}; }
Vec3 PositionOf(const BoundedLight& light) {
  return {light.light.position[0], light.light.position[1], light.light.position[2]};
}

int ProfileBinOf(double angle) {
  return std::min(static_cast<int>(int{kProfileBins} * std::sqrt(angle / kPi)), kProfileBins - 1);
}

class LightTreeTest : public testing::Test {
 protected:
  preprocess::IntensityTable intensity_ = preprocess::BuildIntensityTable(Lamp(1), "lamp");
  BoundedTable table_{intensity_, 0};
};

TEST_F(LightTreeTest, NodesHoldTheirLights) {
  core::Random random(TestSeed(20260702), 0);
  for (const int count : {1, 2, 3, 50, 700}) {
    auto lights = AnyLights(count, table_, random);
    if (count == 700)
      for (int k = 0; k < 300; ++k) lights[k].light = lights[0].light;  // all in one place
    const auto nodes = BuildLightTree(lights);
    ASSERT_EQ(nodes.size(), 2 * lights.size() - 1);
    std::vector<int> seen(lights.size(), 0);
    // Lights below each node, and its depth.
    std::vector<std::vector<int>> below(nodes.size());
    std::vector<int> depth(nodes.size(), 0);
    for (int k = static_cast<int>(nodes.size()) - 1; k >= 0; --k) {
      if (nodes[k].light >= 0) {
        below[k] = {nodes[k].light};
        ++seen[nodes[k].light];
        continue;
      }
      for (const int child : {k + 1, nodes[k].right}) {
        below[k].insert(below[k].end(), below[child].begin(), below[child].end());
        depth[k] = std::max(depth[k], depth[child] + 1);
      }
    }
    EXPECT_LT(depth[0], kMostDepth);
    for (const int times : seen) EXPECT_EQ(times, 1);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      double power = 0;
      for (const int l : below[k]) {
        power += lights[l].power;
        EXPECT_LE(Length(PositionOf(lights[l]) - CentreOf(nodes[k])) + lights[l].reach_m,
                  nodes[k].radius * (1 + 1e-6));
      }
      EXPECT_NEAR(nodes[k].power, power, 1e-5 * power);
    }
    // In any direction the profile is at least the sum of the lights' own.
    for (int trial = 0; trial < 2000; ++trial) {
      const auto k = static_cast<std::size_t>(random.Uniform() * static_cast<double>(nodes.size()));
      const Vec3 direction = AnyDirection(random);
      double sum = 0;
      for (const int l : below[k])
        sum += lights[l].profile[ProfileBinOf(
            std::acos(std::clamp(Dot(lights[l].axis, direction), -1.0, 1.0)))];
      const auto& axis = nodes[k].axis;
      const double angle =
          std::acos(std::clamp(Dot({axis[0], axis[1], axis[2]}, direction), -1.0, 1.0));
      EXPECT_GE(nodes[k].profile[ProfileBinOf(angle)] * (1 + 1e-5), sum) << count << " " << k;
    }
  }
}

// Lamps of two directions, some of them beside lamps of all directions.
TEST_F(LightTreeTest, BoxesHoldLuminairesThatAreAlike) {
  core::Random random(TestSeed(20260706), 0);
  const auto geometry = Lamp(1).geometry;
  std::vector<BoundedLight> lights;
  for (int k = 0; k < 100; ++k) {
    const Vec3 position = AnyPoint(random, 4), any = AnyDirection(random);
    const Vec3 way = k % 5 == 0 ? any : k % 2 == 0 ? Vec3{0, 0.6, -0.8} : Vec3{1, 0, 0};
    lights.push_back(BoundLuminaire(geometry, table_,
                                    scene::LookAt(position, position + way, {0.1, 0.9, 0.3}),
                                    0.5 + random.Uniform()));
  }
  const auto nodes = BuildLightTree(lights);
  std::vector<std::vector<int>> below(nodes.size());
  std::size_t largest = 0;
  for (int k = static_cast<int>(nodes.size()) - 1; k >= 0; --k) {
    const LightNode& node = nodes[k];
    if (node.light >= 0) {
      below[k] = {node.light};
      ASSERT_EQ(node.alike, node.light);
    } else {
      for (const int child : {k + 1, node.right})
        below[k].insert(below[k].end(), below[child].begin(), below[child].end());
    }
    if (node.alike < 0) continue;
    largest = std::max(largest, below[k].size());
    const float* rotation = lights[node.alike].light.rotation;
    double scale = 0;
    for (const int l : below[k]) {
      const TreeLight& light = lights[l].light;
      scale += light.scale;
      const Vec3 d = PositionOf(lights[l]) - Vec3{node.middle[0], node.middle[1], node.middle[2]};
      const double extent[] = {light.extent[0], light.extent[1], 0};
      for (int row = 0; row < 3; ++row) {
        const float* axis = rotation + 3 * row;
        EXPECT_LE(std::abs(Dot({axis[0], axis[1], axis[2]}, d)) + extent[row],
                  node.half_box[row] + 1e-7);
        for (int column = 0; column < 3; ++column)
          EXPECT_NEAR(light.rotation[3 * row + column], axis[column], 1e-5);
      }
    }
    EXPECT_NEAR(node.scale, scale, 1e-5 * scale);
  }
  EXPECT_EQ(largest, 40u);  // each direction has a node of its own
}

TEST_F(LightTreeTest, OneLightIsOneLeafAndNoneIsNone) { EXPECT_TRUE(BuildLightTree({}).empty()); }

// What points draw: lights by weight and number of samples.
struct Selection {
  std::vector<cl_int> counts;
  std::vector<SelectedLight> selected;
  int capacity = 0;
};

Selection Select(const Device& device, const LightTree& tree, std::size_t lights,
                 const GBuffer& gbuffer, int samples, std::uint32_t seed) {
  SamplingParams sampling{};
  sampling.samples = samples;
  sampling.seed_lo = seed;
  sampling.end = static_cast<int>(gbuffer.pixel_count());
  Selection selection;
  selection.capacity = static_cast<int>(std::min<std::size_t>(samples, lights));
  const std::size_t points = gbuffer.pixel_count();
  const Buffer params = Buffer::From(device, std::span<const SamplingParams>(&sampling, 1)),
               counts(device, points * sizeof(cl_int)),
               selected(device, points * selection.capacity * sizeof(SelectedLight));
  Kernel(Program::Build(device, "kernels/lights/select_lights.cl"), "SelectLights")
      .Set(tree.nodes, tree.lights, tree.tables, params, gbuffer.position, gbuffer.normal,
           cl_int{selection.capacity}, counts, selected)
      .Enqueue(points);
  selection.counts = counts.Download<cl_int>();
  selection.selected = selected.Download<SelectedLight>();
  return selection;
}

// One receiver, many times: the mean of what a light counts is 1, whatever its share.
TEST_F(LightTreeTest, DrawsAreUnbiased) {
  constexpr int kPoints = 1 << 12, kLights = 150;
  const std::uint64_t seed = TestSeed(20260703);
  core::Random random(seed, 0);
  const Device device = Device::Open();
  const auto lights = AnyLights(kLights, table_, random);
  const LightTree tree = UploadLightTree(device, lights, std::span(&table_, 1));
  double largest = 0, chi = 0;
  int tested = 0;
  for (const int samples : {1, 5, 16, 400, 1, 5, 16, 400, 16, 16}) {
    const Vec3 p = AnyPoint(random, 6), n = AnyDirection(random);
    GBuffer gbuffer(device, kPoints, 1);
    gbuffer.position.Upload(std::span<const cl_float4>(std::vector<cl_float4>(
        kPoints,
        {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 1}})));
    gbuffer.normal.Upload(std::span<const cl_float4>(std::vector<cl_float4>(
        kPoints,
        {{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z), 0}})));
    const Selection drawn =
        Select(device, tree, lights.size(), gbuffer, samples, static_cast<std::uint32_t>(seed));
    struct Sums {
      double weights = 0, weight = 0;
      int times = 0;
    };
    std::map<int, Sums> sums;
    for (int k = 0; k < kPoints; ++k) {
      int taken = 0;
      for (int i = 0; i < drawn.counts[k]; ++i) {
        const SelectedLight& one = drawn.selected[static_cast<std::size_t>(k) * drawn.capacity + i];
        ASSERT_GE(one.samples, 1);
        ASSERT_GE(one.weight, 1);
        ASSERT_TRUE(one.weight == 1 || one.samples == 1);
        taken += one.samples;
        Sums& sum = sums[one.light];
        sum.weights += one.weight;
        sum.weight = one.weight;
        ++sum.times;
      }
      ASSERT_LE(taken, samples);
    }
    for (const auto& [light, sum] : sums) {
      // Drawn with probability 1 / weight.
      const double deviation = std::sqrt(kPoints * (sum.weight - 1));
      if (sum.weight == 1) {
        EXPECT_EQ(sum.times, kPoints);
      } else if (kPoints / sum.weight > 25) {  // nearly normal
        const double z = (sum.weights - kPoints) / deviation;
        largest = std::max(largest, std::abs(z));
        chi += z * z;
        ++tested;
      }
    }
  }
  std::printf("%d shares, largest z %.2f, mean square %.2f\n", tested, largest, chi / tested);
  EXPECT_GT(tested, 50);
  EXPECT_LT(largest, 5);
}

// 3 x 2 images of a beam some 30 degrees wide.
LightField BeamLamp() {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.05;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 3, 2, 0.02);
  geometry.lattice = {40, 40, -0.08, 0.08, 0.004, 0.004};
  geometry.channels = 1;
  LightField field(geometry);
  for (int m = 0; m < geometry.grid.count(); ++m)
    for (int row = 0; row < 40; ++row)
      for (int column = 0; column < 40; ++column) {
        const auto s = geometry.lattice.centre(row, column);
        field.image(m, 0)[row * 40 + column] = static_cast<float>(
            1e6 * (1 + m) * std::exp(-(s.x * s.x + 2 * s.y * s.y) / (2 * 0.02 * 0.02)));
      }
  return field;
}

// Of lamps in rows the samples of a point go to each in proportion to the light that it brings: with
// one sample a lamp's weight times its irradiance is the same for all that are drawn, but for what is
// drawn evenly and the table's means.
TEST_F(LightTreeTest, SharesFollowTheLightOfLuminairesThatAreAlike) {
  constexpr int kPoints = 1 << 12, kSide = 12;
  const std::uint64_t seed = TestSeed(20260707);
  core::Random random(seed, 0);
  const Device device = Device::Open();
  const LightField field = BeamLamp();
  const auto intensity = preprocess::BuildIntensityTable(field, "beam");
  const BoundedTable table(intensity, 0);
  std::vector<BoundedLight> lights;
  std::vector<scene::Pose> poses;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec3 position{0.5 * (k % kSide), 0.5 * std::floor(k / kSide), 3};
    poses.push_back(scene::LookAt(position, position + Vec3{0, 0, -1}, {0, 1, 0}));
    lights.push_back(BoundLuminaire(field.geometry, table, poses.back(), 1));
  }
  const LightTree tree = UploadLightTree(device, lights, std::span(&table, 1));
  for (int trial = 0; trial < 6; ++trial) {
    const Vec3 p{6 * random.Uniform(), 6 * random.Uniform(), 0}, n{0, 0, 1};
    GBuffer gbuffer(device, kPoints, 1);
    gbuffer.position.Upload(std::span<const cl_float4>(std::vector<cl_float4>(
        kPoints, {{static_cast<float>(p.x), static_cast<float>(p.y), 0, 1}})));
    gbuffer.normal.Upload(
        std::span<const cl_float4>(std::vector<cl_float4>(kPoints, {{0, 0, 1, 0}})));
    const Selection drawn =
        Select(device, tree, lights.size(), gbuffer, 1, static_cast<std::uint32_t>(seed));
    double sum = 0, squares = 0;
    int count = 0;
    for (int k = 0; k < kPoints; ++k) {
      if (drawn.counts[k] == 0) continue;
      const SelectedLight& one = drawn.selected[static_cast<std::size_t>(k) * drawn.capacity];
      const auto local = poses[one.light].Inverse();
      const double value = one.weight * ExactIrradiance(field, local.Point(p), local.Vector(n))[1];
      sum += value;
      squares += value * value;
      ++count;
    }
    const double mean = sum / count, spread = std::sqrt(squares / count - mean * mean) / mean;
    std::printf("%d drawn, relative spread of a sample %.3f\n", count, spread);
    EXPECT_LT(spread, 0.12);
  }
}

// Of two small area lights as well: one overhead, the other one low over the floor, in which its cosine
// at the receiver is all the difference.
TEST_F(LightTreeTest, SharesFollowTheLightOfAreaLights) {
  constexpr int kPoints = 1 << 12;
  const Device device = Device::Open();
  scene::AreaLight panel;
  panel.kind = scene::AreaLightKind::kRectangle;
  panel.radiance = {1, 1, 1};
  panel.width_m = panel.height_m = 0.02;
  scene::AreaLight ball = panel;
  ball.kind = scene::AreaLightKind::kSphere;
  ball.radius_m = 0.01;
  const double low = 0.1;  // cosine at the receiver
  const auto lit_by = [](scene::AreaLight light, double cosine) {
    const Vec3 at{2 * std::sqrt(1 - cosine * cosine), 0, 2 * cosine};
    light.world_from_light = scene::LookAt(at, {0, 0, 0}, {0, 1, 0});
    const double area = light.kind == scene::AreaLightKind::kSphere
                            ? kPi * light.radius_m * light.radius_m
                            : light.width_m * light.height_m;
    return std::pair(BoundAreaLight(MakeAreaLight(light)), area * cosine / 4);
  };
  GBuffer gbuffer(device, kPoints, 1);
  gbuffer.position.Upload(
      std::span<const cl_float4>(std::vector<cl_float4>(kPoints, {{0, 0, 0, 1}})));
  gbuffer.normal.Upload(
      std::span<const cl_float4>(std::vector<cl_float4>(kPoints, {{0, 0, 1, 0}})));
  for (const auto& [first, second] : {std::pair{panel, panel}, {panel, ball}, {ball, ball}}) {
    const auto [one, light_of_one] = lit_by(first, 1);
    const auto [other, light_of_other] = lit_by(second, low);
    const double share = light_of_other / (light_of_one + light_of_other);
    const std::vector<BoundedLight> lights{one, other};
    const Selection drawn = Select(device, UploadLightTree(device, lights, std::span(&table_, 1)),
                                   lights.size(), gbuffer, 1, 1);
    for (int k = 0; k < kPoints; ++k) {
      ASSERT_EQ(drawn.counts[k], 1);
      // A twentieth is drawn evenly.
      const double lit = drawn.selected[k].light == 1 ? share : 1 - share;
      ASSERT_NEAR(1 / drawn.selected[k].weight, 0.95 * lit + 0.05 / 2, 0.002);
    }
  }
}

// A light whose importance at a point is above 0 is drawn there with some probability: with many
// samples all of them are, and nothing else.
TEST_F(LightTreeTest, NoLightThatShinesIsLeftOut) {
  constexpr int kPoints = 256, kLights = 60, kSamples = 1 << 16;
  const std::uint64_t seed = TestSeed(20260704);
  core::Random random(seed, 0);
  const Device device = Device::Open();
  const LightField field = Lamp(1);
  const auto lights = AnyLights(kLights, table_, random);
  std::vector<cl_float4> positions, normals;
  for (int k = 0; k < kPoints; ++k) {
    // Half of them near a light, on all sides.
    const Vec3 p = k % 2 ? PositionOf(lights[k % kLights]) + AnyPoint(random, 0.3)
                         : AnyPoint(random, 6),
               n = AnyDirection(random);
    positions.push_back(
        {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 1}});
    normals.push_back(
        {{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z), 0}});
  }
  GBuffer gbuffer(device, kPoints, 1);
  gbuffer.position.Upload(std::span<const cl_float4>(positions));
  gbuffer.normal.Upload(std::span<const cl_float4>(normals));
  const Selection drawn =
      Select(device, UploadLightTree(device, lights, std::span(&table_, 1)), lights.size(), gbuffer,
             kSamples, static_cast<std::uint32_t>(seed));
  int shining = 0;
  for (int k = 0; k < kPoints; ++k) {
    std::vector<bool> is_drawn(kLights, false);
    for (int i = 0; i < drawn.counts[k]; ++i)
      is_drawn[drawn.selected[static_cast<std::size_t>(k) * drawn.capacity + i].light] = true;
    for (int l = 0; l < kLights; l += 3) {  // luminaires
      scene::Pose light_from_world;
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          light_from_world.linear[row][column] = lights[l].light.rotation[3 * row + column];
      const Vec3 p{positions[k].s[0], positions[k].s[1], positions[k].s[2]},
          n{normals[k].s[0], normals[k].s[1], normals[k].s[2]};
      // The lamp is centred on its supports' middle.
      const auto& grid = field.geometry.grid;
      const double half_x = (grid.width + grid.basis.cells - 1) * grid.spacing_m / 2,
                   half_y = (grid.height + grid.basis.cells - 1) * grid.spacing_m / 2;
      const Vec3 local = light_from_world.Vector(p - PositionOf(lights[l])) +
                         Vec3{grid.u0_m + half_x, grid.v0_m + half_y, 0};
      const auto e = ExactIrradiance(field, local, light_from_world.Vector(n));
      if (!(e[1] > 0)) continue;
      ++shining;
      EXPECT_TRUE(is_drawn[l]) << "point " << k << ", light " << l << ": " << e[1];
    }
  }
  EXPECT_GT(shining, 200);
}

const char* const kBoundKernel = R"(
#include "luxfield/render/kernels/lights/significant_lights.cl"

// Bounds of node `get_global_id(1)` at point `get_global_id(0)`; of a leaf that of its luminaire.
__kernel void Bounds(__global const LightNode* nodes, __global const TreeLight* lights,
                     __global const float* tables, int points, __global const float4* positions,
                     __global const float4* normals, int count, __global float* bounds) {
  const int k = get_global_id(0), node = get_global_id(1);
  if (k >= points || node >= count) return;
  const int light = nodes[node].light;
  const float of_node = NodeBound(nodes + node, positions[k].xyz, normals[k].xyz);
  bounds[node * points + k] =
      light < 0 ? of_node
                : fmin(of_node, LuminaireBound(lights + light, tables, positions[k].xyz,
                                               normals[k].xyz));
}
)";

// No receiver gets more from the lamps of a node than its bound; far away that is not much more.
TEST_F(LightTreeTest, BoundsHold) {
  constexpr int kPoints = 512, kLights = 30;
  core::Random random(TestSeed(20260705), 0);
  const Device device = Device::Open();
  const LightField field = Lamp(1);
  std::vector<BoundedLight> lights;
  std::vector<scene::Pose> poses;
  for (int k = 0; k < kLights; ++k) {
    const Vec3 position = AnyPoint(random, 2);
    poses.push_back(scene::LookAt(position, position + AnyDirection(random), AnyDirection(random)));
    lights.push_back(BoundLuminaire(field.geometry, table_, poses.back(), 1 + random.Uniform()));
  }
  const auto nodes = BuildLightTree(lights);
  const LightTree tree = UploadLightTree(device, lights, std::span(&table_, 1));
  std::vector<cl_float4> positions, normals;
  for (int k = 0; k < kPoints; ++k) {
    const double far = k % 4 == 0 ? 100 : k % 4 == 1 ? 10 : 0.5;
    const Vec3 p = (k % 2 ? PositionOf(lights[k % kLights]) : Vec3{}) + AnyPoint(random, far),
               n = AnyDirection(random);
    positions.push_back(
        {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 1}});
    normals.push_back(
        {{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z), 0}});
  }
  Buffer bounds(device, nodes.size() * kPoints * sizeof(float));
  Kernel(Program::BuildText(device, kBoundKernel, "light_tree_test.cl"), "Bounds")
      .Set(tree.nodes, tree.lights, tree.tables, cl_int{kPoints}, Buffer::From(device, positions),
           Buffer::From(device, normals), static_cast<cl_int>(nodes.size()), bounds)
      .Enqueue({kPoints, nodes.size()}, {1});
  const auto bound = bounds.Download<float>();
  int known = 0, lit = 0;
  std::vector<double> slack;
  for (int k = 0; k < kPoints; ++k) {
    const Vec3 p{positions[k].s[0], positions[k].s[1], positions[k].s[2]},
        n{normals[k].s[0], normals[k].s[1], normals[k].s[2]};
    // What each node brings, children before parents.
    std::vector<double> e(nodes.size(), 0.0);
    for (int node = static_cast<int>(nodes.size()) - 1; node >= 0; --node) {
      if (const int l = nodes[node].light; l >= 0) {
        const scene::Pose lamp_from_world = poses[l].Inverse();
        e[node] = lights[l].light.scale *
                  ExactIrradiance(field, lamp_from_world.Point(p), lamp_from_world.Vector(n))[1];
      } else {
        e[node] = e[node + 1] + e[nodes[node].right];
      }
      const double most = bound[static_cast<std::size_t>(node) * kPoints + k];
      // 1e-4 for what positions in float32 move.
      ASSERT_LE(e[node], most * (1 + 1e-4) + 1e-12) << "point " << k << ", node " << node;
      known += std::isfinite(most);
      lit += e[node] > 0;
      if (nodes[node].light >= 0 && e[node] > 0) slack.push_back(most / e[node]);
    }
  }
  std::nth_element(slack.begin(), slack.begin() + slack.size() / 2, slack.end());
  std::printf("%d bounds known of %zu, %d lit; median of bound over light %.2f\n", known,
              bound.size(), lit, slack[slack.size() / 2]);
  EXPECT_GT(lit, 1000);
  EXPECT_LT(slack[slack.size() / 2], 20);
}

}  // namespace
}  // namespace luxfield::render
