// The sampler of cells as the device runs it: chi-squared against the density, which integrates to
// one.
#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/preprocess/cell_tables.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/lights/luminaire_params.h"
#include "tests/render/chi_squared.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

constexpr std::uint64_t kSeed = 20140505;

const char* const kKernel = R"(
#include "luxfield/render/kernels/luminaire/cells.clh"

// Sample k of cell (a, b) for a receiver at p, and Q where it fell.
__kernel void Draw(__constant const LuminaireParams* luminaire, __global const ulong* sat,
                   __global const float* scale, float4 p, int a, int b, int count, uint seed,
                   __global int2* texel, __global float2* y, __global float* density,
                   __global float* mass) {
  const int k = get_global_id(0);
  if (k >= count) return;
  const CellTables tables = MakeCellTables(luminaire, sat, scale);
  const int cell = b * tables.cells.x + a, width = tables.sat_width;
  const Axis x_axis = MakeAxis(&luminaire->axis[0], luminaire->delta, p.x, p.z);
  const Axis y_axis = MakeAxis(&luminaire->axis[1], luminaire->delta, p.y, p.z);
  const Span columns = MakeSpan(&x_axis, a, 1, luminaire->axis[0].texels);
  const Span rows = MakeSpan(&y_axis, b, 1, luminaire->axis[1].texels);
  *mass = scale[cell] * WindowMass(CellSat(&tables, cell), width, columns, rows);
  texel[k] = (int2)(-1, -1);
  if (!(*mass > 0.0f)) return;
  const uint4 bits = Philox((uint4)((uint)k, 0u, 0u, 0u), (uint2)(seed, 0u));
  const Marginal marginal = MakeMarginal(CellSat(&tables, cell), width, columns, rows);
  const WindowTable table = {CellSat(&tables, cell), width, &x_axis, &y_axis, columns, rows, 1.0f};
  const float2 xi = (float2)(UnitFloat(bits.x), UnitFloat(bits.y));
  WindowSample sample;
  SampleWindow(&table, &marginal, &xi, 1, &sample);
  texel[k] = (int2)(sample.column, sample.row);
  y[k] = sample.y;
  density[k] = CellDensity(&tables, cell, sample.column, sample.row);
}
)";

struct Draws {
  std::vector<cl_int2> texel;
  std::vector<cl_float2> y;
  std::vector<float> density;
  double mass = 0;
};

Draws Draw(const Device& device, const lightfield::LightField& field,
           const preprocess::CellTables& tables, lightfield::Vec3 p, int a, int b, int count) {
  const LuminaireOnDevice luminaire(device, field, {.cells = &tables});
  const auto params = MakeLuminaireParams(field.geometry, luminaire.row_stride(), {});
  const Buffer device_params = Buffer::From(device, std::span<const LuminaireParams>(&params, 1));
  const cl_float4 at{
      {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0}};
  Buffer texel(device, count * sizeof(cl_int2)), y(device, count * sizeof(cl_float2)),
      density(device, count * sizeof(float)), mass(device, sizeof(float));
  const Program program =
      Program::BuildText(device, kKernel, "cell_sampling_test.cl", "-D GLOSSY=0");
  Kernel(program, "Draw")
      .Set(device_params, luminaire.cell_sat(), luminaire.cell_scale(), at, cl_int{a}, cl_int{b},
           cl_int{count}, static_cast<cl_uint>(kSeed), texel, y, density, mass)
      .Enqueue({static_cast<std::size_t>(count)}, {64});
  return {texel.Download<cl_int2>(), y.Download<cl_float2>(), density.Download<float>(),
          mass.Download<float>()[0]};
}

// One axis of a cell's window: texels per unit of y, and which part of [0, 1] a texel edge is at.
struct WindowAxis {
  double first, step;  // texel coordinate at y = 0, texels over the cell
};

std::array<WindowAxis, 2> WindowOf(const lightfield::LuminaireGeometry& g, lightfield::Vec3 p,
                                   int a, int b) {
  const auto project = [&](double u, double p_axis) {
    return (u * (p.z - g.delta_m) + p_axis * g.delta_m) / p.z;
  };
  const double h = g.grid.spacing_m, u = g.grid.u0_m + a * h, v = g.grid.v0_m + b * h;
  const double c = g.lattice.column_of_s(project(u, p.x)), r = g.lattice.row_of_t(project(v, p.y));
  return {WindowAxis{c, g.lattice.column_of_s(project(u + h, p.x)) - c},
          WindowAxis{r, g.lattice.row_of_t(project(v + h, p.y)) - r}};
}

