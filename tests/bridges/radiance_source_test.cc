// Light sources for Radiance, judged by Radiance: along rays, where nothing is random, and on
// surfaces.
#include "luxfield/bridges/radiance_source.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/primaries.h"
#include "luxfield/core/random.h"
#include "luxfield/formats/lamp_view.h"
#include "luxfield/lightfield/light_vector.h"
#include "tests/bridges/foreign.h"
#include "tests/formats/light_field_lamps.h"
#include "tests/seed.h"

namespace luxfield::bridges {
namespace {

using lightfield::BasisKind;
using lightfield::PosedLightField;
using lightfield::Vec3;
using Lamp = std::vector<PosedLightField>;

struct PointAndDirection {
  Vec3 point, direction;
};

// R G B that rtrace says of each ray, or of each receiver with -I, in the light field's unit.
std::vector<core::Rgb> Traced(const Scratch& scratch, const Lamp& lamp, const std::string& options,
                              const std::vector<PointAndDirection>& rays,
                              const std::string& scene = "!cat lamp.rad") {
  WriteRadianceSource(scratch / "lamp.rad", lamp, "lamp.lf.exr");
  core::WriteFileAtomically(scratch / "scene.rad", scene + "\n");
  std::string bytes;
  for (const auto& [p, d] : rays) {
    const double numbers[] = {p.x, p.y, p.z, d.x, d.y, d.z};
    bytes.append(reinterpret_cast<const char*>(numbers), sizeof(numbers));
  }
  core::WriteFileAtomically(scratch / "rays", bytes);
  const std::string said =
      OutputOf(fmt::format("cd {} && PATH={}:$PATH && oconv scene.rad > lamp.oct && "
                           "rtrace -h {} -fdd lamp.oct < rays",
                           scratch.folder().string(), ForeignFolder(), options));
  std::vector<core::Rgb> values(said.size() / sizeof(core::Rgb));
  std::memcpy(values.data(), said.data(), values.size() * sizeof(core::Rgb));
  const bool lumens = lamp.front().field.geometry.unit == lightfield::FluxUnit::kLumen;
  for (auto& value : values)
    for (double& channel : value) channel *= lumens ? kRadianceEfficacy : 1;
  return values;
}

// Radiance's primaries to Rec. 709, by tristimulus values.
core::Rgb Rec709(const core::Rgb& radiance) {
  const core::Primaries of_radiance{
      {0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}, {1. / 3, 1. / 3}};
  return core::Rec709FromXyz(core::Apply(core::XyzFromRgb(of_radiance), radiance));
}

// Rays to random places on F, through random places on I of any field, from in front of both.
std::vector<PointAndDirection> RandomRays(const Lamp& lamp, int count, core::Random& random) {
  std::vector<PointAndDirection> rays;
  for (int k = 0; k < count; ++k) {
    const auto& posed = lamp[static_cast<std::size_t>(k) % lamp.size()];
    const auto& g = posed.field.geometry;
    const double cells = g.grid.basis.cells - 1;
    const Vec3 u{g.grid.u0_m + random.Uniform() * (g.grid.width + cells) * g.grid.spacing_m,
                 g.grid.v0_m + random.Uniform() * (g.grid.height + cells) * g.grid.spacing_m, 0};
    const Vec3 s{g.lattice.s0_m + random.Uniform() * g.lattice.extent_s_m(),
                 g.lattice.t1_m - random.Uniform() * g.lattice.extent_t_m(), g.delta_m};
    const Vec3 eye = u + (1.0 + random.Uniform()) * (s - u);
    rays.push_back({posed.luminaire_from_field.Point(eye),
                    posed.luminaire_from_field.Direction(lightfield::Normalized(u - s))});
  }
  return rays;
}

void ExpectSameAlongRays(const Scratch& scratch, const Lamp& lamp, double tolerance) {
  core::Random random(TestSeed(7), 1, 0);
  const auto rays = RandomRays(lamp, 400, random);
  const auto values = Traced(scratch, lamp, "-ab 0", rays);
  ASSERT_EQ(values.size(), rays.size());
  double largest = 0;
  for (const auto& [p, d] : rays)
    largest = std::max(largest, formats::RadianceTowards(lamp, p, d)[0]);
  const bool colour = lamp.front().field.geometry.channels == 3;
  int lit = 0;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const auto exact = formats::RadianceTowards(lamp, rays[k].point, rays[k].direction);
    const core::Rgb found = colour ? Rec709(values[k]) : values[k];
    for (int channel = 0; channel < (colour ? 3 : 1); ++channel)
      EXPECT_NEAR(found[channel], exact[channel],
                  tolerance * std::abs(exact[channel]) + 1e-6 * largest)
          << "ray " << k << " channel " << channel;
    lit += exact[0] > 0.01 * largest;
  }
  EXPECT_GT(lit, 50);
}

Lamp WithBasis(BasisKind kind, int channels) {
  Lamp lamp = formats::AsymmetricLamp(channels);
  auto& g = lamp[0].field.geometry;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind, 0.7), 4, 3, 0.01);
  g.grid.u0_m += 0.004;
  return lamp;
}

