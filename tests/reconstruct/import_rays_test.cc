#include "luxfield/reconstruct/solve/import_rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/reconstruct/solve/import_rays_json.h"
#include "tests/test_data.h"

namespace luxfield::reconstruct {
namespace {

using formats::Ray;
using formats::RayFile;
using lightfield::LuminaireGeometry;
using lightfield::Normalized;
using lightfield::Vec2;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 25;

LuminaireGeometry SmallGeometry() {
  LuminaireGeometry geometry;
  geometry.delta_m = 0.2;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 7, 6, 0.01);
  geometry.lattice = {4, 3, -0.04, 0.03, 0.02, 0.02};
  return geometry;
}

// Rays of equal flux 1/n from the luminaire whose only coefficient image is that of basis (3, 2),
// brighter to the right: docs/theory.md, section 2.
RayFile RaysInTheSpan(const LuminaireGeometry& g, int count, std::uint64_t stream) {
  RayFile file;
  core::Random random(kSeed, stream);
  for (int n = 0; n < count; ++n) {
    const double x =
        random.Uniform() + random.Uniform() + random.Uniform();  // density of the B-spline
    const double y = random.Uniform() + random.Uniform() + random.Uniform();
    const Vec2 u{g.grid.u0_m + (3 + x) * g.grid.spacing_m,
                 g.grid.v0_m + (2 + y) * g.grid.spacing_m};
    const double column = random.Uniform() < 0.25 ? 2 * random.Uniform() : 2 + 2 * random.Uniform();
    const Vec2 s{g.lattice.s_of_column(column), g.lattice.t_of_row(3 * random.Uniform())};
    const Vec3 direction = Normalized(Vec3{s.x - u.x, s.y - u.y, g.delta_m});
    const double back = 0.3 * random.Uniform() - 0.1;  // started anywhere along the line
    file.rays.push_back({Vec3{u.x, u.y, 0} - back * direction, direction, 1.0 / count, {}});
  }
  return file;
}

double TrueCoefficient(const LuminaireGeometry& g, int m, int column) {
  if (m != g.grid.index(3, 2)) return 0;
  const double texel_flux = (column < 2 ? 0.25 : 0.75) / 6;
  return texel_flux / (g.lattice.texel_area_m2() * g.grid.PhiIntegral());
}

TEST(ImportRays, FindsALuminaireInTheSpanWithinItsCountingNoise) {
  const LuminaireGeometry g = SmallGeometry();
  ImportRaysOptions options;
  options.geometry = g;
  options.signs = RaySigns::kSigned;
  const RayImport result = ImportRays(RaysInTheSpan(g, 40000, 1), options);
  EXPECT_EQ(result.report.used.rays, 40000u);
  EXPECT_NEAR(result.report.fitted_flux, 1, 1e-6);
  double chi2 = 0, count = 0, worst = 0;
  for (int m = 0; m < g.grid.count(); ++m)
    for (int p = 0; p < 12; ++p) {
      const double sigma = result.sigma[0].field.image(m, 0)[p];
      const double z =
          (result.coefficients[0].field.image(m, 0)[p] - TrueCoefficient(g, m, p % 4)) / sigma;
      chi2 += z * z;
      worst = std::max(worst, std::abs(z));
      ++count;
    }
  EXPECT_NEAR(chi2 / count, 1, 0.25)
      << "seed " << kSeed;  // correlated within a texel: 12 x about 20 free values
  EXPECT_LT(worst, 5);
}

TEST(ImportRays, StatesItsCountingNoise) {
  const LuminaireGeometry g = SmallGeometry();
  ImportRaysOptions options;
  options.geometry = g;
  options.signs = RaySigns::kSigned;
  constexpr int kRuns = 300;
  const std::size_t count = g.value_count();
  std::vector<double> sum(count), squares(count), variance(count);
  for (int run = 0; run < kRuns; ++run) {
    const RayImport result =
        ImportRays(RaysInTheSpan(g, 600, 100 + static_cast<std::uint64_t>(run)), options);
    for (std::size_t k = 0; k < count; ++k) {
      sum[k] += result.coefficients[0].field.data[k];
      squares[k] += std::pow(result.coefficients[0].field.data[k], 2);
      variance[k] += std::pow(result.sigma[0].field.data[k], 2) / kRuns;
    }
  }
  double mean_ratio = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double mean = sum[k] / kRuns;
    mean_ratio += (squares[k] / kRuns - mean * mean) / variance[k] / static_cast<double>(count);
  }
  // A fixed number of rays instead of a Poisson one takes away at most a texel's share, 1/8, of the
  // bright values' variance.
  EXPECT_NEAR(mean_ratio, 1, 0.04);
}

