#include "luxfield/hal/sim/tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/hal/sim/bowl.h"
#include "luxfield/hal/sim/filament.h"
#include "luxfield/hal/sim/headlight.h"
#include "luxfield/hal/sim/lamp_time.h"
#include "luxfield/hal/sim/print.h"
#include "tests/hal/test_lab.h"

namespace luxfield::hal::sim {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;

// Composite Simpson: an independent rule, 1-D at a time.
template <typename F>
double Simpson(double from, double to, int pieces, F&& f) {
  const double h = (to - from) / (2 * pieces);
  double sum = f(from) + f(to);
  for (int k = 1; k < 2 * pieces; ++k) sum += (k % 2 ? 4 : 2) * f(from + k * h);
  return sum * h / 3;
}

TraceOptions Options(int u_samples) {
  TraceOptions o;
  o.delta_m = 0.25;
  o.cell_m = 0.02;
  o.cell_origin = {-0.03, -0.03};
  o.u_samples_per_cell = u_samples;
  return o;
}

rig::FilterSheet Sheet(const Basis& basis, double spacing_m, double scale, bool dual) {
  using lightfield::FilterKind;
  return rig::FilterSheet::Make(dual ? FilterKind::kDual : FilterKind::kBasis, basis, spacing_m,
                                scale);
}

TransmittanceFunction IdealPrint(double h) {
  const FilterPrint print(Sheet(Basis::Make(BasisKind::kBspline2), h, 1, false), {}, 0);
  return [print](Vec2 offset, int index) { return print.Transmittance(offset, index); };
}

// A square in the plane F itself: L is 1 inside, the integrand smooth on every cell of knots.
TEST(Tracer, SquareLampAgreesWithQuadrature) {
  const auto lamp = MakeSquare({0.06, 0, 1000, {1, 1, 1}});
  const lightfield::Lattice lattice{5, 3, -0.2, 0.15, 0.08, 0.1};
  const auto image = TraceIrradiance(*lamp, IdealPrint(0.02), 0.03, {{{0.02, 0}, 0}}, lattice,
                                     {{0, 0, 5, 3}}, Options(6))[0];
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 5; ++column) {
      const Vec2 s = lattice.centre(row, column);
      double expected = 0;
      for (int cell_y = 0; cell_y < 3;
           ++cell_y)  // the filter at 0.02 covers [-0.01, 0.05]; the square ends at 0.03
        for (int cell_x = 0; cell_x < 2; ++cell_x)
          expected += Simpson(-0.03 + cell_y * 0.02, -0.01 + cell_y * 0.02, 24, [&](double v) {
            return Simpson(-0.01 + cell_x * 0.02, 0.01 + cell_x * 0.02, 24, [&](double u) {
              const double d2 = 0.25 * 0.25 + (u - s.x) * (u - s.x) + (v - s.y) * (v - s.y);
              return 1000 * 0.25 * 0.25 / (d2 * d2) * basis.Value((u + 0.01) / 0.02) *
                     basis.Value((v + 0.03) / 0.02);
            });
          });
      EXPECT_NEAR(image[row * 5 + column], expected, 1e-6 * expected);  // float32 images
    }
}

// In the span of the basis three nodes per cell are exact, whatever the images: docs/theory.md 3
// with the model of docs/theory.md 2 inserted.
TEST(Tracer, LampInTheSpanIsExactWithThreeNodes) {
  const auto field = StructuredField(3, 2, 4, 0.05, 0.02, 11);
  const auto& grid = field.geometry.grid;
  const auto lamp = MakeLightFieldLamp(field);
  auto options = Options(3);
  options.cell_origin = {grid.u0_m, grid.v0_m};
  const auto& lattice = field.geometry.lattice;
  const auto image = TraceIrradiance(*lamp, IdealPrint(0.02), 0.03, {{grid.centre(1, 0), 0}},
                                     lattice, {{0, 0, 4, 4}}, options)[0];
  const auto inner = [&](int a, int b) {  // h times the integral of B(x - a) B(x - b)
    double sum = 0;
    for (int cell = 0; cell < 6; ++cell)
      sum += Simpson(cell, cell + 1, 200,
                     [&](double x) { return grid.basis.Value(x - a) * grid.basis.Value(x - b); });
    return 0.02 * sum;
  };
  for (int pixel = 0; pixel < 16; ++pixel) {
    double expected = 0;
    for (int n = 0; n < 2; ++n)
      for (int m = 0; m < 3; ++m)
        expected += field.image(grid.index(m, n), 0)[pixel] * inner(1, m) * inner(0, n);
    EXPECT_NEAR(image[pixel], expected, 2e-7 * expected);
  }
}

