// The fit of a cell as the device draws from it: chi-squared against the polynomial over what is
// seen of the cell, its density against quadrature.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "luxfield/preprocess/cell_tables.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/lights/luminaire_params.h"
#include "tests/render/chi_squared.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

constexpr std::uint64_t kSeed = 20141111;

const char* const kKernel = R"(
#include "luxfield/render/kernels/luminaire/cell_fit.clh"

// Sample k of the fit of cell (a, b) for a receiver at p and its density; the seen rectangle.
__kernel void Draw(__constant const LuminaireParams* luminaire, __global const float* images,
                   float4 p, int a, int b, int count, uint seed, __global float2* y,
                   __global float* density, __global float4* seen) {
  const int k = get_global_id(0);
  if (k >= count) return;
  Surface surface;
  surface.x = MakeAxis(&luminaire->axis[0], luminaire->delta, p.x, p.z);
  surface.y = MakeAxis(&luminaire->axis[1], luminaire->delta, p.y, p.z);
  Window window;
  window.i = a;
  window.j = b;
  window.columns = MakeSpan(&surface.x, a, 1, luminaire->axis[0].texels);
  window.rows = MakeSpan(&surface.y, b, 1, luminaire->axis[1].texels);
  const CellFit fit = MakeCellFit(luminaire, images, &surface, &window);
  *seen = (float4)(fit.low, fit.width);
  const uint4 bits = Philox((uint4)((uint)k, 0u, 0u, 0u), (uint2)(seed, 0u));
  y[k] = DrawFit(&fit, (float2)(UnitFloat(bits.x), UnitFloat(bits.y)));
  density[k] = FitDensity(&fit, y[k]);
}
)";

struct Case {
  const char* what;
  lightfield::Vec3 p;
  bool over_the_border = false;  // p.x is moved to where the image ends in the middle of the cell
};

const Case kCases[] = {{"in front", {0.1, 0.05, 1.2}},
                       {"over the border", {0, 0.05, 1.2}, true},
                       {"over the border between the planes", {0, 0.03, 0.12}, true},
                       {"between the planes", {0.02, 0.03, 0.12}},
                       {"within a texel", {0.0113, 0.0113, 0.301}},
                       {"on I", {0.0113, 0.0113, 0.3}}};

// The part of [0, 1] from which the ray through p meets the image, along one axis.
std::array<double, 2> SeenPart(double knot, double h, double p, const auto& texel_of, int texels,
                               double delta, double z) {
  const auto at = [&](double u) { return texel_of((u * (z - delta) + p * delta) / z); };
  const double first = at(knot), last = at(knot + h);
  if (first == last) return {0, 1};
  const double t0 = (0 - first) / (last - first), t1 = (texels - first) / (last - first);
  return {std::clamp(std::min(t0, t1), 0.0, 1.0), std::clamp(std::max(t0, t1), 0.0, 1.0)};
}

