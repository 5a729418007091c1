// Densities of knot cells against quadrature of the flux, their support, the bound on E / Q.
#include "luxfield/preprocess/cell_tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "luxfield/core/error.h"
#include "tests/render/brute_force.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;
using render::EmptyLuminaire;
using render::LuminaireShape;
using render::StructuredLuminaire;

constexpr std::uint64_t kSeed = 20140404;

std::vector<Basis> AllBases() {
  std::vector<Basis> bases{Basis::Make(BasisKind::kBox), Basis::Make(BasisKind::kBilinear),
                           Basis::Make(BasisKind::kBspline2)};
  for (const double a : {-1.0, 0.5, 1.0}) bases.push_back(Basis::Make(BasisKind::kQuadratic, a));
  return bases;
}

double Luminance(const LightField& field, int m, std::size_t texel) {
  if (field.geometry.channels == 1) return field.image(m, 0)[texel];
  return 0.2126 * field.image(m, 0)[texel] + 0.7152 * field.image(m, 1)[texel] +
         0.0722 * field.image(m, 2)[texel];
}

// sum_m C_m Phi_m at the point (a + x, b + y) h of F, by the formulas of the bases; value(m) is
// C_m.
template <typename Value>
double FluxOf(const lightfield::BasisGrid& grid, double x, double y, const Value& value) {
  double sum = 0;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      sum += value(grid.index(i, j)) * render::BasisByFormula(grid.basis, x - i) *
             render::BasisByFormula(grid.basis, y - j);
  return sum;
}

// E = sum_m Y(C_m) Phi_m.
double Flux(const LightField& field, std::size_t texel, double x, double y) {
  return FluxOf(field.geometry.grid, x, y, [&](int m) { return Luminance(field, m, texel); });
}

std::uint64_t FixedPointSum(const CellTables& tables, int cell, int c, int r) {
  const std::uint64_t* s = tables.cell(cell) + static_cast<std::size_t>(r) * (tables.width + 1) + c;
  const std::uint64_t* below = s + tables.width + 1;
  return below[1] - below[0] - (s[1] - s[0]);
}

double Density(const CellTables& tables, int cell, int c, int r) {
  return std::ldexp(static_cast<double>(FixedPointSum(tables, cell, c, r)), -tables.exponent[cell]);
}

TEST(CellTables, DensityIsTheRootMeanSquareOfTheFlux) {
  // Three Gauss nodes are exact for the square of a quadratic.
  const double node = 0.5 * std::sqrt(0.6);
  const double x[3] = {0.5 - node, 0.5, 0.5 + node}, weight[3] = {5. / 18, 8. / 18, 5. / 18};
  for (const Basis& basis : AllBases())
    for (const int channels : {1, 3}) {
      LuminaireShape shape;
      shape.basis = basis;
      shape.width = 9;
      shape.height = 7;
      shape.channels = channels;
      const LightField field = StructuredLuminaire("noise", shape, kSeed);
      const CellTables tables = BuildCellTables(field, "test.lf.exr");
      ASSERT_EQ(tables.grid_width, shape.grid_width + basis.cells - 1);
      ASSERT_EQ(tables.grid_height, shape.grid_height + basis.cells - 1);
      for (int b = 0; b < tables.grid_height; ++b)
        for (int a = 0; a < tables.grid_width; ++a)
          for (int r = 0; r < shape.height; ++r)
            for (int c = 0; c < shape.width; ++c) {
              double square = 0;
              for (int k = 0; k < 3; ++k)
                for (int l = 0; l < 3; ++l)
                  square += weight[k] * weight[l] *
                            std::pow(Flux(field, r * shape.width + c, a + x[k], b + x[l]), 2);
              const double q = Density(tables, b * tables.grid_width + a, c, r);
              // Luminance is rounded to float32; the factor is good to 1e-14.
              ASSERT_NEAR(q, std::sqrt(square), 1.2e-7 * q)
                  << basis.name() << " cell " << a << " " << b << " texel " << c << " " << r;
            }
    }
}

// Of both signs; of colours, channel by channel.
TEST(CellTables, DensityOfNegativeCoefficients) {
  const double node = 0.5 * std::sqrt(0.6);
  const double x[3] = {0.5 - node, 0.5, 0.5 + node}, weight[3] = {5. / 18, 8. / 18, 5. / 18};
  const double of_channel[3] = {0.2126, 0.7152, 0.0722};
  for (const Basis& basis : AllBases())
    for (const int channels : {1, 3}) {
      LuminaireShape shape;
      shape.basis = basis;
      shape.width = 9;
      shape.height = 7;
      shape.channels = channels;
      const LightField field = render::WithSigns(StructuredLuminaire("grain", shape, kSeed));
      const CellTables tables = BuildCellTables(field, "test.lf.exr");
      for (int b = 0; b < tables.grid_height; ++b)
        for (int a = 0; a < tables.grid_width; ++a)
          for (int r = 0; r < shape.height; ++r)
            for (int c = 0; c < shape.width; ++c) {
              double square = 0;
              for (int channel = 0; channel < channels; ++channel)
                for (int k = 0; k < 3; ++k)
                  for (int l = 0; l < 3; ++l) {
                    const double flux = FluxOf(field.geometry.grid, a + x[k], b + x[l], [&](int m) {
                      return double{field.image(m, channel)[r * shape.width + c]};
                    });
                    square += (channels == 1 ? 1 : of_channel[channel]) * weight[k] * weight[l] *
                              flux * flux;
                  }
              const double q = Density(tables, b * tables.grid_width + a, c, r);
              ASSERT_NEAR(q, std::sqrt(square), 1e-10 * q + 1e-14)
                  << basis.name() << " cell " << a << " " << b << " texel " << c << " " << r;
            }
    }
}