// The data, the mixtures and the functions are the light field: float32 is what is left.
TEST(RadianceSource, RadianceIsTheLightFieldAlongRays) {
  LUXFIELD_NEEDS_FOREIGN("rtrace");
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    SCOPED_TRACE(lightfield::Basis::Make(kind).name());
    ExpectSameAlongRays(Scratch("rays"), WithBasis(kind, 1), 2e-6);
  }
  ExpectSameAlongRays(Scratch("colour"), WithBasis(BasisKind::kBspline2, 3), 2e-4);
  ExpectSameAlongRays(Scratch("sides"), LampOfTwoFaces(), 2e-6);
}

// xform carries the functions along with the polygons.
TEST(RadianceSource, ALampThatIsMovedShinesFromThere) {
  LUXFIELD_NEEDS_FOREIGN("xform");
  const Lamp lamp = formats::AsymmetricLamp();
  core::Random random(TestSeed(8), 1, 0);
  auto rays = RandomRays(lamp, 100, random);
  std::vector<double> exact;
  for (auto& [p, d] : rays) {
    exact.push_back(formats::RadianceTowards(lamp, p, d)[0]);
    p = {p.x + 0.5, -p.y, 2.5 - p.z};  // turned by 180 degrees about x, then moved
    d = {d.x, -d.y, -d.z};
  }
  const auto values =
      Traced(Scratch("moved"), lamp, "-ab 0", rays, "!xform -rx 180 -t 0.5 0 2.5 lamp.rad");
  ASSERT_EQ(values.size(), rays.size());
  const double largest = *std::max_element(exact.begin(), exact.end());
  for (std::size_t k = 0; k < rays.size(); ++k)
    EXPECT_NEAR(values[k][0], exact[k], 1e-5 * largest) << k;
}

TEST(RadianceSource, OneImageAndDarkRimsAreEnough) {
  LUXFIELD_NEEDS_FOREIGN("rtrace");
  Lamp lamp = formats::AsymmetricLamp();
  auto& field = lamp[0].field;
  field.geometry.unit = lightfield::FluxUnit::kWatt;
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    for (std::size_t k = 0; k < field.geometry.plane_size(); ++k)
      if (m != 5 || k % 40 != 27) field.image(m, 0)[k] = 0;  // a column of texels
  const Scratch scratch("rim");
  const RadianceSource written = WriteRadianceSource(scratch / "lamp.rad", lamp, "lamp.lf.exr");
  EXPECT_EQ(written.polygons, 9);  // the support of one function
  const auto& g = field.geometry;
  const auto centre = g.grid.centre(1, 1);
  std::vector<PointAndDirection> rays;
  for (const int column : {26, 27, 28}) {
    const auto s = g.lattice.centre(10, column);
    const Vec3 u{centre.x, centre.y, 0}, d = Vec3{s.x, s.y, g.delta_m} - u;
    rays.push_back({u + 2 * d, lightfield::Normalized(-1 * d)});
  }
  const auto values = Traced(scratch, lamp, "-ab 0", rays);
  ASSERT_EQ(values.size(), 3u);
  EXPECT_EQ(values[0][0], 0);
  EXPECT_NEAR(values[1][0] / formats::RadianceTowards(lamp, rays[1].point, rays[1].direction)[0], 1,
              1e-5);
  EXPECT_EQ(values[2][0], 0);
}

