// Sampling tables of environment maps as the device makes and reads them.
#include "luxfield/render/lights/environment_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/environment/environment_map.h"
#include "tests/render/chi_squared.h"
#include "tests/render/environment_fixture.h"
#include "tests/test_data.h"

namespace luxfield::render {
namespace {

using environment::CubeMap;
using lightfield::Vec3;

constexpr cl_uint kSeed = 20140505;

const char* const kKernel = R"(
#include "luxfield/render/kernels/environment/environment_sampling.clh"

__kernel void Evaluate(ENVIRONMENT_ARGUMENTS, __global const float4* directions, int count,
                       __global float4* radiance, __global int* tile) {
  const int k = get_global_id(0);
  if (k >= count) return;
  const Environment environment = ENVIRONMENT;
  const IncidentLight light = EnvironmentAt(&environment, directions[k].xyz);
  radiance[k] = (float4)(light.radiance, light.weight);
  tile[k] = light.tile;
}

// `xi` from Philox, or where `given` is not null from there.
__kernel void Draw(ENVIRONMENT_ARGUMENTS, int first_row, int end_row, uint seed, int count,
                   __global const uint2* given, __global float4* directions,
                   __global float4* radiance) {
  const int k = get_global_id(0);
  if (k >= count) return;
  const Environment environment = ENVIRONMENT;
  const uint2 xi = given ? given[k] : Philox((uint4)((uint)k, 0u, 0u, 0u), (uint2)(seed, 0u)).xy;
  const EnvironmentSample sample = DrawEnvironment(&environment, first_row, end_row, xi);
  directions[k] = (float4)(sample.direction, 0.0f);
  radiance[k] = (float4)(sample.radiance, sample.weight);
}

__kernel void Points(__global uint2* at, __global uint2* sorted) {
  const uint k = get_global_id(0);
  at[k] = PointAt(k);
  uint2 point = (uint2)(0u, 0u);
  for (uint n = 0; n < k; ++n) point = NextPoint(point, n);
  sorted[k] = point;
}
)";

struct Bench {
  Device device = Device::Open();
  Program program = Program::BuildText(device, kKernel, "environment_light_test.cl");

  struct Values {
    std::vector<cl_float4> radiance;  // w: weight
    std::vector<cl_int> tile;
  };
  Values Evaluate(const EnvironmentLight& light, const std::vector<Vec3>& directions) const {
    std::vector<cl_float4> packed;
    for (const Vec3& w : directions)
      packed.push_back(
          {{static_cast<float>(w.x), static_cast<float>(w.y), static_cast<float>(w.z), 0}});
    const Buffer from = Buffer::From(device, packed);
    Buffer radiance(device, packed.size() * sizeof(cl_float4)),
        tile(device, packed.size() * sizeof(cl_int));
    Kernel(program, "Evaluate")
        .Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
             light.energies(), light.corners(), from, static_cast<cl_int>(packed.size()), radiance,
             tile)
        .Enqueue(packed.size());
    return {radiance.Download<cl_float4>(), tile.Download<cl_int>()};
  }

  struct Draws {
    std::vector<cl_float4> direction, radiance;
  };
  Draws Draw(const EnvironmentLight& light, int first_row, int end_row, int count,
             const std::vector<cl_uint2>& given = {}) const {
    const Buffer xi = given.empty() ? Buffer() : Buffer::From(device, given);
    Buffer direction(device, count * sizeof(cl_float4)),
        radiance(device, count * sizeof(cl_float4));
    Kernel(program, "Draw")
        .Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
             light.energies(), light.corners(), cl_int{first_row}, cl_int{end_row}, kSeed,
             cl_int{count}, xi, direction, radiance)
        .Enqueue(static_cast<std::size_t>(count));
    return {direction.Download<cl_float4>(), radiance.Download<cl_float4>()};
  }
};

Vec3 ToVec3(const cl_float4& v) { return {v.s[0], v.s[1], v.s[2]}; }

int TileOf(int face_size, int side, int face, int row, int column) {
  const int n = face_size / side;
  return (face * side + row / n) * side + column / n;
}

// The texels' luminous energy Y dw by tile, in double.
std::vector<double> TileEnergies(const CubeMap& map, int side, double compensation) {
  const auto angles = environment::TexelSolidAngles(map.face_size);
  const core::Rgb mean_radiance = MeanRadiance(map);
  const double taken = compensation * core::Luminance(mean_radiance);
  std::vector<double> energies(6 * side * side, 0.0);
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < map.face_size; ++row)
      for (int column = 0; column < map.face_size; ++column) {
        const double y =
            core::Luminance({map.at(face, row, column, 0), map.at(face, row, column, 1),
                             map.at(face, row, column, 2)});
        energies[TileOf(map.face_size, side, face, row, column)] +=
            std::max(0.0, y - taken) * angles[row * map.face_size + column];
      }
  return energies;
}

