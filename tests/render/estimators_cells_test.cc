// `cells`: density and unbiasedness for every basis, colour, extremes, bounds, less variance than
// `windowed`.
#include "luxfield/render/estimators/sampling_estimators.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/render/lights/shadow_maps.h"
#include "tests/render/brute_force.h"
#include "tests/render/sampling_fixture.h"

namespace luxfield::render {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = kSamplingSeed;

LuminaireShape ShapeOf(const Basis& basis, int channels = 1) {
  LuminaireShape shape;
  shape.basis = basis;
  shape.channels = channels;
  return shape;
}

TEST(Cells, IsUnbiasedForEveryBasisAndColour) {
  std::printf("seeds from %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  const auto points = FacingReceivers(0.3, 60);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  for (const Basis& basis :
       {Basis::Make(BasisKind::kBox), Basis::Make(BasisKind::kBilinear),
        Basis::Make(BasisKind::kQuadratic, 0.5), Basis::Make(BasisKind::kQuadratic, -1.0),
        Basis::Make(BasisKind::kBspline2)})
    for (const char* kind : {"rings", "facets", "filament"})
      for (const int channels : {1, 3}) {
        const LitLuminaire luminaire(device,
                                     StructuredLuminaire(kind, ShapeOf(basis, channels), kSeed));
        EstimatorOptions options;
        options.samples_per_pixel = 24;
        const std::string what =
            basis.name() + ", " + kind + ", " + std::to_string(channels) + " channels";
        ExpectUnbiased(OverSeeds(device, *cells, gbuffer, luminaire.on_device, options, 64),
                       ExactLuminance(luminaire.field, points), 64, what.c_str(),
                       1.0 / (64 * options.samples_per_pixel));
      }
}

// Light where a table of sum C Phi at the cells' centres would see next to nothing: single images,
// each lit in one texel, and a grazing horizon that cuts the lamp.
TEST(Cells, ReachesLightAtTheCornersOfCellsAndAtTheHorizon) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  LuminaireShape shape;
  shape.width = shape.height = 12;
  lightfield::LightField field = EmptyLuminaire(shape);
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    field.image(m, 0)[(3 + m) * 12 + 9 - m] = m % 2 ? 1.0f : 1e-8f;
  const LitLuminaire luminaire(device, field);
  auto points = FacingReceivers(0.3, 100, 0.1, 0.6);
  for (int k = 0; k < 40; ++k) {  // the plane through p and (0.01 k - 0.2, 0, 0) m
    const Vec3 p{0.05 * (k % 7) - 0.15, 0.02 * (k % 5), 0.5};
    const Vec3 in_plane{p.x - (0.002 * k - 0.04), 0, p.z};
    points.push_back(RoundToFloat({p, Normalized(Vec3{in_plane.z, 0.1, -in_plane.x})}));
  }
  const auto exact = ExactLuminance(field, points);
  ASSERT_GT(std::count_if(exact.begin(), exact.end(), [](double e) { return e > 0; }), 60);
  EstimatorOptions options;
  options.samples_per_pixel = 16;
  ExpectUnbiased(
      OverSeeds(device, *cells, MakeGBuffer(device, points), luminaire.on_device, options, 64),
      exact, 64, "single texels");
}

TEST(Cells, ExtremeReceiversAndWindows) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  for (const double delta : {0.001, 0.25, 10.0})
    for (const int texels : {1, 3, 40}) {
      LuminaireShape shape;
      shape.delta_m = delta;
      shape.width = texels;
      shape.height = texels;
      const LitLuminaire luminaire(device, StructuredLuminaire("grain", shape, kSeed));
      std::vector<SurfacePoint> points;
      for (const double D :
           {0.0, 1e-9, 1e-6, 1e-3, 0.1, 100.0, 1e6, -0.01 * delta, -0.5 * delta, -0.9 * delta})
        for (const double x : {0.0, 0.013, -0.037, 3.0})
          points.push_back(
              RoundToFloat({{x, 0.5 * x + 0.001, delta + D}, Normalized(Vec3{0.1, 0.2, -1})}));
      // On a texel border, facing and grazing.
      points.push_back(RoundToFloat({{0, 0, 2 * delta}, {0, 0, -1}}));
      points.push_back(RoundToFloat({{0, 0, 2 * delta}, {1, 0, 0}}));
      points.push_back(RoundToFloat({{0, 0, 2 * delta}, Normalized(Vec3{0, 1, -1e-4})}));
      const GBuffer gbuffer = MakeGBuffer(device, points);
      const auto exact = ExactLuminance(luminaire.field, points);
      for (const int samples : {1, 64}) {
        EstimatorOptions options;
        options.samples_per_pixel = samples;
        const std::string what = "delta " + std::to_string(delta) + ", " + std::to_string(texels) +
                                 " texels, K " + std::to_string(samples);
        ExpectUnbiased(OverSeeds(device, *cells, gbuffer, luminaire.on_device, options, 64), exact,
                       64, what.c_str());
      }
    }
}