TEST(Tracer, TracingTogetherIsTracingAlone) {
  const auto lamp = MakeHeadlight({});
  const lightfield::Lattice lattice{40, 30, -0.2, 0.1, 0.01, 0.01};
  const std::vector<FilterPose> poses = {{{0, 0}, 0}, {{0.02, 0.001}, 0}, {{-0.04, 0.02}, 0}};
  const std::vector<LatticeWindow> windows = {{0, 0, 40, 30}, {3, 2, 20, 20}, {10, 0, 30, 7}};
  const auto together =
      TraceIrradiance(*lamp, IdealPrint(0.02), 0.03, poses, lattice, windows, Options(4));
  for (std::size_t p = 0; p < poses.size(); ++p)
    EXPECT_EQ(together[p], TraceIrradiance(*lamp, IdealPrint(0.02), 0.03, {poses[p]}, lattice,
                                           {windows[p]}, Options(4))[0]);
}

TEST(Tracer, SubSamplesAreTheTexelsMean) {
  const auto lamp = MakeSquare({0.06, 0.02, 1000, {1, 1, 1}});
  const lightfield::Lattice coarse{6, 4, -0.3, 0.2, 0.1, 0.1},
      fine{18, 12, -0.3, 0.2, 0.1 / 3, 0.1 / 3};
  auto options = Options(4);
  const auto points = TraceIrradiance(*lamp, IdealPrint(0.02), 0.03, {{{0, 0}, 0}}, fine,
                                      {{0, 0, 18, 12}}, options)[0];
  options.s_samples_per_texel = 3;
  const auto means = TraceIrradiance(*lamp, IdealPrint(0.02), 0.03, {{{0, 0}, 0}}, coarse,
                                     {{0, 0, 6, 4}}, options)[0];
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 6; ++column) {
      double sum = 0;
      for (int k = 0; k < 9; ++k) sum += points[(3 * row + k / 3) * 18 + 3 * column + k % 3];
      EXPECT_NEAR(means[row * 6 + column], sum / 9, 1e-6 * sum / 9);
    }
}

// docs/theory.md 3, "Measured filters": a filter shifted by 0.01 of its spacing changes by 1.35 %
// (L2); sqrt(1 / (11/20)) per spacing in 1-D.
TEST(FilterPrint, AShiftOfOnePercentChangesItBy135Percent) {
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  const FilterPrint ideal(Sheet(basis, 1, 1, false), {}, 0),
      shifted(Sheet(basis, 1, 1, false), {{0.01, 0}, 0, 0, 0, 0, 1}, 0);
  double difference = 0, norm = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec2 x{-2 + 0.001 * (k + 0.5), 0};
    difference += std::pow(shifted.Transmittance(x, 0) - ideal.Transmittance(x, 0), 2);
    norm += std::pow(ideal.Transmittance(x, 0), 2);
  }
  EXPECT_NEAR(std::sqrt(difference / norm), 0.01 * std::sqrt(20.0 / 11), 1e-5);
}

