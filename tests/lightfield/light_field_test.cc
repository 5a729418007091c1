// The model against its definition (docs/theory.md 2).
#include "luxfield/lightfield/light_field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "luxfield/core/error.h"
#include "support.h"
#include "tests/said.h"

namespace luxfield::lightfield {
namespace {

TEST(LightField, RadianceIsTheDefinition) {
  constexpr std::uint64_t kSeed = 21;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    const LightField field = RandomField(SmallGeometry(Basis::Make(kind), 3), kSeed, -1, 1);
    const LuminaireGeometry& g = field.geometry;
    core::Random random(kSeed, 1);
    int lit = 0;
    for (int k = 0; k < 500; ++k) {
      const Vec2 u{0.2 * random.Uniform() - 0.1, 0.2 * random.Uniform() - 0.1};
      const Vec2 s{0.26 * random.Uniform() - 0.13, 0.22 * random.Uniform() - 0.11};
      // The plain sum over all basis functions and the texel whose borders enclose s.
      std::array<double, 3> expected{};
      for (int row = 0; row < g.lattice.height; ++row)
        for (int column = 0; column < g.lattice.width; ++column) {
          const Vec2 centre = g.lattice.centre(row, column);
          if (std::abs(s.x - centre.x) > g.lattice.ds_m / 2 ||
              std::abs(s.y - centre.y) > g.lattice.dt_m / 2)
            continue;
          for (int j = 0; j < g.grid.height; ++j)
            for (int i = 0; i < g.grid.width; ++i)
              for (int channel = 0; channel < 3; ++channel)
                expected[channel] +=
                    field.data[((static_cast<std::size_t>(j * 4 + i) * 3 + channel) * 11 + row) *
                                   13 +
                               column] *
                    g.grid.Phi(i, j, u);
        }
      const double dx = s.x - u.x, dy = s.y - u.y, r2 = g.delta_m * g.delta_m + dx * dx + dy * dy;
      const double scale = r2 * r2 / (g.delta_m * g.delta_m);  // delta^2 / cos^4
      const auto radiance = Radiance(field, u, s);
      for (int channel = 0; channel < 3; ++channel) {
        EXPECT_NEAR(radiance[channel], scale * expected[channel], 1e-14 * scale * 9);
        lit += expected[channel] != 0;
      }
    }
    EXPECT_GT(lit, 100);  // the sample does reach the luminaire
  }
}

TEST(LightField, RadianceOutsideIsZero) {
  const LightField field = RandomField(SmallGeometry(Basis::Make(BasisKind::kBspline2)), 22);
  EXPECT_GT(Radiance(field, {0, 0}, {0, 0})[0], 0);
  EXPECT_EQ(Radiance(field, {0.5, 0}, {0, 0})[0], 0);
  EXPECT_EQ(Radiance(field, {0, 0}, {0, 0.5})[0], 0);
  EXPECT_EQ(Radiance(field, {0, NAN}, {0, 0})[0], 0);
  EXPECT_EQ(Radiance(field, {0, 0}, {-1e300, 0})[0], 0);
}

TEST(LightField, OneChannelIsRepeated) {
  const LightField field = RandomField(SmallGeometry(Basis::Make(BasisKind::kBspline2)), 23);
  const auto radiance = Radiance(field, {0.001, 0.002}, {0.003, 0.004});
  EXPECT_EQ(radiance[0], radiance[1]);
  EXPECT_EQ(radiance[0], radiance[2]);
}

TEST(LightField, TotalFluxOfAConstantFieldIsAreaTimesArea) {
  LightField field(SmallGeometry(Basis::Make(BasisKind::kQuadratic, 0.5), 3));
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    for (float& value : field.image(m, 1)) value = 2.5f;
  const auto flux = TotalFlux(field);
  const double phi = 0.021 * 0.021 * (1 - 0.5 / 3) * (1 - 0.5 / 3);
  const double area = 13 * 0.017 * 11 * 0.016;
  EXPECT_EQ(flux[0], 0);
  EXPECT_NEAR(flux[1] / (12 * 2.5 * phi * area), 1, 1e-13);
}

// I(dir) = delta^2 / cos^3 * integral of E(u -> u + shift) du, by Gauss-Legendre between the knots
// and texel borders.
TEST(LightField, FarFieldIntensityMatchesQuadrature) {
  constexpr std::uint64_t kSeed = 24;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    const LightField field = RandomField(SmallGeometry(Basis::Make(kind)), kSeed, -0.2, 1);
    const LuminaireGeometry& g = field.geometry;
    core::Random random(kSeed, 1);
    for (int k = 0; k < 25; ++k) {
      const Vec3 direction{2 * random.Uniform() - 1, 2 * random.Uniform() - 1, 1};
      const Vec2 shift = g.delta_m * Vec2{direction.x, direction.y};
      const auto to_u_x = [&](double s) { return s - shift.x; };
      const auto to_u_y = [&](double t) { return t - shift.y; };
      double sum = 0, magnitude = 0;
      for (const Node& v : GaussNodes(BreakpointsV(g, to_u_y)))
        for (const Node& u : GaussNodes(BreakpointsU(g, to_u_x))) {
          const Vec2 point{u.x, v.x};
          const double term = u.weight * v.weight * FluxDensity(field, point, point + shift)[0];
          sum += term;
          magnitude += std::abs(term);
        }
      const double scale = g.delta_m * g.delta_m * std::pow(Length(direction), 3);
      EXPECT_NEAR(FarFieldIntensity(field, direction)[0], scale * sum, 1e-12 * scale * magnitude);
      EXPECT_NEAR(FarFieldIntensity(field, 1e-3 * direction)[0], scale * sum,
                  1e-12 * scale * magnitude);
    }
  }
}