TEST(ImportRays, CountsWhatMissesAndWhy) {
  const LuminaireGeometry g = SmallGeometry();
  ImportRaysOptions options;
  options.geometry = g;
  options.signs = RaySigns::kSigned;
  RayFile file;
  file.flux_is_luminous = true;
  file.header.luminous_flux_lm = 20;
  file.header.radiant_flux_w = 1;
  file.rays = {{{0, 0, 0}, {0, 0, 1}, 1, {}},      // used
               {{0, 0, 0.7}, {0, 0, 1}, 2, {}},    // started beyond I: carried back
               {{0, 0, 0}, {0, 0, -1}, 3, {}},     // backwards
               {{0, 0, 0}, {1, 0, 0}, 4, {}},      // along the plane
               {{0.031, 0, 0}, {0, 0, 1}, 5, {}},  // in an outer cell of F
               {{0, 0, 0}, Normalized(Vec3{0.041, 0, 0.2}), 5, {}}};  // beside I
  const RayImport result = ImportRays(file, options);
  const RayImportReport& r = result.report;
  EXPECT_DOUBLE_EQ(r.ray_flux, 20);
  EXPECT_DOUBLE_EQ(*r.header_flux, 20);
  EXPECT_EQ(r.used.rays, 2u);
  EXPECT_DOUBLE_EQ(r.used.flux, 3);
  EXPECT_EQ(r.backward.rays, 2u);
  EXPECT_DOUBLE_EQ(r.backward.flux, 7);
  EXPECT_EQ(r.missed_filter_plane.rays, 1u);
  EXPECT_EQ(r.missed_image_plane.rays, 1u);
  EXPECT_NEAR(r.fitted_flux, 3, 3e-6);
  EXPECT_EQ(result.coefficients[0].field.geometry.unit, lightfield::FluxUnit::kLumen);
  file.header.luminous_flux_lm = 40;  // the header scales the rays
  const RayImport scaled = ImportRays(file, options);
  EXPECT_DOUBLE_EQ(scaled.report.scale, 2);
  EXPECT_NEAR(scaled.report.fitted_flux, 6, 6e-6);
  const nlohmann::json json = ToJson(scaled.report);
  EXPECT_EQ(json["header_flux"], 40);
  EXPECT_EQ(json["ray_flux"], 20);
  EXPECT_EQ(json["backward"]["rays"], 2);
}

TEST(ImportRays, TurnsTheFileByItsPose) {
  const LuminaireGeometry g = SmallGeometry();
  ImportRaysOptions options;
  options.geometry = g;
  options.signs = RaySigns::kSigned;
  const RayFile file = RaysInTheSpan(g, 500, 7);
  // The same lamp lying on its back: x_file = R^T (x - t).
  options.luminaire_from_file.rotation = {0, 1, 0, 0, 0, 1, 1, 0, 0};
  options.luminaire_from_file.translation_m = {0.1, -0.2, 0.3};
  RayFile turned = file;
  for (Ray& ray : turned.rays) {
    const Vec3 p = ray.position_m - options.luminaire_from_file.translation_m, d = ray.direction;
    ray.position_m = {p.z, p.x, p.y};
    ray.direction = {d.z, d.x, d.y};
  }
  const RayImport posed = ImportRays(turned, options);
  options.luminaire_from_file = {};
  const RayImport straight = ImportRays(file, options);
  EXPECT_EQ(posed.report.used.rays, 500u);
  const float largest = *std::max_element(straight.coefficients[0].field.data.begin(),
                                          straight.coefficients[0].field.data.end());
  for (std::size_t k = 0; k < straight.coefficients[0].field.data.size(); ++k)
    EXPECT_NEAR(posed.coefficients[0].field.data[k], straight.coefficients[0].field.data[k],
                1e-5 * largest);
}