TEST(FilterPrint, ErrorsAreAsStated) {
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  const FilterPrint ideal(Sheet(basis, 1, 16.0 / 9, false), {}, 3);
  EXPECT_NEAR(ideal.Transmittance({0, 0}, 0), 1, 1e-12);
  EXPECT_EQ(ideal.Transmittance({1.5, 0}, 0), 0);
  PrintErrors errors;
  errors.density = 0.03;
  EXPECT_NEAR(FilterPrint(Sheet(basis, 1, 1, false), errors, 3).Transmittance({0.3, 0.2}, 0),
              1.03 * basis.Value(1.8) * basis.Value(1.7), 1e-12);
  errors = {};
  errors.rotation_rad =
      0.1;  // a square filter turned: its corner direction gains, its side direction stays
  EXPECT_NEAR(FilterPrint(Sheet(basis, 1, 1, false), errors, 3).Transmittance({0.3, 0}, 0),
              basis.Value(1.5 + 0.3 * std::cos(0.1)) * basis.Value(1.5 - 0.3 * std::sin(0.1)),
              1e-12);
  errors = {};
  errors.grain = 0.02;
  errors.grain_size_m = 0.01;
  const FilterPrint grainy(Sheet(basis, 1, 1, false), errors, 3),
      flat(Sheet(basis, 1, 1, false), {}, 3);
  double sum = 0, squares = 0;
  int count = 0;
  for (double x = -1; x < 1; x += 0.0171)
    for (double y = -1; y < 1; y += 0.0173) {
      const double relative = grainy.Transmittance({x, y}, 0) / flat.Transmittance({x, y}, 0) - 1;
      sum += relative;
      squares += relative * relative;
      ++count;
    }
  // About 117^2 points, correlated over at most 4 neighbours.
  EXPECT_NEAR(sum / count, 0, 4 * 0.02 * 2 / std::sqrt(count));
  EXPECT_NEAR(std::sqrt(squares / count), 0.02, 0.02 * 0.06);

  // Over squares of six grains the mean has the variance of a sum over as many areas of the
  // autocorrelation, (3/2)^2 grains^2: 0.02 times 1.5 / 6, less for what reaches over the edges.
  squares = 0;
  count = 0;
  for (double x = -0.97; x < 0.97; x += 0.06)
    for (double y = -0.97; y < 0.97; y += 0.06) {
      const double relative =
          grainy.Transmittance({x, y}, 0, 0.06) / flat.Transmittance({x, y}, 0) - 1;
      squares += relative * relative;
      ++count;
    }
  EXPECT_NEAR(std::sqrt(squares / count), 0.02 * 1.5 / 6, 0.02 * 1.5 / 6 * 0.12);
}

// docs/theory.md 3: the two prints of a dual filter, scaled by their peaks, make Phi*; at a = 1/2
// the peaks are 9 and 0.919.
TEST(FilterPrint, DualPrintsCombineToTheDualFilter) {
  const Basis basis = Basis::Make(BasisKind::kQuadratic, 0.5);
  EXPECT_NEAR(basis.DualPeaks()[0], 9, 1e-12);
  EXPECT_NEAR(basis.DualPeaks()[1], 0.919, 1e-3);
  const FilterPrint print(Sheet(basis, 0.01, 1, true), {}, 0);
  for (double x = -0.0095; x < 0.01; x += 0.0012)
    for (double y = -0.0095; y < 0.01; y += 0.0013) {
      const double plus = print.Transmittance({x, y}, 0), minus = print.Transmittance({x, y}, 1);
      EXPECT_LE(plus, 1);
      EXPECT_LE(minus, 1);
      EXPECT_NEAR(basis.DualPeaks()[0] * plus - basis.DualPeaks()[1] * minus,
                  basis.DualValue(x / 0.01) * basis.DualValue(y / 0.01), 1e-12);
    }
}

// docs/theory.md 3, "Pulsed light": whole periods leave no error; 1 kHz at 10 % duty and 20.5 ms
// leave +-2.4 %.
TEST(LampTime, PwmBeatsWithTheExposure) {
  LampTime lamp;
  lamp.pwm_hz = 1000;
  lamp.pwm_duty = 0.1;
  double least = 2, most = 0;
  for (int k = 0; k < 1000; ++k) {
    const double start = 1e-6 * k;
    EXPECT_NEAR(lamp.MeanFactor(start, 0.020), 1, 1e-9);
    least = std::min(least, lamp.MeanFactor(start, 0.0205));
    most = std::max(most, lamp.MeanFactor(start, 0.0205));
  }
  EXPECT_NEAR(most - 1, 0.5 / 20.5, 1e-3);
  EXPECT_NEAR(1 - least, 0.5 / 20.5, 1e-3);
  lamp.pwm_duty = 1;
  EXPECT_NEAR(lamp.MeanFactor(0.1234, 0.0207), 1, 1e-9);
}