// All texels equal 1: the light that goes straight ahead is the overlap of F's profile with the
// lattice, in closed form.
TEST(LightField, FarFieldOfAConstantFieldOnAxisIsClosedForm) {
  LuminaireGeometry g = SmallGeometry(Basis::Make(BasisKind::kBspline2));
  LightField field(g);
  for (float& value : field.data) value = 1;
  // The lattice covers all supports, so each contributes h^2.
  EXPECT_NEAR(FarFieldIntensity(field, {0, 0, 1})[0], g.delta_m * g.delta_m * 12 * 0.021 * 0.021,
              1e-15);
}

TEST(LightField, FarFieldExtremes) {
  const LightField field = RandomField(SmallGeometry(Basis::Make(BasisKind::kBspline2)), 25);
  for (const Vec3 direction : {Vec3{0, 0, -1}, Vec3{1, 0, 0}, Vec3{1, 0, 1e-300}, Vec3{-1, 1, 1e-9},
                               Vec3{0, 0, 0}, Vec3{NAN, 0, 1}}) {
    const auto intensity = FarFieldIntensity(field, direction);
    EXPECT_EQ(intensity[0], 0) << direction.x << ' ' << direction.z;
  }
}

TEST(LuminaireGeometry, ValidateNamesFileAndField) {
  const LuminaireGeometry good = SmallGeometry(Basis::Make(BasisKind::kBspline2));
  EXPECT_NO_THROW(good.Validate("lamp.lf.exr"));
  const auto message = [&](auto&& spoil) {
    LuminaireGeometry g = good;
    spoil(g);
    try {
      g.Validate("lamp.lf.exr");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const auto expect = [&](const char* field, auto&& spoil) {
    const std::string text = message(spoil);
    EXPECT_NE(text.find("lamp.lf.exr"), std::string::npos) << text;
    EXPECT_NE(text.find(field), std::string::npos) << text;
  };
  expect("delta_m", [](LuminaireGeometry& g) { g.delta_m = 0; });
  expect("delta_m", [](LuminaireGeometry& g) { g.delta_m = NAN; });
  expect("spacing_m", [](LuminaireGeometry& g) { g.grid.spacing_m = -0.01; });
  expect("basis width", [](LuminaireGeometry& g) { g.grid.width = 0; });
  expect("basis height", [](LuminaireGeometry& g) { g.grid.height = 101; });
  expect("u0_m", [](LuminaireGeometry& g) { g.grid.u0_m = INFINITY; });
  expect("image width", [](LuminaireGeometry& g) { g.lattice.width = 1 << 20; });
  expect("ds_m", [](LuminaireGeometry& g) { g.lattice.ds_m = 0; });
  expect("dt_m", [](LuminaireGeometry& g) { g.lattice.dt_m = -1; });
  expect("t1_m", [](LuminaireGeometry& g) { g.lattice.t1_m = NAN; });
  expect("channels", [](LuminaireGeometry& g) { g.channels = 2; });
  expect("2^33", [](LuminaireGeometry& g) { g.lattice.width = g.lattice.height = 1 << 15; });
}

TEST(FluxUnit, NamesRoundTrip) {
  for (const FluxUnit unit : {FluxUnit::kWatt, FluxUnit::kLumen, FluxUnit::kRelative})
    EXPECT_EQ(FluxUnitFromName(FluxUnitName(unit)), unit);
  EXPECT_THROW(FluxUnitFromName("candela"), InputError);
}

// Lengths in millimetres are named; those of lamps are not.
TEST(LuminaireGeometryTest, LengthsThatNoLampHasAreSuspect) {
  const auto printed = [](const std::function<void(LuminaireGeometry&)>& change) {
    LuminaireGeometry geometry = SmallGeometry(Basis::Make(BasisKind::kBspline2));
    change(geometry);
    return Said([&] { geometry.Validate("mm.lf.exr"); });
  };
  EXPECT_EQ(printed([](LuminaireGeometry&) {}), "");
  EXPECT_EQ(printed([](LuminaireGeometry& g) { g.lattice.ds_m = g.lattice.dt_m = 0.4; }), "");
  const auto suspect = [&](const char* field,
                           const std::function<void(LuminaireGeometry&)>& change) {
    EXPECT_THAT(printed(change),
                testing::AllOf(testing::HasSubstr("mm.lf.exr: " + std::string(field) + " = "),
                               testing::HasSubstr("metres?")))
        << field;
  };
  suspect("delta_m", [](LuminaireGeometry& g) { g.delta_m = 120; });
  suspect("spacing_m", [](LuminaireGeometry& g) { g.grid.spacing_m = 21; });
  suspect("u0_m", [](LuminaireGeometry& g) { g.grid.u0_m = -42; });
  suspect("v0_m", [](LuminaireGeometry& g) { g.grid.v0_m = -42; });
  suspect("ds_m", [](LuminaireGeometry& g) { g.lattice.ds_m = 6; });
  suspect("dt_m", [](LuminaireGeometry& g) { g.lattice.dt_m = 6; });
  suspect("s0_m", [](LuminaireGeometry& g) { g.lattice.s0_m = -110; });
  suspect("t1_m", [](LuminaireGeometry& g) { g.lattice.t1_m = 95; });
}

}  // namespace
}  // namespace luxfield::lightfield