TEST(CellTables, FluxIsBoundedByTheDensity) {
  core::Random random(kSeed, 1);
  for (const Basis& basis : AllBases()) {
    const double bound = basis.cells == 1 ? 1 : basis.kind == BasisKind::kBilinear ? 4 : 9;
    LuminaireShape shape;
    shape.basis = basis;
    shape.grid_width = shape.grid_height = 3;
    shape.width = shape.height = 8;
    LightField field = EmptyLuminaire(shape);
    for (float& c : field.data) {  // few images at a time: the worst cases; of both signs
      c = random.Uniform() < 0.2 ? static_cast<float>(std::pow(10, -3 * random.Uniform())) : 0.0f;
      if (random.Uniform() < 0.3) c = -c;
    }
    const CellTables tables = BuildCellTables(field, "test.lf.exr");
    double largest = 0;
    for (int cell = 0; cell < tables.count(); ++cell)
      for (std::size_t texel = 0; texel < 64; ++texel)
        for (const double x : {1e-9, 0.3, 0.5, 1 - 1e-9})
          for (const double y : {1e-9, 0.4, 1 - 1e-9}) {
            const double flux = std::abs(
                Flux(field, texel, cell % tables.grid_width + x, cell / tables.grid_width + y));
            const double q =
                Density(tables, cell, static_cast<int>(texel) % 8, static_cast<int>(texel) / 8);
            ASSERT_LE(flux, bound * q * (1 + 1e-6)) << basis.name();
            if (q > 0) largest = std::max(largest, flux / q);
          }
    std::printf("%s, a = %.1f: E / Q at most %.2f\n", basis.name().c_str(), basis.a, largest);
    EXPECT_GT(largest, 0.9);
  }
}

// A sampler of this density reaches all light, and nothing else.
TEST(CellTables, CoverEveryLitTexelAndNoOther) {
  LuminaireShape shape;
  shape.width = shape.height = 20;
  LightField field = EmptyLuminaire(shape);
  core::Random random(kSeed, 2);
  for (float& c : field.data)
    if (random.Uniform() < 0.3) c = static_cast<float>(std::pow(10, -37 * random.Uniform()));
  const CellTables tables = BuildCellTables(field, "test.lf.exr");
  int lit = 0, rounded_up = 0;
  for (int cell = 0; cell < tables.count(); ++cell) {
    EXPECT_LT(tables.cell(cell)[tables.sat_size() - 1], std::uint64_t{1} << 63);
    for (int r = 0; r < 20; ++r)
      for (int c = 0; c < 20; ++c) {
        const double flux =
            Flux(field, r * 20 + c, cell % tables.grid_width + 0.5, cell / tables.grid_width + 0.5);
        EXPECT_EQ(FixedPointSum(tables, cell, c, r) > 0, flux > 0);
        lit += flux > 0;
        rounded_up += flux > 0 && FixedPointSum(tables, cell, c, r) <= 2;
      }
  }
  EXPECT_GT(lit, 1000);
  EXPECT_GT(rounded_up, 50);
}

TEST(CellTables, DarknessIsLegalAndWhatCannotBeSampledIsRefused) {
  LuminaireShape shape;
  LightField field = EmptyLuminaire(shape);
  const CellTables dark = BuildCellTables(field, "test.lf.exr");
  for (const auto s : dark.sat) ASSERT_EQ(s, 0u);
  for (const int e : dark.exponent) EXPECT_EQ(e, 0);

  field.image(4, 0)[17] = -1e-6f;
  EXPECT_NO_THROW(BuildCellTables(field, "test.lf.exr"));
  field.image(4, 0)[17] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(BuildCellTables(field, "test.lf.exr"), InputError);
  // Every image is within float32, the cells that see several of them are not.
  for (float& c : field.data) c = 2.5e38f / 1200;
  field.image(4, 0)[17] = 0;
  EXPECT_NO_THROW(BuildCellTables(field, "test.lf.exr"));
  shape.basis = Basis::Make(BasisKind::kQuadratic, -1.0);
  LightField bright = EmptyLuminaire(shape);
  for (float& c : bright.data) c = 2.5e38f / 1200;
  EXPECT_THROW(BuildCellTables(bright, "test.lf.exr"), InputError);
}

}  // namespace
}  // namespace luxfield::preprocess