TEST(LampTime, WarmUpAndDriftAreAsStated) {
  LampTime lamp;
  lamp.warm_up_excess = 0.05;
  lamp.warm_up_tau_s = 100;
  EXPECT_NEAR(lamp.MeanFactor(0, 0), 1.05, 1e-12);
  EXPECT_NEAR(lamp.MeanFactor(100, 0), 1 + 0.05 / std::exp(1.0), 1e-12);
  lamp = {};
  lamp.drift_per_hour = -0.01;
  EXPECT_NEAR(lamp.MeanFactor(3600, 0), 0.99, 1e-12);
}

std::vector<double> RadianceOf(const Lamp& lamp, Vec2 u, double slope_x, double slope_y) {
  constexpr double kDelta = 0.3;
  const std::vector<double> s = {u.x + kDelta * slope_x};
  std::vector<double> radiance(1);
  lamp.Radiance(u, kDelta, u.y + kDelta * slope_y, s, radiance);
  return radiance;
}

TEST(Headlight, ShinesBelowTheCutOffOnly) {
  HeadlightOptions options;
  options.shield_defocus = 0;  // a sharp edge: the direction alone decides
  const auto lamp = MakeHeadlight(options);
  const double haze = options.haze * options.chip_radiance;
  int lit = 0;
  for (double x = -0.06; x < 0.06; x += 0.004)
    for (double y = -0.06; y < 0.06; y += 0.004) {
      for (const double mx : {-0.3, 0.0, 0.3}) {
        const double edge = std::tan(options.cutoff_deg * M_PI / 180) +
                            std::tan(options.kink_deg * M_PI / 180) * std::max(-mx, 0.0);
        EXPECT_DOUBLE_EQ(RadianceOf(*lamp, {x, y}, mx, edge + 0.002)[0], haze)
            << x << " " << y << " " << mx;
        lit += RadianceOf(*lamp, {x, y}, mx, edge - 0.1)[0] > 1e5 * haze;
      }
    }
  EXPECT_GT(lit, 50);  // five decades above the haze somewhere
}

TEST(Headlight, IsDarkWhereItSaysAndNowhereBrighterThanItsChips) {
  const HeadlightOptions options;
  const auto lamp = MakeHeadlight(options);
  core::Random random(5, 0);
  for (int k = 0; k < 20000; ++k) {
    const Vec2 u{0.3 * random.Uniform() - 0.15, 0.3 * random.Uniform() - 0.15};
    const double radiance =
        RadianceOf(*lamp, u, 2 * random.Uniform() - 1, 2 * random.Uniform() - 1)[0];
    EXPECT_TRUE(radiance == 0 || !lamp->DarkAt(u));
    EXPECT_LE(radiance, options.chip_radiance * (options.transmission + options.haze));
    EXPECT_GE(radiance, 0);
  }
}

TEST(Bowl, AParaboloidSendsRaysParallelToTheAxisThroughItsFocus) {
  BowlOptions options;
  options.tilt_across = options.tilt_up = options.coil_ahead_m = 0;
  const auto lamp = MakeBowl(options);
  const double f = options.focal_m;
  for (double x = -0.015; x <= 0.015; x += 0.005)
    for (double y = -0.015; y <= 0.015; y += 0.005) {
      // The line from the mirror to the focus meets the coil in its middle (q = 0): L_0 over the
      // length of its unit direction, seen with the coil as a sphere.
      const double z = (x * x + y * y) / (4 * f), distance = z + f;
      const double dx = x / distance, squeeze = options.coil_radius_m / options.coil_length_m;
      const double along = std::sqrt(1 - dx * dx * (1 - squeeze * squeeze));
      const double expected = options.coil_radiance * (options.reflectance / along + options.haze);
      EXPECT_NEAR(RadianceOf(*lamp, {x, y}, 0, 0)[0] / expected, 1, 1e-9) << x << " " << y;
    }
}

// A ray that grazes the rim from outside meets the mirror far on the other side.
TEST(Bowl, RaysThroughItsRimMeetTheMirror) {
  BowlOptions options;
  options.gap_m = 0;
  options.tilt_across = options.tilt_up = 0;
  const auto lamp = MakeBowl(options);
  const double r = options.radius_m;
  for (const double slope : {0.5, 0.875, 1.0, 1.7})
    for (const Vec2 out : {Vec2{1, 0}, {0, -1}, {-1, 0}}) {
      const double rim = RadianceOf(*lamp, {r * out.x, r * out.y}, slope * out.x, slope * out.y)[0];
      const double inside = (1 - 1e-9) * r;
      const double beside =
          RadianceOf(*lamp, {inside * out.x, inside * out.y}, slope * out.x, slope * out.y)[0];
      EXPECT_NEAR(rim, beside, 1e-4 * options.coil_radiance) << slope << " " << out.x;
    }
}