TEST(ImportRays, ConservesFluxWithEveryBasisAndNonNegative) {
  const RayFile file = RaysInTheSpan(SmallGeometry(), 3000, 8);
  for (const auto kind : {lightfield::BasisKind::kBox, lightfield::BasisKind::kBilinear,
                          lightfield::BasisKind::kQuadratic, lightfield::BasisKind::kBspline2})
    for (const bool non_negative : {false, true}) {
      ImportRaysOptions options;
      options.planes.basis = lightfield::Basis::Make(kind);
      options.planes.grid_width = 9;
      options.planes.grid_height = 8;
      options.planes.lattice_width = options.planes.lattice_height = 8;
      options.signs = non_negative ? RaySigns::kNonNegative : RaySigns::kSigned;
      const RayImport result = ImportRays(file, options);
      EXPECT_GT(result.report.used.flux, 0.8);
      EXPECT_NEAR(result.report.fitted_flux / result.report.used.flux, 1, 1e-5);
      if (non_negative) {
        EXPECT_GE(*std::min_element(result.coefficients[0].field.data.begin(),
                                    result.coefficients[0].field.data.end()),
                  0);
      }
    }
}

TEST(ImportRays, KeepsColour) {
  const LuminaireGeometry g = SmallGeometry();
  ImportRaysOptions options;
  options.geometry = g;
  options.signs = RaySigns::kSigned;
  RayFile file = RaysInTheSpan(g, 200, 9);
  file.flux_is_luminous = true;
  for (Ray& ray : file.rays) {  // D65 white
    ray.tristimulus = {{0.95046 * ray.flux, ray.flux, 1.08906 * ray.flux}};
  }
  const RayImport result = ImportRays(file, options);
  ASSERT_EQ(result.coefficients[0].field.geometry.channels, 3);
  const auto flux = lightfield::TotalFlux(result.coefficients[0].field);
  for (const double channel : flux) EXPECT_NEAR(channel, 1, 2e-3);  // white: equal parts
  EXPECT_NEAR(result.report.fitted_flux, 1, 1e-3);                  // rounded coefficients of Y
}

// A primary of Rec. 709 (ITU-R BT.709, x and y) of unit luminance.
std::array<double, 3> Xyz(double x, double y) { return {x / y, 1, (1 - x - y) / y}; }

TEST(ImportRays, TakesEveryPrimaryToItsChannel) {
  const LuminaireGeometry g = SmallGeometry();
  ImportRaysOptions options;
  options.geometry = g;
  options.signs = RaySigns::kSigned;
  const std::array<std::array<double, 3>, 3> primaries{Xyz(0.64, 0.33), Xyz(0.30, 0.60),
                                                       Xyz(0.15, 0.06)};
  const double luminance[3] = {0.2126, 0.7152, 0.0722};
  for (int primary = 0; primary < 3; ++primary) {
    RayFile file = RaysInTheSpan(g, 50, 12);
    file.flux_is_luminous = true;
    for (Ray& ray : file.rays)
      ray.tristimulus = {
          {primaries[primary][0] * ray.flux, ray.flux, primaries[primary][2] * ray.flux}};
    const RayImport result = ImportRays(file, options);
    const auto flux = lightfield::TotalFlux(result.coefficients[0].field);
    for (int channel = 0; channel < 3; ++channel)  // coefficients rounded to four digits
      EXPECT_NEAR(flux[channel] * luminance[primary], channel == primary ? 1 : 0, 1e-3)
          << "primary " << primary << ", channel " << channel;
    EXPECT_NEAR(result.report.fitted_flux, 1, 1e-3) << "primary " << primary;
  }
}

TEST(ImportRays, KeepsColoursOutsideRec709Signed) {
  const LuminaireGeometry g = SmallGeometry();
  ImportRaysOptions options;
  options.geometry = g;
  RayFile file = RaysInTheSpan(g, 300, 13);
  file.flux_is_luminous = true;
  for (Ray& ray : file.rays) {  // near 520 nm: red is negative
    const auto xyz = Xyz(0.0743, 0.8338);
    ray.tristimulus = {{xyz[0] * ray.flux, ray.flux, xyz[2] * ray.flux}};
  }
  const RayImport result = ImportRays(file, options);
  EXPECT_FALSE(result.report.fields[0].non_negative);
  EXPECT_NEAR(result.report.fitted_flux, 1, 1e-3);
  options.signs = RaySigns::kNonNegative;  // asked for, it costs the luminance of the red
  const RayImport cut = ImportRays(file, options);
  EXPECT_GT(cut.report.fitted_flux, 1.02);
  const auto warnings = Warnings(cut);
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const std::string& text) {
    return text.find("--signed") != std::string::npos;
  }));
}

