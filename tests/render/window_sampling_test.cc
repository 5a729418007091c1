// The windowed sampler as the device runs it: chi-squared against the density, extremes of its
// random numbers.
#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/core/random.h"
#include "luxfield/preprocess/tables.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/lights/luminaire_params.h"
#include "tests/render/chi_squared.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

constexpr std::uint64_t kSeed = 20140303;

const char* const kKernel = R"(
#include "luxfield/render/kernels/luminaire/basis_sampling.clh"
#include "luxfield/render/kernels/luminaire/window_sampling.clh"
#include "luxfield/render/kernels/math/random.clh"

// Sample k of image (i, j) for a receiver at p; xi from `given`, or from Philox where it is null.
__kernel void Draw(__constant const LuminaireParams* luminaire, __global const ulong* sat, float4 p, int i, int j,
                   int count, uint seed, __global const float2* given, __global int2* texel, __global float2* y,
                   __global float* mass) {
  const int k = get_global_id(0);
  if (k >= count) return;
  const int columns = luminaire->axis[0].texels, rows = luminaire->axis[1].texels, cells = luminaire->basis.cells;
  const Axis x_axis = MakeAxis(&luminaire->axis[0], luminaire->delta, p.x, p.z);
  const Axis y_axis = MakeAxis(&luminaire->axis[1], luminaire->delta, p.y, p.z);
  const Span column_span = MakeSpan(&x_axis, i, cells, columns), row_span = MakeSpan(&y_axis, j, cells, rows);
  __global const ulong* image = sat + (size_t)(j * luminaire->axis[0].count + i) * (columns + 1) * (rows + 1);
  *mass = WindowMass(image, columns + 1, column_span, row_span);
  texel[k] = (int2)(-1, -1);
  if (!(*mass > 0.0f)) return;
  const uint4 bits = Philox((uint4)((uint)k, 0u, 0u, 0u), (uint2)(seed, 0u));
  const float2 xi = given ? given[k] : (float2)(UnitFloat(bits.x), UnitFloat(bits.y));
  const Marginal marginal = MakeMarginal(image, columns + 1, column_span, row_span);
  const WindowTable table = {image, columns + 1, &x_axis, &y_axis, column_span, row_span, (float)cells};
  WindowSample sample;
  SampleWindow(&table, &marginal, &xi, 1, &sample);
  texel[k] = (int2)(sample.column, sample.row);
  y[k] = sample.y;
}

// Places drawn uniformly from a window, as Draw.
__kernel void DrawUniform(__constant const LuminaireParams* luminaire, float4 p, int i, int j, uint seed,
                          __global int2* texel, __global float2* fraction) {
  const int k = get_global_id(0), cells = luminaire->basis.cells;
  const Axis x_axis = MakeAxis(&luminaire->axis[0], luminaire->delta, p.x, p.z);
  const Axis y_axis = MakeAxis(&luminaire->axis[1], luminaire->delta, p.y, p.z);
  const uint4 bits = Philox((uint4)((uint)k, 0u, 0u, 0u), (uint2)(seed, 0u));
  const Place column = UniformPlace(MakeSpan(&x_axis, i, cells, luminaire->axis[0].texels), UnitFloat(bits.x));
  const Place row = UniformPlace(MakeSpan(&y_axis, j, cells, luminaire->axis[1].texels), UnitFloat(bits.y));
  texel[k] = (int2)(column.texel, row.texel);
  fraction[k] = (float2)(column.fraction, row.fraction);
}

// y of the basis function for given xi; B(y), and the place of y on the image.
__kernel void DrawBasis(__constant const LuminaireParams* luminaire, __global const float* xi, __global float* y,
                        __global float* value) {
  const int k = get_global_id(0);
  y[k] = InvertBasis(&luminaire->basis, BasisArea(&luminaire->basis), xi[k]);
  value[k] = BasisValue(&luminaire->basis, y[k]);
}

__kernel void RandomWords(uint seed_lo, uint seed_hi, __global uint4* words, __global float2* points) {
  const uint k = get_global_id(0);
  words[k] = Philox((uint4)(k, 1u, 2u, 3u), (uint2)(seed_lo, seed_hi));
  uint2 point = (uint2)(0u, 0u);
  for (uint n = 0; n < k; ++n) point = NextPoint(point, n);
  points[k] = ShiftPoint(point, (uint2)(0x9ABCDEF0u, 0x12345678u));
}
)";

struct Draws {
  std::vector<cl_int2> texel;
  std::vector<cl_float2> y;
  double mass = 0;
};