TEST(Bowl, IsDarkWhereItSaysAndNowhereBrighterThanItsCoil) {
  const BowlOptions options;
  const auto lamp = MakeBowl(options);
  // Brightest along the coil.
  const double brightest =
      options.coil_radiance *
      (options.reflectance * options.coil_length_m / options.coil_radius_m + options.haze);
  core::Random random(6, 0);
  int lit = 0;
  for (int k = 0; k < 20000; ++k) {
    const Vec2 u{0.1 * random.Uniform() - 0.05, 0.1 * random.Uniform() - 0.05};
    const double radiance =
        RadianceOf(*lamp, u, 2 * random.Uniform() - 1, 2 * random.Uniform() - 1)[0];
    EXPECT_TRUE(radiance == 0 || !lamp->DarkAt(u));
    EXPECT_LE(radiance, brightest);
    EXPECT_GE(radiance, 0);
    lit += radiance > 0.1 * options.coil_radiance;
  }
  EXPECT_GT(lit, 100);
}

// Lines through a point of I cross F where the coil lies behind it; seen from far off the coil is a
// point of intensity 2 pi L_0 a b, whatever the direction and the turn.
TEST(Filament, SendsItsIntensityIntoEveryDirection) {
  FilamentOptions options;
  options.coil_radius_m = 2e-4;
  options.coil_length_m = 9e-4;
  options.opening_m = 1;
  const double gap = options.gap_m, delta = 0.9;
  const double intensity =
      2 * std::numbers::pi * options.coil_radiance * options.coil_radius_m * options.coil_length_m;
  for (const double turn_deg : {0.0, 35.0, 90.0})
    for (const Vec2 s : {Vec2{0, 0}, {0.5, 0}, {-0.4, 0.7}}) {
      options.coil_turn_deg = turn_deg;
      const auto lamp = MakeFilament(options);
      // The irradiance at s: rays through F, each of the solid angle du cos^3 / delta^2 with the
      // cosine of the receiver. The coil's picture on F is (delta / (delta + gap)) times as large.
      const double share = gap / (gap + delta), reach = 8 * options.coil_length_m;
      const Vec2 middle{s.x * share, s.y * share};
      const double irradiance = Simpson(-reach, reach, 200, [&](double x) {
        return Simpson(-reach, reach, 200, [&](double y) {
          const Vec2 u{middle.x + x, middle.y + y};
          const double mx = (s.x - u.x) / delta, my = (s.y - u.y) / delta;
          const double cos2 = 1 / (1 + mx * mx + my * my);
          return RadianceOf(*lamp, u, mx, my)[0] * cos2 * cos2 / (delta * delta);
        });
      });
      const double distance2 = s.x * s.x + s.y * s.y + (gap + delta) * (gap + delta);
      const double expected = intensity * (gap + delta) / std::pow(distance2, 1.5);
      // The coil is not a point: its extent changes the inverse square by about b^2 / distance^2.
      EXPECT_NEAR(irradiance / expected, 1, 1e-5) << turn_deg << " " << s.x << " " << s.y;
    }
}

TEST(Filament, PassesItsOpeningOnly) {
  FilamentOptions options;
  options.opening_m = 0.02;
  const auto lamp = MakeFilament(options);
  for (const double r : {0.0199, 0.0201})
    for (const Vec2 u : {Vec2{r, 0}, {-0.6 * r, 0.8 * r}}) {
      const bool inside = r < options.opening_m;
      EXPECT_EQ(lamp->DarkAt(u), !inside);
      // Straight away from the coil.
      const double radiance = RadianceOf(*lamp, u, u.x / options.gap_m, u.y / options.gap_m)[0];
      EXPECT_EQ(radiance > 0, inside) << r;
    }
}

}  // namespace
}  // namespace luxfield::hal::sim