std::string AllWarnings(const RayImport& result) {
  std::string all;
  for (const auto& warning : Warnings(result)) all += warning + "\n";
  return all;
}

TEST(ImportRays, SaysWhichFluxItTakes) {
  const LuminaireGeometry g = SmallGeometry();
  RayFile file = RaysInTheSpan(g, 20000, 14);  // of flux 1 in all
  file.flux_is_luminous = true;
  ImportRaysOptions options;
  options.geometry = g;
  struct Case {
    std::optional<double> header;
    RayFluxFrom asked;
    double flux;
    bool warns;
  };
  for (const Case& c :
       {Case{{}, RayFluxFrom::kAuto, 1, false}, Case{1.09, RayFluxFrom::kAuto, 1.09, false},
        Case{1.11, RayFluxFrom::kAuto, 1.11, true}, Case{0.5, RayFluxFrom::kAuto, 0.5, true},
        Case{90., RayFluxFrom::kAuto, 90, true},
        Case{1e4, RayFluxFrom::kAuto, 1, true},  // a placeholder
        Case{1e-6, RayFluxFrom::kAuto, 1, true}, Case{1e-6, RayFluxFrom::kHeader, 1e-6, true},
        Case{0.5, RayFluxFrom::kRays, 1, true}, Case{0.5, RayFluxFrom::kValue, 7, false}}) {
    file.header.luminous_flux_lm = c.header;
    options.flux_from = c.asked;
    options.flux = 7;
    const RayImport result = ImportRays(file, options);
    EXPECT_NEAR(result.report.all.flux / c.flux, 1, 1e-9) << c.flux;
    EXPECT_NEAR(result.report.fitted_flux / c.flux, 1, 1e-5) << c.flux;
    EXPECT_EQ(AllWarnings(result).find("header states") != std::string::npos, c.warns)
        << c.flux << ": " << AllWarnings(result);
  }
  file.header.luminous_flux_lm.reset();
  options.flux_from = RayFluxFrom::kHeader;
  EXPECT_THROW(ImportRays(file, options), InputError);
  options.flux_from = RayFluxFrom::kValue;
  options.flux = 0;
  EXPECT_THROW(ImportRays(file, options), InputError);
}

TEST(ImportRays, WarnsOfNoise) {
  const LuminaireGeometry g = SmallGeometry();
  ImportRaysOptions options;
  options.geometry = g;
  EXPECT_EQ(AllWarnings(ImportRays(RaysInTheSpan(g, 40000, 15), options)), "");
  options.signs = RaySigns::kSigned;
  const std::string noisy = AllWarnings(ImportRays(RaysInTheSpan(g, 20, 15), options));
  EXPECT_NE(noisy.find("--non-negative"), std::string::npos) << noisy;
  EXPECT_NE(noisy.find("rays too few"), std::string::npos) << noisy;
}

// Rays through a disc of 10 mm at z = 0.4, started on a sphere of 3 m around it.
RayFile RaysThroughADisc() {
  RayFile file;
  core::Random random(kSeed, 11);
  for (int n = 0; n < 5000; ++n) {
    const double radius = 0.005 * std::sqrt(random.Uniform()),
                 turn = 2 * std::numbers::pi * random.Uniform();
    const Vec3 direction = Normalized(Vec3{0.2 * random.Normal(), 0.1 * random.Normal(), 1});
    const Vec3 at{radius * std::cos(turn), radius * std::sin(turn), 0.4};
    file.rays.push_back({at + 3 * direction, direction, 1, {}});
  }
  return file;
}

TEST(ImportRays, FindsTheWaist) {
  const RayImport result = ImportRays(RaysThroughADisc());
  ASSERT_EQ(result.coefficients.size(), 1u);
  EXPECT_NEAR(result.report.filter_z_m, 0.4, 1e-3);
  EXPECT_EQ(result.report.lost_share(), 0);
  EXPECT_EQ(result.coefficients[0].luminaire_from_field, lightfield::RigidPose{});
}