Draws Draw(const Device& device, const Program& program, const lightfield::LightField& field,
           const preprocess::Tables& tables, lightfield::Vec3 p, int i, int j, int count,
           const std::vector<cl_float2>& given = {}) {
  const auto params = MakeLuminaireParams(field.geometry, field.geometry.lattice.width, {});
  const Buffer device_params = Buffer::From(device, std::span<const LuminaireParams>(&params, 1)),
               sat = Buffer::From(device, tables.sat),
               xi = given.empty() ? Buffer() : Buffer::From(device, given);
  Buffer texel(device, count * sizeof(cl_int2)), y(device, count * sizeof(cl_float2)),
      mass(device, sizeof(float));
  const cl_float4 at{
      {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0}};
  Kernel(program, "Draw")
      .Set(device_params, sat, at, cl_int{i}, cl_int{j}, cl_int{count}, static_cast<cl_uint>(kSeed),
           xi, texel, y, mass)
      .Enqueue({static_cast<std::size_t>(count)}, {64});
  return {texel.Download<cl_int2>(), y.Download<cl_float2>(), mass.Download<float>()[0] * 0x1p62};
}

// Overlap of [a, b] with the window [lo, hi], in texels.
double Overlap(double a, double b, double lo, double hi) {
  return std::max(0.0, std::min(b, hi) - std::max(a, lo));
}

struct Window {
  double c0, c1, r0, r1;  // texel coordinates
};

Window WindowOf(const lightfield::LuminaireGeometry& g, lightfield::Vec3 p, int i, int j) {
  const auto project = [&](double u, double p_axis) {
    return (u * (p.z - g.delta_m) + p_axis * g.delta_m) / p.z;
  };
  const double h = g.grid.spacing_m, u = g.grid.u0_m + i * h, v = g.grid.v0_m + j * h,
               n = g.grid.basis.cells * h;
  const double a = g.lattice.column_of_s(project(u, p.x)),
               b = g.lattice.column_of_s(project(u + n, p.x));
  const double c = g.lattice.row_of_t(project(v, p.y)), d = g.lattice.row_of_t(project(v + n, p.y));
  return {std::min(a, b), std::max(a, b), std::min(c, d), std::max(c, d)};
}

TEST(WindowSampling, ChiSquaredAgainstTheDensity) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const Program program = Program::BuildText(device, kKernel, "window_sampling_test.cl");
  constexpr int kCount = 200000;
  for (const char* kind : {"rings", "facets", "filament", "noise"})
    // Well inside, across a border of the image, between the planes, less than a texel wide.
    for (const lightfield::Vec3 p :
         {lightfield::Vec3{0.1, 0.05, 1.2}, lightfield::Vec3{0.55, 0.2, 1.2},
          lightfield::Vec3{0.02, 0.03, 0.22}, lightfield::Vec3{0.0113, 0.0113, 0.301}}) {
      LuminaireShape shape;
      shape.spacing_m = 0.02;
      const auto field = StructuredLuminaire(kind, shape, kSeed);
      const auto tables = preprocess::BuildTables(field, "test", std::string(64, '0'));
      const Draws draws = Draw(device, program, field, tables, p, 1, 1, kCount);
      const Window window = WindowOf(field.geometry, p, 1, 1);
      // Bins: halves of texels, so that the place inside a texel is judged too.
      const int columns = 2 * shape.width, rows = 2 * shape.height;
      std::vector<double> expected(columns * rows), observed(columns * rows);
      double total = 0;
      const int m = field.geometry.grid.index(1, 1);
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
          expected[r * columns + c] = field.image(m, 0)[r / 2 * shape.width + c / 2] *
                                      Overlap(0.5 * c, 0.5 * c + 0.5, window.c0, window.c1) *
                                      Overlap(0.5 * r, 0.5 * r + 0.5, window.r0, window.r1);
          total += expected[r * columns + c];
        }
      ASSERT_GT(total, 0);
      const double cells = field.geometry.grid.basis.cells;
      const bool reversed = p.z < field.geometry.delta_m;
      for (int k = 0; k < kCount; ++k) {
        const double yx = draws.y[k].s[0] / cells, yy = draws.y[k].s[1] / cells;
        ASSERT_GE(yx, 0);
        ASSERT_LE(yx, 1);
        // Rows run against v, and everything turns round between the planes.
        const double c = window.c0 + (reversed ? 1 - yx : yx) * (window.c1 - window.c0);
        const double r = window.r0 + (reversed ? yy : 1 - yy) * (window.r1 - window.r0);
        ASSERT_NEAR(c, draws.texel[k].s[0] + 0.5, 0.5 + 1e-4);
        ASSERT_NEAR(r, draws.texel[k].s[1] + 0.5, 0.5 + 1e-4);
        const int bin_c = 2 * draws.texel[k].s[0] + (c - draws.texel[k].s[0] >= 0.5);
        const int bin_r = 2 * draws.texel[k].s[1] + (r - draws.texel[k].s[1] >= 0.5);
        ++observed[bin_r * columns + bin_c];
      }
      for (std::size_t k = 0; k < expected.size(); ++k)
        if (expected[k] == 0) {
          EXPECT_EQ(observed[k], 0);
        }
      const std::string what = std::string(kind) + ", z = " + std::to_string(p.z) + " m";
      EXPECT_LT(ChiSquaredDeviations(expected, observed, what), 5);
      // The mass is the expectation's total, in units of texels seen per cell.
      const double per_cell = cells * cells / ((window.c1 - window.c0) * (window.r1 - window.r0));
      EXPECT_NEAR(std::ldexp(draws.mass, -tables.exponent[m]), total * per_cell,
                  1e-4 * total * per_cell);
    }
}