// Radiance, tile and density of every texel's centre as kernels find them; the density integrates
// to 1 over every tile. Within a texel weight(w) dw = weight(x, y) dx dy is constant, so that one
// point of each and its area 4 / N^2 are the whole integral.
void ExpectTables(const Bench& bench, const CubeMap& map, int side, float compensation,
                  const std::string& name) {
  SCOPED_TRACE(name);
  EnvironmentLight light(bench.device, map.face_size, {side, compensation});
  light.Show(map);
  const int size = map.face_size;
  std::vector<Vec3> directions;
  std::vector<double> per_area;
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < size; ++row)
      for (int column = 0; column < size; ++column) {
        directions.push_back(TexelCentre(size, face, row, column));
        per_area.push_back(environment::CubeSolidAnglePerArea(-1 + (2.0 * column + 1) / size,
                                                              1 - (2.0 * row + 1) / size));
      }
  const auto found = bench.Evaluate(light, directions);
  const auto energies = light.energies().Download<float>();
  std::vector<double> integral(light.tile_count(), 0.0);
  std::size_t wrong = 0;
  for (std::size_t t = 0; t < directions.size(); ++t) {
    const int face = static_cast<int>(t) / (size * size), row = static_cast<int>(t) / size % size,
              column = static_cast<int>(t) % size;
    const int tile = TileOf(size, side, face, row, column);
    wrong += found.tile[t] != tile;
    for (int channel = 0; channel < 3; ++channel)
      wrong += found.radiance[t].s[channel] != map.data[3 * t + channel];
    integral[tile] += found.radiance[t].s[3] * per_area[t] * 4 / (double(size) * size);
  }
  EXPECT_EQ(wrong, 0u);
  const auto expected = TileEnergies(map, side, compensation);
  double total = 0, expected_total = 0, worst = 0;
  for (int tile = 0; tile < light.tile_count(); ++tile) {
    total += energies[tile];
    expected_total += expected[tile];
    if (energies[tile] > 0) worst = std::max(worst, std::abs(integral[tile] / energies[tile] - 1));
  }
  ASSERT_GT(total, 0);
  std::printf("%s, %d tiles: integral of pdf - 1: %.1e at most\n", name.c_str(), light.tile_count(),
              worst);
  EXPECT_LT(worst, 1e-5);
  for (int tile = 0; tile < light.tile_count(); ++tile)
    EXPECT_NEAR(energies[tile] / total, expected[tile] / expected_total, 3e-6) << tile;
  EXPECT_GT(total, compensation > 0 ? 0 : 0.499);
  EXPECT_LT(total, 1);
}

TEST(EnvironmentLight, DensitiesIntegrateToOne) {
  const Bench bench;
  ExpectTables(bench, SunAndSky(64), 1, 0, "sun and sky");
  ExpectTables(bench, SunAndSky(64, 1e5), 4, 0, "bright sun");
  ExpectTables(bench, NoiseMap(48), 3, 0, "noise");
  ExpectTables(bench, NoiseMap(100), 1, 0, "noise, a face no multiple of a group");
  ExpectTables(bench, NoiseMap(48), 2, 0.5f, "noise, half of the mean left out");
  ExpectTables(bench, SunAndSky(64), 1, 1, "sun and sky, the mean left out");
  ExpectTables(bench, NoiseMap(1), 1, 0, "one texel a face");
}

// The other maps are tried by `luxfield bench environment`: resampling them takes seconds.
TEST(EnvironmentLight, DensitiesOfRealMaps) {
  LUXFIELD_NEEDS_DATA(testdata::Folder() / "env");
  const Bench bench;
  for (const std::string name : {"openexr__OrientationCube.exr", "openexr__KernerEnvCube.exr"}) {
    const auto path = testdata::Folder() / "env" / name;
    ExpectTables(bench, MakeCubeMap(environment::ReadEnvironmentPicture(path), 64), 1, 0, name);
  }
}