// A lamp of several planes' width sends a little beyond 45 degrees: no ray is lost, whether one
// field holds them or a cube has to.
TEST(ImportRays, LosesNoLightBeyondTheFaceOfTheCube) {
  const RayFile lens = RaysThroughADisc();
  struct Case {
    Vec3 direction;
    double share;  // of the flux
    std::size_t fields;
    double lost;
  };
  for (const Case& c : {Case{{0.3, -1.6, 1}, 0.008, 1, 0}, Case{{0.3, -1.6, 1}, 0.02, 2, 0},
                        Case{{2.2, 0, 1}, 0.008, 2, 0}, Case{{2.2, 0, 1}, 5e-5, 1, 5e-5},
                        Case{{0, 0.1, -1}, 0.008, 2, 0}, Case{{0, 0.1, -1}, 5e-5, 1, 5e-5}}) {
    SCOPED_TRACE(testing::PrintToString(c.direction.y) + " " + std::to_string(c.share));
    RayFile file = lens;
    const double all = static_cast<double>(lens.rays.size());
    for (int n = 0; n < 40; ++n)
      file.rays.push_back({{0, 0, 0.4}, Normalized(c.direction), c.share * all / 40, {}});
    const RayImport result = ImportRays(file);
    EXPECT_EQ(result.coefficients.size(), c.fields);
    EXPECT_NEAR(result.report.lost_share(), c.lost / (1 + c.share), 1e-9);
    EXPECT_NEAR(lightfield::TotalFlux(result.coefficients)[0], all * (1 + c.share - c.lost),
                2e-5 * all);
    ImportRaysOptions beam;
    beam.directions = RayDirections::kBeam;  // asked for, it stays as narrow as it is called
    EXPECT_NEAR(ImportRays(file, beam).report.lost_share(), c.share / (1 + c.share), 1e-9);
  }
}

// One field of all rays has windows for all of them, unless some graze the planes.
TEST(ImportRays, OneFieldHoldsAllRaysThatDoNotGraze) {
  RayFile file = RaysThroughADisc();
  ImportRaysOptions options;
  options.directions = RayDirections::kOne;
  EXPECT_EQ(ImportRays(file, options).report.lost_share(), 0);
  file.rays.push_back({{0, 0, 0.4}, Normalized(Vec3{0, 30, 1}), 1, {}});
  const double lost = ImportRays(file, options).report.lost_share();
  EXPECT_GT(lost, 0);
  EXPECT_LT(lost, 0.011);
}

TEST(ImportRays, RefusesWhatLeavesNoChoice) {
  RayFile file = RaysInTheSpan(SmallGeometry(), 50, 10);
  ImportRaysOptions options;
  options.planes.grid_width = 4;  // two inner cells, none left inside the margin
  options.planes.grid_height = 9;
  EXPECT_THROW(ImportRays(file, options), InputError);
  options = {};
  options.coverage = 1.1;
  EXPECT_THROW(ImportRays(file, options), InputError);
  options.coverage = 1;
  options.directions = RayDirections::kOne;
  RayFile grazing = file;
  grazing.rays.push_back({{}, Normalized(Vec3{0, 30, 1}), 1e-3, {}});
  EXPECT_THROW(ImportRays(grazing, options), InputError);
  options = {};
  options.luminaire_from_file.rotation[0] = 2;
  EXPECT_THROW(ImportRays(file, options), InputError);
  options.luminaire_from_file.rotation = {1, 0, 0, 0, 1, 0, 0, 0, -1};  // a mirror
  EXPECT_THROW(ImportRays(file, options), InputError);
  options.luminaire_from_file.rotation = {-1, 0, 0, 0, 1, 0, 0, 0, -1};  // turned away
  options.directions = RayDirections::kOne;
  EXPECT_THROW(ImportRays(file, options), InputError);
  options.directions = RayDirections::kBeam;
  EXPECT_THROW(ImportRays(file, options), InputError);
  options.directions = RayDirections::kAuto;  // which finds the light behind
  EXPECT_EQ(ImportRays(file, options).coefficients.at(0).name, "-z");
  options.planes.filter_z_m = 0;
  EXPECT_THROW(ImportRays(file, options), InputError);
  EXPECT_THROW(ImportRays(RayFile{}), InputError);
  options = {};
  options.geometry = SmallGeometry();
  options.luminaire_from_file.translation_m = {5, 0, 0};  // misses both windows
  EXPECT_THROW(ImportRays(file, options), InputError);
}