TEST(CellFit, ChiSquaredAgainstThePolynomial) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  constexpr int kCount = 100000, kBins = 20;
  const Program program = Program::BuildText(device, kKernel, "cell_fit_test.cl", "-D GLOSSY=0");
  struct Signs {
    lightfield::BasisKind kind;
    float image_4;  // C of one image of the cell; 0: left as it is
  };
  using lightfield::BasisKind;
  for (const Signs signs : {Signs{BasisKind::kBox, 0}, Signs{BasisKind::kBilinear, 0},
                            Signs{BasisKind::kQuadratic, 0}, Signs{BasisKind::kBspline2, 0},
                            Signs{BasisKind::kBox, -2}, Signs{BasisKind::kQuadratic, -9},
                            // The other images outshine it everywhere, or not.
                            Signs{BasisKind::kBspline2, -0.1f}, Signs{BasisKind::kBspline2, -90}})
    for (auto [what, p, over_the_border] : kCases) {
      LuminaireShape shape;
      shape.basis = lightfield::Basis::Make(signs.kind);
      shape.spacing_m = 0.04;
      // Images of constant values of their own: the fit is then the light, in any window.
      auto field = EmptyLuminaire(shape);
      const auto& g = field.geometry;
      for (int m = 0; m < g.grid.count(); ++m)
        std::ranges::fill(field.image(m, 0), static_cast<float>((7 * m + 3) % 11));
      if (signs.image_4 < 0) std::ranges::fill(field.image(4, 0), signs.image_4);
      const int a = 1, b = 1;
      if (over_the_border)
        p.x = (g.lattice.s_of_column(g.lattice.width) * p.z -
               (g.grid.u0_m + (a + 0.5) * g.grid.spacing_m) * (p.z - g.delta_m)) /
              g.delta_m;
      const LuminaireOnDevice luminaire(device, field);
      const auto params = MakeLuminaireParams(g, luminaire.row_stride(), {});
      const Buffer device_params =
          Buffer::From(device, std::span<const LuminaireParams>(&params, 1));
      const cl_float4 at{
          {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0}};
      Buffer y(device, kCount * sizeof(cl_float2)), density(device, kCount * sizeof(float)),
          seen(device, sizeof(cl_float4));
      Kernel(program, "Draw")
          .Set(device_params, luminaire.images(), at, cl_int{a}, cl_int{b}, cl_int{kCount},
               static_cast<cl_uint>(kSeed), y, density, seen)
          .Enqueue({kCount}, {64});

      const auto rectangle = seen.Download<cl_float4>()[0];
      const auto x_part = SeenPart(
          g.grid.u0_m + a * g.grid.spacing_m, g.grid.spacing_m, p.x,
          [&](double s) { return g.lattice.column_of_s(s); }, g.lattice.width, g.delta_m, p.z);
      const auto y_part = SeenPart(
          g.grid.v0_m + b * g.grid.spacing_m, g.grid.spacing_m, p.y,
          [&](double t) { return g.lattice.row_of_t(t); }, g.lattice.height, g.delta_m, p.z);
      EXPECT_NEAR(rectangle.s[0], x_part[0], 1e-5) << what;
      EXPECT_NEAR(rectangle.s[1], y_part[0], 1e-5) << what;
      EXPECT_NEAR(rectangle.s[2], x_part[1] - x_part[0], 1e-5) << what;
      EXPECT_NEAR(rectangle.s[3], y_part[1] - y_part[0], 1e-5) << what;

      const auto signed_light = [&](double fx, double fy) {
        double sum = 0;
        for (int l = 0; l < g.grid.basis.cells; ++l)
          for (int k = 0; k < g.grid.basis.cells; ++k) {
            const int i = a - k, j = b - l;
            if (i < 0 || j < 0 || i >= g.grid.width || j >= g.grid.height) continue;
            sum += field.image(g.grid.index(i, j), 0)[0] * g.grid.basis.CellValue(k, fx) *
                   g.grid.basis.CellValue(l, fy);
          }
        return sum;
      };
      // Magnitudes of the Bernstein coefficients over what is seen: those of a quadratic are f(0),
      // 2 f(1/2) - (f(0) + f(1)) / 2 and f(1).
      const double to_bernstein[3][3] = {{1, 0, 0}, {-0.5, 2, -0.5}, {0, 0, 1}};
      double bernstein[3][3] = {};
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
          for (int l = 0; l < 3; ++l)
            for (int k = 0; k < 3; ++k)
              bernstein[j][i] += to_bernstein[j][l] * to_bernstein[i][k] *
                                 signed_light(x_part[0] + 0.5 * k * (x_part[1] - x_part[0]),
                                              y_part[0] + 0.5 * l * (y_part[1] - y_part[0]));
          bernstein[j][i] = std::abs(bernstein[j][i]);
        }
      const auto light = [&](double fx, double fy) {
        const double tx = (fx - x_part[0]) / (x_part[1] - x_part[0]),
                     ty = (fy - y_part[0]) / (y_part[1] - y_part[0]);
        const double bx[] = {(1 - tx) * (1 - tx), 2 * tx * (1 - tx), tx * tx},
                     by[] = {(1 - ty) * (1 - ty), 2 * ty * (1 - ty), ty * ty};
        double sum = 0;
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i) sum += bernstein[j][i] * bx[i] * by[j];
        return sum;
      };
      // Gauss-Legendre of three points is exact for the polynomial.
      constexpr double kNode = 0.7745966692414834;
      const double nodes[] = {-kNode, 0, kNode}, weights[] = {5 / 18., 8 / 18., 5 / 18.};
      std::vector<double> expected(kBins * kBins), observed(kBins * kBins);
      const double wide = (x_part[1] - x_part[0]) / kBins, high = (y_part[1] - y_part[0]) / kBins;
      double total = 0;
      for (int r = 0; r < kBins; ++r)
        for (int c = 0; c < kBins; ++c) {
          double& bin = expected[r * kBins + c];
          for (int s = 0; s < 3; ++s)
            for (int t = 0; t < 3; ++t)
              bin += weights[s] * weights[t] *
                     light(x_part[0] + (c + 0.5 + 0.5 * nodes[s]) * wide,
                           y_part[0] + (r + 0.5 + 0.5 * nodes[t]) * high);
          bin *= wide * high;
          total += bin;
        }
      ASSERT_GT(total, 0) << what;
      const auto drawn = y.Download<cl_float2>();
      const auto densities = density.Download<float>();
      for (int k = 0; k < kCount; ++k) {
        const double fx = drawn[k].s[0], fy = drawn[k].s[1];
        const int c = static_cast<int>((fx - x_part[0]) / wide),
                  r = static_cast<int>((fy - y_part[0]) / high);
        observed[std::clamp(r, 0, kBins - 1) * kBins + std::clamp(c, 0, kBins - 1)] += 1;
        ASSERT_NEAR(densities[k], light(fx, fy) / total, 1e-4 * densities[k] + 1e-5) << what;
      }
      const std::string name = g.grid.basis.name() + (signs.image_4 < 0 ? ", signed, " : ", ");
      EXPECT_LT(ChiSquaredDeviations(expected, observed, name + what), 5);
    }
}

}  // namespace
}  // namespace luxfield::render