// Sums rise from texel to texel and row to row, and every quantum of a row is in it.
TEST(EnvironmentLight, SumsAreExact) {
  const Bench bench;
  EnvironmentLight light(bench.device, 40, {2, 0});
  light.Show(SunAndSky(40, 1e5));
  const auto rows = light.row_starts().Download<cl_ulong>();
  const auto columns = light.column_starts().Download<cl_ulong>();
  const auto texels = light.texels().Download<cl_float4>();
  const int n = 20;
  ASSERT_EQ(rows.size(), 6u * 4 * n + 1);
  EXPECT_EQ(rows[0], 0u);
  EXPECT_LT(rows.back(), 1ull << 62);
  EXPECT_GE(rows.back(), (1ull << 61) / 1.01);
  for (std::size_t row = 0; row + 1 < rows.size(); ++row) {
    ASSERT_LE(rows[row], rows[row + 1]);
    EXPECT_EQ(columns[row * n], 0u);
    for (int column = 0; column < n; ++column) {
      const std::size_t t = row * n + column;
      const cl_ulong end = column + 1 < n ? columns[t + 1] : rows[row + 1] - rows[row];
      ASSERT_LE(columns[t], end);
      // The stored density is that of the units.
      ASSERT_FLOAT_EQ(texels[t].s[3], static_cast<float>(end - columns[t]) * 0x1p-62f * 400.0f);
    }
  }
}

// Draws over texels, and over the parts of a texel, against their energies; radiance and weight are
// those of the direction.
TEST(EnvironmentLight, ChiSquaredOfDraws) {
  std::printf("seed %u\n", kSeed);
  const Bench bench;
  constexpr int kSize = 16, kSide = 2, kCount = 300000;
  const CubeMap map = NoiseMap(kSize);
  const auto angles = environment::TexelSolidAngles(kSize);
  EnvironmentLight light(bench.device, kSize, {kSide, 0});
  light.Show(map);
  const int n = kSize / kSide;
  for (const int tile : {-1, 0, 7, 13, 23}) {  // -1: all
    const int first = tile < 0 ? 0 : tile * n, end = tile < 0 ? light.row_count() : first + n;
    const auto draws = bench.Draw(light, first, end, kCount);
    std::vector<double> expected(map.texel_count(), 0.0), observed(map.texel_count(), 0.0);
    std::vector<double> parts(16, 0.0);
    std::vector<Vec3> directions;
    for (std::size_t t = 0; t < expected.size(); ++t) {
      const int face = static_cast<int>(t) / (kSize * kSize),
                row = static_cast<int>(t) / kSize % kSize, column = static_cast<int>(t) % kSize;
      if (tile < 0 || TileOf(kSize, kSide, face, row, column) == tile)
        expected[t] = core::Luminance({map.data[3 * t], map.data[3 * t + 1], map.data[3 * t + 2]}) *
                      angles[t % angles.size()];
    }
    for (const auto& direction : draws.direction) {
      const Vec3 w = ToVec3(direction);
      ASSERT_NEAR(Length(w), 1, 1e-6);
      directions.push_back(w);
      ++observed[map.texel_of(w)];
      const auto point = environment::CubePointFromDirection(w);
      const double column = 2 * kSize * (1 + point.x), row = 2 * kSize * (1 - point.y);
      ++parts[4 * (static_cast<int>(row) % 4) + static_cast<int>(column) % 4];
    }
    const std::string name = tile < 0 ? "all tiles" : "tile " + std::to_string(tile);
    EXPECT_LT(ChiSquaredDeviations(expected, observed, name), 4);
    EXPECT_LT(ChiSquaredDeviations(std::vector<double>(16, 1.0), parts, name + ", within texels"),
              4);
    // A direction on a texel's border may be found on its other side.
    const auto found = bench.Evaluate(light, directions);
    int different = 0;
    for (int k = 0; k < kCount; ++k)
      if (found.radiance[k].s[0] != draws.radiance[k].s[0])
        ++different;
      else
        ASSERT_NEAR(found.radiance[k].s[3], draws.radiance[k].s[3], 2e-6 * draws.radiance[k].s[3]);
    EXPECT_LE(different, 20);
  }
}