// What a million rays would take in memory, 188 bytes each, is not there.
TEST(ImportRays, KeepsNoRays) {
  constexpr int kRays = 1000000;
  const auto rays = [](const formats::RayTaker& take) {
    core::Random random(kSeed, 21);
    for (int n = 0; n < kRays; ++n) {
      const Vec3 at{0.01 * random.Uniform(), 0.01 * random.Uniform(), 0};
      take({at, Normalized(Vec3{0.2 * random.Uniform(), 0.2 * random.Uniform(), 1}), 1, {}});
    }
    return RayFile{};
  };
  ImportRaysOptions options;
  options.planes.lattice_width = options.planes.lattice_height = 16;
  ImportRays(RaysThroughADisc(), options);  // what the program takes once
  core::TakePeakMib();
  const double before = core::TakePeakMib();
  const RayImport result = ImportRays(rays, options);
  EXPECT_EQ(result.report.used.rays, static_cast<std::uint64_t>(kRays));
  EXPECT_LT(core::TakePeakMib() - before, 60);
}

TEST(ImportRays, LeavesSigmaOutWhereItIsNotAskedFor) {
  const RayFile file = RaysInTheSpan(SmallGeometry(), 500, 22);
  ImportRaysOptions options;
  options.geometry = SmallGeometry();
  const RayImport with = ImportRays(file, options);
  options.sigma = false;
  const RayImport without = ImportRays(file, options);
  EXPECT_EQ(without.coefficients[0].field.data, with.coefficients[0].field.data);
  EXPECT_EQ(with.sigma.size(), 1u);
  EXPECT_TRUE(without.sigma.empty());
}

TEST(ImportRays, NoticesAFileThatChanges) {
  RayFile file = RaysInTheSpan(SmallGeometry(), 50, 23);
  const auto rays = [&](const formats::RayTaker& take) {
    for (const Ray& ray : file.rays) take(ray);
    file.rays.pop_back();
    return RayFile{};
  };
  EXPECT_THROW(ImportRays(rays), InputError);
}

// Each texel adds its rays in their order, wherever blocks end.
TEST(RayFit, DoesNotDependOnItsBlocks) {
  LuminaireGeometry g = SmallGeometry();
  g.channels = 3;
  RayFile file = RaysInTheSpan(g, 3000, 24);
  const GramSolver solver(g.grid);
  const auto fit = [&](std::size_t block) {
    RayFit sums(g, solver, {.scale = 0.3, .block = block});
    core::Random random(kSeed, 25);
    for (const Ray& ray : file.rays) {
      RayLine line = LineOf(ray, {});
      line.xyz = {random.Uniform(), random.Uniform(), random.Uniform()};
      line.at_zero = (0.9 + 0.2 * random.Uniform()) * line.at_zero;  // some miss
      sums.Add(line);
    }
    sums.AddBlock();
    return sums;
  };
  const RayFit whole = fit(file.rays.size() + 1);
  EXPECT_GT(whole.missed_filter_plane().rays + whole.missed_image_plane().rays, 10u);
  for (const std::size_t block : {1, 7, 1000, 3000}) {
    const RayFit pieces = fit(block);
    EXPECT_EQ(pieces.Solution().data, whole.Solution().data) << block;
    EXPECT_EQ(pieces.Sigma().data, whole.Sigma().data) << block;
    EXPECT_EQ(pieces.used().rays, whole.used().rays) << block;
    EXPECT_EQ(pieces.missed_image_plane().rays, whole.missed_image_plane().rays) << block;
  }
}

class ForeignRays : public testing::TestWithParam<const char*> {};