TEST(WindowSampling, EndsOfTheUnitIntervalStayOnLitTexels) {
  const Device device = Device::Open();
  const Program program = Program::BuildText(device, kKernel, "window_sampling_test.cl");
  core::Random random(kSeed, 0);
  const float last = 1 - 0x1p-24f;
  std::vector<cl_float2> given;
  for (const float a : {0.0f, 0x1p-149f, 0x1p-24f, 0.5f, last})
    for (const float b : {0.0f, 0x1p-149f, 0x1p-24f, 0.5f, last}) given.push_back({{a, b}});
  int lit = 0;
  for (int trial = 0; trial < 60; ++trial) {
    LuminaireShape shape;
    shape.width = 24;
    shape.height = 18;
    lightfield::LightField field = EmptyLuminaire(shape);
    // Few lit texels in a dark image, over many decades.
    for (int k = 0; k < (trial % 3 == 0 ? 1 : 60); ++k)
      field.data[static_cast<std::size_t>(random.Uniform() *
                                          static_cast<double>(field.data.size()))] =
          static_cast<float>(std::pow(10.0, -8 * random.Uniform()));
    const auto tables = preprocess::BuildTables(field, "test", std::string(64, '0'));
    const lightfield::Vec3 p{random.Uniform() - 0.5, random.Uniform() - 0.5,
                             0.05 + 1.5 * random.Uniform()};
    for (int m = 0; m < field.geometry.grid.count(); ++m) {
      const int i = m % shape.grid_width, j = m / shape.grid_width;
      const Draws draws =
          Draw(device, program, field, tables, p, i, j, static_cast<int>(given.size()), given);
      if (draws.mass == 0) continue;
      ++lit;
      for (std::size_t k = 0; k < given.size(); ++k) {
        const int c = draws.texel[k].s[0], r = draws.texel[k].s[1];
        ASSERT_TRUE(c >= 0 && c < shape.width && r >= 0 && r < shape.height);
        EXPECT_GT(field.image(m, 0)[r * shape.width + c], 0)
            << "trial " << trial << " image " << m << " xi " << k;
        EXPECT_GE(draws.y[k].s[0], 0);
        EXPECT_LE(draws.y[k].s[1], 3);
      }
    }
  }
  EXPECT_GT(lit, 20);
}

// Uniform places: every texel as often as it is seen, partly seen texels at the window's and the
// image's edges included.
TEST(WindowSampling, UniformPlacesFollowWhatIsSeen) {
  const Device device = Device::Open();
  const Program program = Program::BuildText(device, kKernel, "window_sampling_test.cl");
  constexpr int kCount = 200000;
  for (const lightfield::Vec3 p :
       {lightfield::Vec3{0.1, 0.05, 1.2}, lightfield::Vec3{0.55, 0.2, 1.2},
        lightfield::Vec3{0.02, 0.03, 0.22}, lightfield::Vec3{0.0113, 0.0113, 0.301}}) {
    const auto field = EmptyLuminaire({.spacing_m = 0.02});
    const auto& g = field.geometry;
    const auto params = MakeLuminaireParams(g, g.lattice.width, {});
    Buffer texel(device, kCount * sizeof(cl_int2)), fraction(device, kCount * sizeof(cl_float2));
    const cl_float4 at{
        {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0}};
    Kernel(program, "DrawUniform")
        .Set(Buffer::From(device, std::span<const LuminaireParams>(&params, 1)), at, cl_int{1},
             cl_int{1}, static_cast<cl_uint>(kSeed), texel, fraction)
        .Enqueue({kCount}, {64});
    const Window window = WindowOf(g, p, 1, 1);
    std::vector<double> expected(g.lattice.width * g.lattice.height), observed(expected.size());
    for (int r = 0; r < g.lattice.height; ++r)
      for (int c = 0; c < g.lattice.width; ++c)
        expected[r * g.lattice.width + c] =
            Overlap(c, c + 1, window.c0, window.c1) * Overlap(r, r + 1, window.r0, window.r1);
    for (const auto& t : texel.Download<cl_int2>()) ++observed[t.s[1] * g.lattice.width + t.s[0]];
    double mean = 0;
    for (const auto& f : fraction.Download<cl_float2>()) mean += (f.s[0] + f.s[1]) / 2 / kCount;
    // 1/2 in whole and partly seen texels alike: places lie in the seen part.
    EXPECT_NEAR(mean, 0.5, 5 * std::sqrt(1 / 12.0 / (2 * kCount)));
    for (std::size_t k = 0; k < expected.size(); ++k)
      if (expected[k] == 0) {
        EXPECT_EQ(observed[k], 0) << k;
      }
    const std::string what = "uniform, z = " + std::to_string(p.z) + " m";
    EXPECT_LT(ChiSquaredDeviations(expected, observed, what), 5);
  }
}