// Windows wholly in the dark keep their digits beside texels eight decades brighter.
TEST(Cells, EightDecades) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  LuminaireShape shape;
  shape.width = shape.height = 64;
  lightfield::LightField field = EmptyLuminaire(shape);
  core::Random random(kSeed, 5);
  for (std::size_t k = 0; k < field.data.size(); ++k)
    field.data[k] = static_cast<float>((k % 64 < 32 ? 1e-8 : 1.0) * (0.5 + random.Uniform()));
  const LitLuminaire luminaire(device, field);
  // The lamp, 83 mm wide, is seen through 38 to 62 mm of I: x < 0 through dark texels alone.
  std::vector<SurfacePoint> points;
  for (int k = 0; k < 40; ++k) {
    const double side = k % 2 ? 1 : -1, D = 0.25 + 0.0125 * k;
    points.push_back(RoundToFloat(
        {{side * 0.16 * (0.3 + D) / 0.3 * (0.5 + 0.01 * k), 0.1 * random.Uniform(), 0.3 + D},
         {0, 0, -1}}));
  }
  EstimatorOptions options;
  options.samples_per_pixel = 32;
  const auto statistics =
      OverSeeds(device, *cells, MakeGBuffer(device, points), luminaire.on_device, options, 64);
  const auto exact = ExactLuminance(field, points);
  ExpectUnbiased(statistics, exact, 64, "eight decades");
  for (std::size_t k = 0; k < points.size(); ++k) {
    ASSERT_GT(exact[k], 0);
    EXPECT_LT(statistics.standard_error[k], 0.02 * exact[k]) << k;
  }
  EXPECT_LT(exact[0], 1e-7 * exact[1]);
}

TEST(Cells, TurnedAwayOrWithoutLightTakesNoSample) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  const LitLuminaire luminaire(device, StructuredLuminaire("noise", {}, kSeed)),
      dark(device, EmptyLuminaire({}));
  const SurfacePoint away{{0, 0, 1}, {0, 0, 1}};
  for (const Lit& lit :
       {LightGBuffer(device, *cells, MakeGBuffer(device, {away}), luminaire.on_device),
        LightGBuffer(device, *cells, MakeGBuffer(device, FacingReceivers(0.3, 60)),
                     dark.on_device)})
    for (std::size_t k = 0; k < lit.samples.size(); ++k) {
      EXPECT_EQ(lit.samples[k], 0u);
      EXPECT_EQ(lit.irradiance[k].s[0], 0);
    }
}

// One sample shows at most 40 q A (cells.h), A = sum of w M over the cells, here bounded by the
// largest E over the cell areas.
TEST(Cells, ContributionsAreBounded) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  LuminaireShape shape;
  const LitLuminaire luminaire(device, StructuredLuminaire("noise", shape, kSeed));
  const auto points = FacingReceivers(0.3, 50);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto& g = luminaire.field.geometry;
  const double area = luminaire.cells.count() * shape.spacing_m * shape.spacing_m;
  for (int seed = 0; seed < 100; ++seed) {
    EstimatorOptions options;
    options.samples_per_pixel = 1;
    options.seed = kSeed + seed;
    const Lit lit = LightGBuffer(device, *cells, gbuffer, luminaire.on_device, options);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Vec3 p = points[k].p;
      const double half = 0.5 * (shape.grid_width + 2) * shape.spacing_m;
      const double far = lightfield::Length({std::abs(p.x) + half, std::abs(p.y) + half, p.z});
      EXPECT_LE(lit.irradiance[k].s[0],
                40 * 9 * 1.5 * area * far * g.delta_m * g.delta_m / std::pow(p.z, 3));
    }
  }
}

// The relative variance of one sample of constant images, by quadrature: cells are drawn by their
// L2 norms, points with density 1 - f + f E / mean(E). Images of one texel are drawn from the fit
// alone, f = 1; else f = 0.9 L1 / L2.
double VarianceOfConstantImages(const lightfield::BasisGrid& grid, bool one_texel) {
  constexpr int kSteps = 32;
  // Sum of the basis functions of an axis that are active in cell `a`, at its nodes.
  const auto along = [&](int a, int images) {
    std::array<double, kSteps> sum{};
    for (int k = 0; k < grid.basis.cells; ++k)
      for (int step = 0; a - k >= 0 && a - k < images && step < kSteps; ++step)
        sum[step] += grid.basis.CellValue(k, (step + 0.5) / kSteps);
    return sum;
  };
  const int columns = grid.width + grid.basis.cells - 1, rows = grid.height + grid.basis.cells - 1;
  double l2_sum = 0, light = 0, second = 0;
  for (int b = 0; b < rows; ++b)
    for (int a = 0; a < columns; ++a) {
      const auto x = along(a, grid.width), y = along(b, grid.height);
      double l1 = 0, squares = 0, moment = 0;
      for (const double ey : y)
        for (const double ex : x) {
          l1 += ex * ey / (kSteps * kSteps);
          squares += std::pow(ex * ey, 2) / (kSteps * kSteps);
        }
      const double l2 = std::sqrt(squares), f = one_texel ? 1 : 0.9 * l1 / l2;
      for (const double ey : y)
        for (const double ex : x)
          moment += std::pow(ex * ey, 2) / (1 - f + f * ex * ey / l1) / (kSteps * kSteps);
      l2_sum += l2;
      light += l1;
      second += moment / l2;
    }
  return l2_sum * second / (light * light) - 1;
}