// The light field's far field against the same rays binned by direction, in 8 x 8 bins of
// x = dir_x / dir_z, y = dir_y / dir_z.
TEST_P(ForeignRays, ConserveFluxAndTheFarField) {
  const std::filesystem::path path = testdata::Folder() / "rays_tm25" / GetParam();
  LUXFIELD_NEEDS_DATA(path);
  const RayFile file = formats::ReadTm25(path);
  ImportRaysOptions options;
  options.directions = RayDirections::kOne;
  options.coverage = 0.8;
  options.signs = RaySigns::kSigned;
  options.planes.grid_width = 11;
  options.planes.grid_height = 9;
  options.planes.lattice_width = options.planes.lattice_height = 128;
  const RayImport result = ImportRays(file, options);
  const RayImportReport& report = result.report;
  const LuminaireGeometry& g = result.coefficients[0].field.geometry;
  RecordProperty("used_flux", std::to_string(report.used.flux));
  // Both headers say 1 where the rays add up to 1e4 and more: a placeholder, and it is said.
  EXPECT_EQ(*report.header_flux, 1);
  EXPECT_EQ(report.all.flux, report.ray_flux);
  EXPECT_NE(AllWarnings(result).find("header states 1 "), std::string::npos);
  EXPECT_NEAR(report.fitted_flux / report.used.flux, 1, 1e-5);
  EXPECT_NEAR(report.used.flux + report.backward.flux + report.missed_filter_plane.flux +
                  report.missed_image_plane.flux,
              report.all.flux, 1e-9 * report.all.flux);

  constexpr int kBins = 8, kPerBin = 20;
  const double size_x = 0.7 * g.lattice.extent_s_m() / g.delta_m,
               size_y = 0.7 * g.lattice.extent_t_m() / g.delta_m;
  const double x0 = (g.lattice.s0_m + 0.15 * g.lattice.extent_s_m() - g.grid.centre(0, 0).x -
                     (g.grid.width - 1) * g.grid.spacing_m / 2) /
                    g.delta_m;
  const double y0 = (g.lattice.t1_m - 0.85 * g.lattice.extent_t_m() - g.grid.centre(0, 0).y -
                     (g.grid.height - 1) * g.grid.spacing_m / 2) /
                    g.delta_m;
  std::vector<double> flux(kBins * kBins), squares(kBins * kBins), fitted(kBins * kBins);
  const double u_low = g.grid.u0_m + 2 * g.grid.spacing_m,
               u_high = g.grid.u0_m + g.grid.width * g.grid.spacing_m;
  const double v_low = g.grid.v0_m + 2 * g.grid.spacing_m,
               v_high = g.grid.v0_m + g.grid.height * g.grid.spacing_m;
  for (const Ray& ray : file.rays) {
    if (!(ray.direction.z > 0)) continue;
    const double x = ray.direction.x / ray.direction.z, y = ray.direction.y / ray.direction.z;
    const double u = ray.position_m.x + (report.filter_z_m - ray.position_m.z) * x;
    const double v = ray.position_m.y + (report.filter_z_m - ray.position_m.z) * y;
    const double column = g.lattice.column_of_s(u + g.delta_m * x),
                 row = g.lattice.row_of_t(v + g.delta_m * y);
    if (u < u_low || u > u_high || v < v_low || v > v_high || column < 0 ||
        column >= g.lattice.width || row < 0 || row >= g.lattice.height)
      continue;
    const int bx = static_cast<int>(std::floor((x - x0) / size_x * kBins));
    const int by = static_cast<int>(std::floor((y - y0) / size_y * kBins));
    if (bx < 0 || bx >= kBins || by < 0 || by >= kBins) continue;
    flux[by * kBins + bx] += report.scale * ray.flux;
    squares[by * kBins + bx] += std::pow(report.scale * ray.flux, 2);
  }
  const double dx = size_x / kBins / kPerBin, dy = size_y / kBins / kPerBin;
  for (int row = 0; row < kBins * kPerBin; ++row)
    for (int column = 0; column < kBins * kPerBin; ++column) {
      const double x = x0 + (column + 0.5) * dx, y = y0 + (row + 0.5) * dy;
      const double cosine = 1 / std::sqrt(1 + x * x + y * y);  // d omega = cos^3 dx dy
      fitted[row / kPerBin * kBins + column / kPerBin] +=
          lightfield::FarFieldIntensity(result.coefficients[0].field, {x, y, 1})[0] *
          std::pow(cosine, 3) * dx * dy;
    }
  double chi2 = 0, total = 0, total_fitted = 0, variance = 0;
  for (int bin = 0; bin < kBins * kBins; ++bin) {
    ASSERT_GT(squares[bin], 0);
    const double z = (fitted[bin] - flux[bin]) / std::sqrt(squares[bin]);
    EXPECT_LT(std::abs(z), 4) << "bin " << bin;
    chi2 += z * z / (kBins * kBins);
    total += flux[bin];
    total_fitted += fitted[bin];
    variance += squares[bin];
  }
  // The same rays on both sides: they differ by what texels and basis functions smear over the
  // bins' borders, which must be less than the rays' own counting noise.
  EXPECT_LT(chi2, 1);
  EXPECT_LT(std::abs(total_fitted - total), 3 * std::sqrt(variance));
}

INSTANTIATE_TEST_SUITE_P(Tm25, ForeignRays,
                         testing::Values("Cyl100k_intpl.TM25RAY",
                                         "CreatePointSourceRayFile__farfield.TM25ray"));

}  // namespace
}  // namespace luxfield::reconstruct