// Of each receiver 16 values of Radiance's jittered quadrature, 64 places in each of 30 polygons.
TEST(RadianceSource, IlluminanceIsTheExactOne) {
  LUXFIELD_NEEDS_FOREIGN("rtrace");
  constexpr int kRepeats = 16;
  const Lamp lamp = formats::AsymmetricLamp();
  const auto& field = lamp[0].field;
  std::vector<PointAndDirection> receivers, asked;
  for (const double z : {0.05, 0.12, 0.2, 0.6, 3.0, 10.0})
    for (const double tilt : {0.0, 0.4})
      receivers.push_back({{0.25 * z, -0.1 * z, z}, {std::sin(tilt), 0, -std::cos(tilt)}});
  // rtrace lights the place 0.1 mm before the one that it is asked for.
  for (const auto& [p, n] : receivers)
    for (int k = 0; k < kRepeats; ++k) asked.push_back({p - 1e-4 * n, n});
  const auto values =
      Traced(Scratch("receivers"), lamp, "-I -ab 0 -dt 0 -dc 1 -ds 1e-4 -dj 1", asked);
  ASSERT_EQ(values.size(), asked.size());
  for (std::size_t r = 0; r < receivers.size(); ++r) {
    double sum = 0, squares = 0;
    for (int k = 0; k < kRepeats; ++k) {
      const double e = values[r * kRepeats + k][0];
      sum += e, squares += e * e;
    }
    const double mean = sum / kRepeats,
                 sigma = std::sqrt((squares / kRepeats - mean * mean) / (kRepeats - 1));
    const double exact =
        lightfield::ExactIrradiance(field, receivers[r].point, receivers[r].direction)[0];
    // 15 degrees of freedom: 7 sigma are as rare as 4.5 of a normal distribution.
    EXPECT_NEAR(mean, exact, 7 * sigma + 1e-4 * exact) << receivers[r].point.z;
    EXPECT_LT(sigma, 0.004 * exact) << receivers[r].point.z;
  }
}

TEST(RadianceSource, SaysWhatIsBelowZero) {
  Lamp lamp = formats::AsymmetricLamp();
  double sum = 0;
  for (const float c : lamp[0].field.data) sum += c;
  lamp[0].field.data[700] = static_cast<float>(-0.01 * sum);
  const RadianceSource written = WriteRadianceSource(Scratch("negative") / "x.rad", lamp, "x");
  EXPECT_NEAR(written.negative_share, 0.01, 1e-3);
}

TEST(RadianceSource, RefusesWhatRadianceCannotRead) {
  const Scratch scratch("refused");
  const auto message = [&](const std::string& name, const Lamp& lamp) -> std::string {
    try {
      WriteRadianceSource(scratch / name, lamp, "x.lf.exr");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message("my lamp.rad", formats::AsymmetricLamp()),
              testing::HasSubstr("use letters, digits"));
  Lamp dark = formats::AsymmetricLamp();
  for (float& c : dark[0].field.data) c = 0;
  EXPECT_THAT(message("x.rad", dark), testing::HasSubstr("x.lf.exr: holds no light"));
  EXPECT_TRUE(std::filesystem::is_empty(scratch.folder()));
}

}  // namespace
}  // namespace luxfield::bridges