TEST(EnvironmentLight, ExtremesHaveTheirAnswers) {
  const Bench bench;
  const std::vector<cl_uint2> ends{
      {{0, 0}}, {{0xFFFFFFFFu, 0xFFFFFFFFu}}, {{0, 0xFFFFFFFFu}}, {{0xFFFFFFFFu, 0}}};

  // A black map has no energy and no density.
  EnvironmentLight black(bench.device, 4);
  for (const float energy : black.energies().Download<float>()) EXPECT_EQ(energy, 0);
  for (const auto& value : bench.Evaluate(black, Orientations(20)).radiance)
    for (const float v : value.s) EXPECT_EQ(v, 0);

  // One texel of all is lit: every draw is in it, whatever the random numbers.
  CubeMap lone(32);
  lone.at(3, 31, 0, 1) = 1e-20f;
  EnvironmentLight one(bench.device, 32, {4, 0});
  one.Show(lone);
  const auto from_lone = bench.Draw(one, 0, one.row_count(), 4, ends);
  const Vec3 centre = TexelCentre(32, 3, 31, 0);
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(from_lone.radiance[k].s[1], 1e-20f);
    // Half of the diagonal of a texel of 2 / 32, 1.69 from the middle of the cube.
    EXPECT_LT(Length(Cross(ToVec3(from_lone.direction[k]), centre)), 1.42 / 32 / 1.69);
  }

  // A sun of one texel and 1e5 times the sky: its share of the draws is its share of the energy.
  CubeMap sun = MakeMap(16, [](Vec3) -> core::Rgb { return {1, 1, 1}; });
  for (int channel = 0; channel < 3; ++channel) sun.at(4, 7, 9, channel) = 1e5f;
  EnvironmentLight sunny(bench.device, 16);
  sunny.Show(sun);
  constexpr int kCount = 200000;
  const auto draws = bench.Draw(sunny, 0, sunny.row_count(), kCount);
  const auto angles = environment::TexelSolidAngles(16);
  const double in_sun = 1e5 * angles[7 * 16 + 9],
               share = in_sun / (in_sun + 4 * std::numbers::pi - angles[7 * 16 + 9]);
  double hits = 0;
  for (const auto& direction : draws.direction)
    hits += sun.texel_of(ToVec3(direction)) == sun.texel(4, 7, 9);
  EXPECT_NEAR(hits, kCount * share, 5 * std::sqrt(kCount * share * (1 - share)));

  // Radiance near the largest, and so small that its energy is denormal.
  for (const float level : {1e30f, 1e-36f}) {
    CubeMap even = MakeMap(8, [&](Vec3) -> core::Rgb { return {level, level, level}; });
    EnvironmentLight light(bench.device, 8);
    light.Show(even);
    for (const float energy : light.energies().Download<float>())
      EXPECT_NEAR(energy, light.energies().Download<float>()[0], 1e-3f * energy) << level;
  }

  // A constant map whose mean is left out has nothing worth sampling but rounding.
  EnvironmentLight compensated(bench.device, 16, {1, 1});
  compensated.Show(MakeMap(16, [](Vec3) -> core::Rgb { return {2, 2, 2}; }));
  for (const float energy : compensated.energies().Download<float>()) EXPECT_LT(energy, 1e-6);
}

TEST(EnvironmentLight, WrongInputIsNamed) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  const Device device = Device::Open();
  EXPECT_THAT([&] { EnvironmentLight(device, 0); },
              ThrowsMessage<InputError>(HasSubstr("0 texels")));
  EXPECT_THAT(
      [&] {
        EnvironmentLight(device, 16, {3, 0});
      },
      ThrowsMessage<InputError>(HasSubstr("3 tiles")));
  EXPECT_THAT(
      [&] {
        EnvironmentLight(device, 16, {1, 1.5f});
      },
      ThrowsMessage<InputError>(HasSubstr("1.5")));
  EnvironmentLight light(device, 4);
  EXPECT_THAT([&] { light.Show(CubeMap(5)); }, ThrowsMessage<InputError>(HasSubstr("5 texels")));
  for (const float value : {-1.0f, NAN, INFINITY}) {
    CubeMap map(4);
    map.data[7] = value;
    EXPECT_THAT([&] { light.Show(map); }, ThrowsMessage<InputError>(HasSubstr("radiance")));
  }
}

// The sequence in its own order: the same points as in Gray-code order, run by run.
TEST(EnvironmentLight, PointsByNumber) {
  const Bench bench;
  constexpr int kCount = 256;
  Buffer at(bench.device, kCount * sizeof(cl_uint2)),
      sorted(bench.device, kCount * sizeof(cl_uint2));
  Kernel(bench.program, "Points").Set(at, sorted).Enqueue({kCount}, {64});
  const auto key = [](const cl_uint2& p) { return std::pair(p.s[0], p.s[1]); };
  auto a = at.Download<cl_uint2>(), b = sorted.Download<cl_uint2>();
  for (int run = 1; run <= kCount; run *= 2) {
    const auto less = [&](const cl_uint2& p, const cl_uint2& q) { return key(p) < key(q); };
    std::vector<cl_uint2> x(a.begin(), a.begin() + run), y(b.begin(), b.begin() + run);
    std::sort(x.begin(), x.end(), less);
    std::sort(y.begin(), y.end(), less);
    for (int k = 0; k < run; ++k) EXPECT_EQ(key(x[k]), key(y[k])) << run;
  }
}

}  // namespace
}  // namespace luxfield::render