TEST(CellSampling, ChiSquaredAgainstTheDensity) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  constexpr int kCount = 100000, kBins = 24;
  for (const auto kind : {lightfield::BasisKind::kBox, lightfield::BasisKind::kBilinear,
                          lightfield::BasisKind::kQuadratic, lightfield::BasisKind::kBspline2})
    // In front, across a border of the image, between the planes, within a texel, on I.
    for (const lightfield::Vec3 p :
         {lightfield::Vec3{0.1, 0.05, 1.2}, lightfield::Vec3{0.555, 0.2, 1.2},
          lightfield::Vec3{0.02, 0.03, 0.12}, lightfield::Vec3{0.0113, 0.0113, 0.301},
          lightfield::Vec3{0.0113, 0.0113, 0.3}}) {
      LuminaireShape shape;
      shape.basis = lightfield::Basis::Make(kind);
      shape.spacing_m = 0.04;
      const auto field = StructuredLuminaire("facets", shape, kSeed);
      const auto tables = preprocess::BuildCellTables(field, "test");
      const int a = 1, b = 1, cell = b * tables.grid_width + a;
      const Draws draws = Draw(device, field, tables, p, a, b, kCount);
      const auto window = WindowOf(field.geometry, p, a, b);
      const auto density = [&](int c, int r) {
        const std::uint64_t* s = tables.cell(cell) + r * (tables.width + 1) + c;
        const std::uint64_t* below = s + tables.width + 1;
        return std::ldexp(static_cast<double>(below[1] - below[0] - (s[1] - s[0])),
                          -tables.exponent[cell]);
      };
      // Bins of the unit square; the expected mass of each by its cuts with texels.
      const auto cuts = [](const WindowAxis& axis, int bin, int texels) {
        struct Piece {
          int texel;
          double width;
        };
        std::vector<Piece> pieces;
        const double y0 = double{1.0 * bin} / kBins, y1 = (bin + 1.0) / kBins;
        const double t0 = axis.first + y0 * axis.step, t1 = axis.first + y1 * axis.step;
        const double low = std::min(t0, t1), high = std::max(t0, t1);
        if (high == low) {
          const int texel = static_cast<int>(std::floor(low));
          if (texel >= 0 && texel < texels) pieces.push_back({texel, y1 - y0});
          return pieces;
        }
        for (int e = std::max(0, static_cast<int>(std::floor(low)));
             e < std::min<double>(texels, std::ceil(high)); ++e)
          pieces.push_back({e, (std::min(high, e + 1.0) - std::max(low, double{1.0 * e})) /
                                   std::abs(axis.step)});
        return pieces;
      };
      std::vector<double> expected(kBins * kBins), observed(kBins * kBins);
      double total = 0;
      for (int r = 0; r < kBins; ++r)
        for (int c = 0; c < kBins; ++c) {
          for (const auto& row : cuts(window[1], r, shape.height))
            for (const auto& column : cuts(window[0], c, shape.width))
              expected[r * kBins + c] +=
                  density(column.texel, row.texel) * column.width * row.width;
          total += expected[r * kBins + c];
        }
      ASSERT_GT(total, 0);
      // Q / M integrates to one.
      EXPECT_NEAR(draws.mass, total, 2e-5 * total);
      for (int k = 0; k < kCount; ++k) {
        const double x = draws.y[k].s[0], y = draws.y[k].s[1];
        ASSERT_TRUE(x >= 0 && x <= 1 && y >= 0 && y <= 1);
        ++observed[std::min(static_cast<int>(y * kBins), kBins - 1) * kBins +
                   std::min(static_cast<int>(x * kBins), kBins - 1)];
        const int c = draws.texel[k].s[0], r = draws.texel[k].s[1];
        ASSERT_NEAR(window[0].first + x * window[0].step, c + 0.5, 0.5 + 1e-4);
        ASSERT_NEAR(window[1].first + y * window[1].step, r + 0.5, 0.5 + 1e-4);
        ASSERT_NEAR(draws.density[k], density(c, r), 1e-6 * density(c, r));
        ASSERT_GT(draws.density[k], 0);
      }
      const std::string what = shape.basis.name() + ", z = " + std::to_string(p.z) + " m";
      EXPECT_LT(ChiSquaredDeviations(expected, observed, what), 5);
    }
}

}  // namespace
}  // namespace luxfield::render
