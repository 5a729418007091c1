// Far fields of light fields as photometric files: flux, intensities and orientation against
// closed forms and quadrature, read back from every format.
#include "luxfield/formats/far_field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/gldf.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/tm33.h"
#include "tests/formats/light_field_lamps.h"
#include "tests/seed.h"

namespace luxfield::formats {
namespace {

using lightfield::PosedLightField;
using lightfield::Vec3;

struct Format {
  const char* name;
  std::function<std::string(const Photometry&)> write;
  std::function<Photometry(const std::string&)> read;
};

std::vector<Format> Formats() {
  const auto lm63 = [](Lm63Version version) {
    return [version](const Photometry& p) { return FormatLm63(p, version, "x.ies"); };
  };
  const auto read_lm63 = [](const std::string& text) { return ParseLm63(text, "x.ies"); };
  return {{"LM-63-2002", lm63(Lm63Version::k2002), read_lm63},
          {"LM-63-2019", lm63(Lm63Version::k2019), read_lm63},
          {"EULUMDAT", [](const Photometry& p) { return FormatEulumdat(p, "x.ldt"); },
           [](const std::string& text) { return ParseEulumdat(text, "x.ldt"); }},
          {"TM-33-23", [](const Photometry& p) { return FormatTm33(p, "x.xml"); },
           [](const std::string& text) { return ParseTm33(text, "x.xml"); }},
          {"GLDF", [](const Photometry& p) { return FormatGldf(p, {}, "test", "x.gldf"); },
           [](const std::string& bytes) { return ParseGldf(bytes, "x.gldf"); }}};
}

std::string Refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

// Radiance times both cosines over r^2, by midpoints on F; r from F's point to the receiver:
//
//   I = D^2 integral L(u->s) cos(F) cos(receiver) / r^2 du
double IntensityByQuadrature(const lightfield::LightField& field, Vec3 d, double distance) {
  constexpr int kNodes = 240;
  const auto& g = field.geometry;
  const Vec3 p = distance * d;
  const double width = (g.grid.width + 2) * g.grid.spacing_m / kNodes,
               height = (g.grid.height + 2) * g.grid.spacing_m / kNodes;
  double sum = 0;
  for (int a = 0; a < kNodes; ++a)
    for (int b = 0; b < kNodes; ++b) {
      const lightfield::Vec2 u{g.grid.u0_m + (a + 0.5) * width, g.grid.v0_m + (b + 0.5) * height};
      const Vec3 way = p - Vec3{u.x, u.y, 0};
      const double r = lightfield::Length(way), to_i = g.delta_m / way.z;
      const lightfield::Vec2 s{u.x + to_i * way.x, u.y + to_i * way.y};
      sum += lightfield::Radiance(field, u, s)[0] * (way.z / r) * (lightfield::Dot(way, d) / r) /
             (r * r) * width * height;
    }
  return sum * distance * distance;
}

TEST(FarField, IntensityAtADistanceIsTheRadiancesIntegral) {
  const auto lamp = AsymmetricLamp();
  for (const Vec3 d : {Vec3{0, 0, 1}, lightfield::Normalized(Vec3{0.3, -0.12, 1})}) {
    const double exact = IntensityOf(lamp, d, 0.5);
    // Midpoints of 240 x 240 cells: each of about 8 texel edges along either side is off by half a
    // cell at most, times steps of a tenth between texels.
    EXPECT_NEAR(IntensityByQuadrature(lamp[0].field, d, 0.5) / exact, 1, 2 * 8 * 0.1 / 480);
    // Far away it is the far field: of order (size / distance)^2 and (offset / distance).
    EXPECT_NEAR(IntensityOf(lamp, d, 1e4) / IntensityOf(lamp, d, {}), 1, 1e-5);
  }
}

// Flux to 1e-4, every intensity in the table's directions to 1e-5 of the peak, and in random ones to
// a thousandth or what the table says of itself; for both lamps, far and near, through all formats.
TEST(FarField, FormatsKeepFluxAndIntensities) {
  core::Random random(TestSeed(41), 1);
  const std::vector<PosedLightField> lamps[] = {AsymmetricLamp(), LampOfTwoSides()};
  for (const auto& lamp : lamps)
    for (const auto distance : {std::optional<double>(), std::optional(0.4)}) {
      const FarField found = SampleFarField(lamp, {}, distance, "x");
      const double flux = lightfield::TotalFlux(lamp)[0];
      const double peak = FindPeak(found.table).intensity_cd;
      EXPECT_LT(found.interpolation_error(), 1e-2);
      for (const Format& format : Formats()) {
        SCOPED_TRACE(format.name);
        const Photometry read = format.read(format.write(found.table));
        EXPECT_NEAR(Flux(read) / flux, 1, 1e-4);
        for (int k = 0; k < 200; ++k) {
          const std::size_t plane = random() % found.table.planes_deg.size(),
                            angle = random() % found.table.angles_deg.size();
          const Vec3 d = Direction(PhotometryType::kC, found.table.planes_deg[plane],
                                   found.table.angles_deg[angle]);
          EXPECT_NEAR(Intensity(read, d), IntensityOf(lamp, d, distance), 1e-5 * peak);
          const double z = 2 * random.Uniform() - 1, c = 2 * std::numbers::pi * random.Uniform();
          const double sine = std::sqrt(1 - z * z);
          const Vec3 any{sine * std::cos(c), sine * std::sin(c), z};
          EXPECT_NEAR(Intensity(read, any), IntensityOf(lamp, any, distance),
                      (found.interpolation_error() + 1e-5) * peak);
        }
      }
    }
}

TEST(FarField, LampsKeepTheirOrientation) {
  const auto lamp = AsymmetricLamp();
  const FarField found = SampleFarField(lamp, {}, {}, "x");
  EXPECT_EQ(Describe(FindSymmetry(found.table)), "none");
  for (const Format& format : Formats()) {
    SCOPED_TRACE(format.name);
    const Photometry read = format.read(format.write(found.table));
    const Peak peak = FindPeak(read);
    const Vec3 d = Direction(PhotometryType::kC, peak.plane_deg, peak.angle_deg);
    // The beam's axis meets I at (50, -20) mm from the middle of F, which shines more at +u, +v.
    EXPECT_GT(d.x, 0.1);
    EXPECT_LT(d.y, -0.05);
    const double turned = Intensity(read, {-d.x, -d.y, d.z});
    const double mirrored = Intensity(read, {d.x, -d.y, d.z});
    EXPECT_LT(turned, 0.5 * peak.intensity_cd);
    EXPECT_LT(mirrored, 0.8 * peak.intensity_cd);
  }
}

// 2 x 2 functions about the axis, equal images that are even in s: the formats store a quarter.
TEST(FarField, SymmetryIsFound) {
  auto lamp = AsymmetricLamp();
  auto& field = lamp[0].field;
  const auto& g = field.geometry;
  for (int m = 0; m < g.grid.count(); ++m)
    for (int row = 0; row < g.lattice.height; ++row)
      for (int column = 0; column < g.lattice.width; ++column) {
        const auto s = g.lattice.centre(row, column);
        field.image(m, 0)[std::size_t(row * g.lattice.width + column)] =
            static_cast<float>(1e8 * std::exp(-400 * s.x * s.x - 900 * s.y * s.y));
      }
  const FarField even = SampleFarField(lamp, {}, {}, "x");
  EXPECT_EQ(Describe(FindSymmetry(even.table)), "to the planes C0-C180 and C90-C270");
  EXPECT_LT(FormatLm63(even.table, Lm63Version::k2002, "x").size(),
            std::size_t{3} * even.table.intensity_cd.size());
  // Brighter towards +u alone: v to -v is left.
  for (int m = 0; m < g.grid.count(); ++m)
    if (m % g.grid.width >= 2)
      for (float& c : field.image(m, 0)) c *= 2;
  for (int row = 0; row < g.lattice.height; ++row)
    for (int column = g.lattice.width / 2; column < g.lattice.width; ++column)
      for (int m = 0; m < g.grid.count(); ++m)
        field.image(m, 0)[std::size_t(row * g.lattice.width + column)] *= 2;
  const FarField half = SampleFarField(lamp, {}, {}, "x");
  EXPECT_EQ(Describe(FindSymmetry(half.table)), "to the plane C0-C180");
  EXPECT_NEAR(
      Flux(ParseEulumdat(FormatEulumdat(half.table, "x"), "x")) / lightfield::TotalFlux(lamp)[0], 1,
      1e-4);
}

TEST(FarField, OpeningIsTheBoxOfTheLight) {
  auto lamp = AsymmetricLamp();
  const auto& whole = SampleFarField(lamp, {30, 10}, {}, "x").table;
  EXPECT_NEAR(whole.opening.c0_m, 0.06, 1e-12);  // 4 + 2 cells of 10 mm along u
  EXPECT_NEAR(whole.opening.c90_m, 0.05, 1e-12);
  EXPECT_EQ(whole.opening.height_m, 0);
  EXPECT_EQ(whole.keyword("_OPENING_MIDDLE"), "");
  // One function alone shines: its support, which is beside the axis.
  auto& field = lamp[0].field;
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    if (m != field.geometry.grid.index(3, 1))
      for (float& c : field.image(m, 0)) c = 0;
  const auto& part = SampleFarField(lamp, {30, 10}, {}, "x").table;
  EXPECT_NEAR(part.opening.c0_m, 0.03, 1e-12);
  EXPECT_NEAR(part.opening.c90_m, 0.03, 1e-12);
  EXPECT_THAT(part.keyword("_OPENING_MIDDLE"), testing::StartsWith("15 "));
  const auto& box = SampleFarField(LampOfTwoSides(), {30, 10}, {}, "x").table;
  EXPECT_NEAR(box.opening.height_m, 0.06, 1e-12);  // u turns to -z: 20 +- 30 mm below the other F
  EXPECT_EQ(box.angles_deg.back(), 180);
}

TEST(FarField, StepsDivideAQuarter) {
  const auto lamp = AsymmetricLamp();
  const auto& p = SampleFarField(lamp, {7, 0.7}, {}, "x").table;
  EXPECT_EQ(p.planes_deg.size() % 4, 0u);
  for (const double angle : p.angles_deg)
    EXPECT_NEAR(1e3 * angle, std::round(1e3 * angle), 1e-9) << angle;
}

// The spread of flux and peak over fields with independent noise.
TEST(FarField, UncertaintyIsThatOfNoise) {
  const auto lamp = AsymmetricLamp();
  core::Random random(TestSeed(5), 1);
  auto sigma = lamp;
  for (float& c : sigma[0].field.data) c = static_cast<float>(1e5 + 0.1 * c);
  constexpr int kDraws = 300;
  for (const auto distance : {std::optional<double>(), std::optional(0.4)}) {
    const Photometry table = SampleFarField(lamp, {10, 2}, distance, "x").table;
    const auto stated = PropagateSigma(lamp, sigma, table, distance, "x");
    const Peak peak = FindPeak(table);
    const Vec3 d = Direction(PhotometryType::kC, peak.plane_deg, peak.angle_deg);
    double flux = 0, intensity = 0;
    for (int k = 0; k < kDraws; ++k) {
      auto noisy = lamp;
      for (std::size_t n = 0; n < noisy[0].field.data.size(); ++n)
        noisy[0].field.data[n] += static_cast<float>(sigma[0].field.data[n] * random.Normal());
      flux += std::pow(lightfield::TotalFlux(noisy)[0] - lightfield::TotalFlux(lamp)[0], 2);
      intensity += std::pow(IntensityOf(noisy, d, distance) - peak.intensity_cd, 2);
    }
    // The variance of a sample of n has the relative error sqrt(2/n).
    const double tolerance = 5 * std::sqrt(2.0 / kDraws);
    EXPECT_NEAR(flux / kDraws / (stated.flux * stated.flux), 1, tolerance);
    EXPECT_NEAR(intensity / kDraws / (stated.peak * stated.peak), 1, tolerance);
  }
}

TEST(FarField, LuminanceIsTakenOfColours) {
  auto lamp = AsymmetricLamp(3);
  for (int m = 0; m < lamp[0].field.geometry.grid.count(); ++m)
    for (float& c : lamp[0].field.image(m, 2)) c *= 5;
  const auto luminance = LuminanceOf(lamp);
  ASSERT_EQ(luminance[0].field.geometry.channels, 1);
  const Vec3 d = lightfield::Normalized(Vec3{0.2, -0.1, 1});
  EXPECT_NEAR(IntensityOf(luminance, d, {}) / IntensityOf(lamp, d, {}), 1, 1e-6);
}

TEST(FarField, WhatCannotBeExportedIsRefused) {
  using testing::HasSubstr;
  auto lamp = AsymmetricLamp();
  EXPECT_THAT(Refusal([&] { SampleFarField(lamp, {}, 0.03, "x.lf.exr"); }),
              HasSubstr("beyond a distance of 0.03 m; give a larger distance"));
  auto sigma = lamp;
  sigma[0].field.geometry.delta_m = 0.3;
  const Photometry table = SampleFarField(lamp, {30, 10}, {}, "x").table;
  EXPECT_THAT(Refusal([&] { PropagateSigma(lamp, sigma, table, {}, "s.lf.exr"); }),
              HasSubstr("s.lf.exr: is not of the light field's geometry"));
  for (float& c : lamp[0].field.data) c = 0;
  EXPECT_THAT(Refusal([&] { SampleFarField(lamp, {}, {}, "x.lf.exr"); }),
              HasSubstr("x.lf.exr: has no light to export"));
}

}  // namespace
}  // namespace luxfield::formats