// Inversion of every basis against its integral in double: the share of the area below y is xi.
TEST(WindowSampling, BasisFunctionsAreInvertedExactly) {
  using lightfield::BasisKind;
  const Device device = Device::Open();
  const Program program = Program::BuildText(device, kKernel, "window_sampling_test.cl");
  core::Random random(kSeed, 1);
  std::vector<float> xi{0.0f, 0x1p-149f, 0x1p-24f, 1e-4f, 0.5f, 1 - 0x1p-12f, 1 - 0x1p-24f};
  while (xi.size() < 4096) xi.push_back(random.UniformFloat());
  for (const auto& basis :
       {lightfield::Basis::Make(BasisKind::kBox), lightfield::Basis::Make(BasisKind::kBilinear),
        lightfield::Basis::Make(BasisKind::kQuadratic),
        lightfield::Basis::Make(BasisKind::kQuadratic, -1),
        lightfield::Basis::Make(BasisKind::kQuadratic, 1),
        lightfield::Basis::Make(BasisKind::kBspline2)}) {
    const auto field = EmptyLuminaire({.basis = basis});
    const auto params = MakeLuminaireParams(field.geometry, field.geometry.lattice.width, {});
    Buffer y(device, xi.size() * sizeof(float)), value(device, xi.size() * sizeof(float));
    Kernel(program, "DrawBasis")
        .Set(Buffer::From(device, std::span<const LuminaireParams>(&params, 1)),
             Buffer::From(device, xi), y, value)
        .Enqueue({xi.size()}, {64});
    const auto at = y.Download<float>(), b = value.Download<float>();
    // Simpson is exact for quadratic pieces.
    const auto integral = [&](double end) {
      double sum = 0;
      for (int k = 0; k < basis.cells; ++k) {
        const double lo = k, hi = std::clamp(end, lo, k + 1.0);
        const auto f = [&](double u) {
          const double t = u - k;
          return basis.c[k][0] + t * (basis.c[k][1] + t * basis.c[k][2]);
        };
        sum += (hi - lo) / 6 * (f(lo) + 4 * f(0.5 * (lo + hi)) + f(hi));
      }
      return sum;
    };
    const double area = integral(basis.cells);
    for (std::size_t k = 0; k < xi.size(); ++k) {
      ASSERT_GE(at[k], 0);
      ASSERT_LE(at[k], basis.cells);
      // Rounding of the cell's area and of y, whose last place B turns into area.
      EXPECT_NEAR(integral(at[k]) / area, xi[k], 6e-7) << basis.name() << " " << xi[k];
      EXPECT_GE(b[k], -1e-6) << basis.name();
    }
  }
}

TEST(WindowSampling, RandomWordsAreCoresAndPointsAreStratified) {
  const Device device = Device::Open();
  const Program program = Program::BuildText(device, kKernel, "window_sampling_test.cl");
  constexpr int kCount = 256;
  Buffer words(device, kCount * sizeof(cl_uint4)), points(device, kCount * sizeof(cl_float2));
  Kernel(program, "RandomWords").Set(cl_uint{7}, cl_uint{9}, words, points).Enqueue({kCount}, {64});
  const auto word = words.Download<cl_uint4>();
  for (std::uint32_t k = 0; k < kCount; ++k) {
    const auto expected = core::Philox({k, 1, 2, 3}, {7, 9});
    for (int part = 0; part < 4; ++part) EXPECT_EQ(word[k].s[part], expected[part]);
  }
  // A (0, 8, 2)-net: one point in every elementary interval 2^-a x 2^-(8-a).
  const auto point = points.Download<cl_float2>();
  for (int a = 0; a <= 8; ++a) {
    std::vector<int> hits(kCount, 0);
    for (const auto& p : point)
      ++hits[static_cast<int>(std::ldexp(p.s[0], a)) * (1 << (8 - a)) +
             static_cast<int>(std::ldexp(p.s[1], 8 - a))];
    for (const int h : hits) EXPECT_EQ(h, 1) << a;
  }
}

}  // namespace
}  // namespace luxfield::render