// E is constant but where Phi ramps to 0 at the rim.
TEST(Cells, ConstantImagesHaveTheVarianceOfTheRim) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  for (const int texels : {1, 200}) {
    LuminaireShape shape;
    shape.grid_width = shape.grid_height = 7;
    shape.width = shape.height = texels;
    lightfield::LightField field = EmptyLuminaire(shape);
    std::fill(field.data.begin(), field.data.end(), 1.0f);
    const LitLuminaire luminaire(device, field);
    const std::vector<SurfacePoint> points(8192, SurfacePoint{{0.01, 0.02, 2}, {0, 0, -1}});
    EstimatorOptions options;
    options.samples_per_pixel = 1;
    const double exact = ExactLuminance(field, {points[0]})[0];
    double variance = 0;
    for (const auto& e :
         LightGBuffer(device, *cells, MakeGBuffer(device, points), luminaire.on_device, options)
             .irradiance)
      variance += std::pow(e.s[0] / exact - 1, 2) / 8192;
    const double expected = VarianceOfConstantImages(field.geometry.grid, texels == 1);
    std::printf("constant images of %d texels: relative variance per sample %.5f, expected %.5f\n",
                texels, variance, expected);
    // The scatter of 8192 squares, and 0.2 % of cosine over the lamp.
    EXPECT_NEAR(variance, expected, 0.15 * expected);
  }
}

TEST(Cells, ShadowsBlockAllOrNone) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  const LitLuminaire luminaire(device, StructuredLuminaire("facets", {}, kSeed));
  const auto points = FacingReceivers(0.3, 64, 0.5, 2);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto all = Blocker(device, -10, 10, 0.1f), none = Blocker(device, 20, 30, 0.1f);
  const auto run = [&](const RayScene* rays) {
    return LightGBuffer(device, *cells, gbuffer, luminaire.on_device, {}, rays).irradiance;
  };
  const auto open = run(nullptr), dark = run(all.get()), clear = run(none.get());
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_GT(open[k].s[0], 0);
    EXPECT_EQ(dark[k].s[0], 0);
    EXPECT_EQ(clear[k].s[0], open[k].s[0]);
  }
}

// By shadow maps: the light of the cells whose bit is set, by quadrature.
TEST(Cells, ShadowMapsCountCellByCell) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  const LitLuminaire luminaire(device, StructuredLuminaire("facets", {}, kSeed));
  const auto points = FacingReceivers(0.3, 48, 0.5, 2);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto half = Blocker(device, 0, 10, 0.01f);
  const auto& g = luminaire.field.geometry;
  const ShadowMaps maps(device, g, CellCentres(luminaire.field), {}, *half, 64);
  const auto seen = maps.SeeCells(gbuffer).Download<cl_uint>();
  const std::size_t words = seen.size() / points.size();
  std::vector<double> judge;
  double open = 0, lit = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto [p, n] = points[k];
    double sum = 0;
    VisitLight(luminaire.field, p, 1, [&](double flux, Vec3 to_lamp) {
      const int a = static_cast<int>((p.x + to_lamp.x - g.grid.u0_m) / g.grid.spacing_m),
                b = static_cast<int>((p.y + to_lamp.y - g.grid.v0_m) / g.grid.spacing_m);
      const int cell = b * luminaire.cells.grid_width + a;
      const double light = flux * std::max(0.0, Dot(n, to_lamp));
      open += light;
      if (seen[k * words + cell / 32] >> (cell % 32) & 1) sum += light;
    });
    judge.push_back(sum);
    lit += sum;
  }
  EXPECT_GT(lit, 0.2 * open);
  EXPECT_LT(lit, 0.8 * open);
  SeedSums sums(points.size());
  for (int seed = 0; seed < 64; ++seed) {
    EstimatorOptions options;
    options.samples_per_pixel = 32;
    options.seed = kSeed + seed;
    Lighting lighting(device, gbuffer);
    cells->Light({gbuffer, {.maps = &maps}}, PosedLuminaire{luminaire.on_device}, options,
                 lighting);
    sums.Add(lighting.irradiance.Download<cl_float4>(), lighting.variance.Download<float>());
  }
  ExpectUnbiased(sums.Statistics(), judge, 64, "half blocked, by maps");
}

}  // namespace
}  // namespace luxfield::render
